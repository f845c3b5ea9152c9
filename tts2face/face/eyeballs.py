"""Clearance of the skin around the eyes: what a sum of shapes moves into an eyeball lies on its surface instead.

Each shape of a face keeps its lids outside the eyeballs, but sums of shapes do not: shapes move vertices on straight
lines, and those of the default person move the lids of all other people. Between its vertices skin cuts through a large
eyeball, which therefore sinks behind the lids beside their opening.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Eye, Face, FacePart
from tts2face.models.landmarks import LEFT_LIDS, RIGHT_LIDS
from tts2face.numeric.arrays import Float32Array
from tts2face.numeric.kernels import kernel

MARGIN_MM = 0.3  # between skin and eyeball: edges of 2 mm lie below a surface of 14 mm radius by a tenth of it
# Of the distance at rest, and at most: the skin of the socket lies below that of the cheek.
OUTER_SHARE, OUTER_MARGIN_MM = 0.5, 0.9
SUNK_MM = 0.3  # depth at rest up to which skin belongs to the lids; it sinks no deeper
REACH_MM = 12.0  # distance from the eyeball at rest of skin that shapes may move into it
ROOT_MM = 2.5  # distance from the eyeball at rest of the lids' edges, which lashes and tear fluid follow
FOLLOWER_PARTS = ("lashes", "wet")
FOLLOWER_REACH_MM = 15.0  # length of lashes; those of other people, hidden in the skull, are further away
# edges of lids that a lash follows
N_ROOTS = 3
N_ANGLES = 64  # of an eyeball's profile
SINK_SLOPE, SINK_SHARE = 2.0, 0.12  # of the way beyond the edge of a lid, and of the eyeball's radius at most


@dataclass(frozen=True, slots=True, eq=False)
class EyeballClearance:
    """Skin that stays outside the eyeballs; built by `build_clearance`.

    Parameters
    ----------
    lids, eyes, margins : (N,), (N,), (N,)
        Vertices of the skin, number of the eyeball each may touch, and least distance from it, mm; negative
        for an edge that lies in the eyeball at rest.
    profiles : (E, N_ANGLES)
        Distance of each eyeball's surface from its centre by the angle from the gaze, from 0 to pi, mm.
    shifts : (E, K, 3)
        Displacement of each eyeball per weight of each shape, mm.
    followers, roots, shares : (M,), (M, N_ROOTS), (M, N_ROOTS)
        Vertices of lashes and tear fluid, and the rows of `lids` that displace them, with their shares.
    openings
        Edges of the lids.
    """

    lids: NDArray[np.int64]
    eyes: NDArray[np.int64]
    margins: Float32Array
    profiles: Float32Array
    shifts: Float32Array
    followers: NDArray[np.int64]
    roots: NDArray[np.int64]
    shares: Float32Array
    openings: "EyeOpenings"

    def centres(self, rest: Float32Array, weights: Float32Array) -> Float32Array:
        """Centres (E, 3) of the eyeballs for their places at rest (E, 3) and shape weights (K,)."""
        return np.asarray(rest + np.einsum("ekc,k->ec", self.shifts, weights), np.float32)

    def enforce(self, centres: Float32Array, turns: Float32Array, vertices: Float32Array) -> None:
        """Move vertices (V, 3) out of eyeballs with centres (E, 3) and rotations (E, 3, 3), in place."""
        if len(self.lids):
            gazes = np.ascontiguousarray(turns[:, :, 2])
            moved = np.zeros((len(self.lids), 3), np.float32)
            largest = self.profiles.max() + self.margins.max()
            _push_out((self.lids, self.eyes, self.margins, largest), (self.profiles, centres, gazes), vertices, moved)
            _follow(self.followers, self.roots, self.shares, moved, vertices)


@dataclass(frozen=True, slots=True, eq=False)
class EyeOpenings:
    """Edges of the lids of eyes that have their landmarks.

    Parameters
    ----------
    spans, radius : (E, 2), (E,)
        First vertex and one past the last of each eyeball, and its radius, mm.
    lids : (E, 2, 9)
        Rows of the landmarks of the upper and the lower lid, towards the person's left; -1 without.
    corners, weights : (L, 3), (L, 3)
        Vertices of the landmarks, and their shares.
    """

    spans: NDArray[np.int64]
    radius: Float32Array
    lids: NDArray[np.int64]
    corners: NDArray[np.int32]
    weights: Float32Array

    @property
    def found(self) -> NDArray[np.bool_]:
        """(E,) eyes with landmarks."""
        return self.lids[:, 0, 0] >= 0

    def edges(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """(E', 2, 9, 3) edges of the lids of eyes with landmarks, for vertices (V, 3)."""
        rows = self.lids[self.found]
        edges: NDArray[np.floating] = np.einsum("elkcx,elkc->elkx", points[self.corners[rows]], self.weights[rows])
        return edges

    def sink(self, centres: NDArray[np.floating], points: Float32Array) -> None:
        """Move vertices (V, 3) of eyeballs with centres (E, 3) back behind lids, in place, before the head moves."""
        found = self.found
        if not found.any():
            return
        middles = centres[found].astype(np.float32)
        off = (self.edges(points) - middles[:, None, None]).astype(np.float32)
        eye, lid = np.arange(len(off))[:, None, None], np.arange(off.shape[1])[:, None]
        _sink(
            self.spans[found],
            middles,
            off[eye, lid, off[..., 0].argsort(axis=2)],
            SINK_SHARE * self.radius[found],
            points,
        )


def eye_openings(face: Face) -> EyeOpenings:
    """Edges of the lids of a face; a photograph's eyes are pictures, which lie behind its skin."""
    rows = {int(number): row for row, number in enumerate(face.landmarks)}
    lids = np.full((len(face.eyes), 2, len(RIGHT_LIDS[0])), -1, np.int64)
    radius = np.zeros(len(face.eyes), np.float32)
    for number, eye in enumerate(face.eyes):
        ball = face.vertices[eye.first : eye.first + eye.count] - eye.centre
        radius[number] = max(float(np.median(np.linalg.norm(ball, axis=1))), 1e-3)
        names = RIGHT_LIDS if eye.centre[0] < 0 else [lid[::-1] for lid in LEFT_LIDS]
        if all(name in rows for lid in names for name in lid) and not face.light.is_flat:
            lids[number] = [[rows[name] for name in lid] for lid in names]
    spans = np.array([(eye.first, eye.first + eye.count) for eye in face.eyes], np.int64).reshape(-1, 2)
    corners, weights = np.array(face.landmark_vertices), np.array(face.landmark_weights, np.float32)
    return EyeOpenings(spans, radius, lids, corners, weights)


def build_clearance(face: Face) -> EyeballClearance:
    """Clearance of a face: of parts of kind skin, so that characters of other programs stay as they were made."""
    skin = _part_vertices(face, lambda part: part.kind == "skin")
    profiles = np.array([eyeball_profile(face, eye) for eye in face.eyes]).reshape(-1, N_ANGLES)
    lids, eyes, outside = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0)]
    for number, eye in enumerate(face.eyes):
        off = face.vertices[skin].astype(np.float64) - eye.centre
        beyond = _distances_outside(off, profiles[number])
        near = np.flatnonzero((beyond > -SUNK_MM) & (beyond < REACH_MM) & (off[:, 2] > 0))
        lids.append(skin[near])
        eyes.append(np.full(len(near), number))
        outside.append(beyond[near])
    beyond = np.concatenate(outside)
    followers, roots, shares = _bind_followers(face, np.concatenate(lids), beyond)
    shifts = [face.shapes[:, eye.first : eye.first + eye.count].mean(axis=1) for eye in face.eyes]
    return EyeballClearance(
        lids=np.concatenate(lids),
        eyes=np.concatenate(eyes),
        margins=_margins(beyond).astype(np.float32),
        profiles=profiles.astype(np.float32),
        shifts=np.array(shifts, np.float32).reshape(len(face.eyes), len(face.shape_names), 3),
        followers=followers,
        roots=roots,
        shares=shares,
        openings=eye_openings(face),
    )


def eyeball_profile(face: Face, eye: Eye) -> NDArray[np.float64]:
    """(N_ANGLES,) distance of an eyeball's surface from its centre at equal steps of the angle from +z, mm."""
    off = face.vertices[eye.first : eye.first + eye.count].astype(np.float64) - eye.centre
    radius = np.linalg.norm(off, axis=1)
    angle = np.arccos(np.clip(off[:, 2] / np.maximum(radius, 1e-9), -1.0, 1.0))
    order = np.argsort(angle)
    profile: NDArray[np.float64] = np.interp(np.linspace(0.0, np.pi, N_ANGLES), angle[order], radius[order])
    return profile


def _distances_outside(off: NDArray[np.float64], profile: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) distances of points (N, 3) from an eyeball's surface, mm; negative inside."""
    distance = np.linalg.norm(off, axis=1)
    # rounding may exceed 1
    angle = np.arccos(np.clip(off[:, 2] / np.maximum(distance, 1e-9), -1.0, 1.0))
    beyond: NDArray[np.float64] = distance - np.interp(angle, np.linspace(0.0, np.pi, N_ANGLES), profile)
    return beyond


def _margins(beyond: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) least distances of skin that lies `beyond` (N,) mm from an eyeball at rest."""
    outer = np.clip(OUTER_SHARE * beyond, MARGIN_MM, OUTER_MARGIN_MM)
    least: NDArray[np.float64] = np.minimum(beyond, outer)
    return least


def _part_vertices(face: Face, is_chosen: Callable[[FacePart], bool]) -> NDArray[np.int64]:
    """Vertices of some of a face's parts."""
    used = [face.triangles[part.first : part.first + part.count].ravel() for part in face.parts if is_chosen(part)]
    return np.unique(np.concatenate([np.zeros(0, np.int64), *used])).astype(np.int64)


def _bind_followers(
    face: Face, lids: NDArray[np.int64], beyond: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Float32Array]:
    """Followers (M,), their roots (M, N_ROOTS) as rows of `lids`, and shares (M, N_ROOTS)."""
    followers = _part_vertices(face, lambda part: part.name in FOLLOWER_PARTS)
    edges = np.flatnonzero(beyond < ROOT_MM)
    if len(edges) < N_ROOTS or not len(followers):
        return np.zeros(0, np.int64), np.zeros((0, N_ROOTS), np.int64), np.zeros((0, N_ROOTS), np.float32)
    x, y, z = (
        face.vertices[followers, k].astype(np.float64)[:, None] - face.vertices[lids[edges], k] for k in range(3)
    )
    apart = np.sqrt(x**2 + y**2 + z**2)  # a tree costs more to import than this
    nearest, distance = np.zeros((len(apart), N_ROOTS), np.int64), np.zeros((len(apart), N_ROOTS))
    rows = np.arange(len(apart))
    for k in range(N_ROOTS):  # sorting all takes longer
        nearest[:, k] = apart.argmin(axis=1)
        distance[:, k] = apart[rows, nearest[:, k]]
        apart[rows, nearest[:, k]] = np.inf
    is_near = distance[:, 0] < FOLLOWER_REACH_MM
    # a lash at an edge follows that alone; 0.05 mm keeps the share finite
    share = 1.0 / np.maximum(distance[is_near], 0.05) ** 2
    share /= share.sum(axis=1, keepdims=True)
    return followers[is_near], edges[nearest[is_near]], share.astype(np.float32)


@kernel
def _push_out(skin, balls, vertices, moved):  # type: ignore[no-untyped-def]
    """Move the skin's vertices radially out of the eyeballs; writes their displacements.

    ``largest`` is an argument because a kernel that calls `max` of an array loads scipy.linalg, a tenth of a second.
    """
    lids, eyes, margins, largest = skin
    profiles, centres, gazes = balls
    n_steps = profiles.shape[1] - 1
    for i in range(len(lids)):
        v, e = lids[i], eyes[i]
        x, y, z = vertices[v, 0] - centres[e, 0], vertices[v, 1] - centres[e, 1], vertices[v, 2] - centres[e, 2]
        distance = np.sqrt(x * x + y * y + z * z)
        if distance > largest or distance < 1e-6:
            continue
        cosine = (x * gazes[e, 0] + y * gazes[e, 1] + z * gazes[e, 2]) / distance
        step = np.arccos(min(max(cosine, np.float32(-1.0)), np.float32(1.0))) / np.pi * n_steps
        low = min(int(step), n_steps - 1)
        surface = profiles[e, low] + (step - low) * (profiles[e, low + 1] - profiles[e, low])
        lacking = surface + margins[i] - distance
        if lacking > 0:
            share = lacking / distance
            moved[i, 0], moved[i, 1], moved[i, 2] = share * x, share * y, share * z
            for c in range(3):
                vertices[v, c] += moved[i, c]


@kernel
def _follow(followers, roots, shares, moved, vertices):  # type: ignore[no-untyped-def]
    for i in range(len(followers)):
        for k in range(roots.shape[1]):
            share, root = shares[i, k], roots[i, k]
            for c in range(3):
                vertices[followers[i], c] += share * moved[root, c]


@kernel
def _height(lid, across):  # type: ignore[no-untyped-def]
    """Height of a lid's edge (L, 3) at a place across."""
    for k in range(len(lid) - 1):
        x0, x1 = lid[k, 0], lid[k + 1, 0]
        if across <= x1:
            share = min(max((across - x0) / (x1 - x0), np.float32(0)), np.float32(1)) if x1 > x0 else np.float32(0)
            return lid[k, 1] + share * (lid[k + 1, 1] - lid[k, 1])
    return lid[len(lid) - 1, 1]


@kernel
def _sink(spans, centres, lids, most, vertices):  # type: ignore[no-untyped-def]
    """Move the vertices of eyeballs in spans (E, 2) back by up to `most` (E,) mm beyond edges of lids (E, 2, L, 3)."""
    for e in range(len(spans)):
        upper, lower = lids[e, 0], lids[e, 1]
        last = len(upper) - 1
        for v in range(spans[e, 0], spans[e, 1]):
            x, y = vertices[v, 0] - centres[e, 0], vertices[v, 1] - centres[e, 1]
            if vertices[v, 2] > centres[e, 2]:
                beyond = max(y - _height(upper, x), _height(lower, x) - y)
                beyond = max(beyond, min(upper[0, 0], lower[0, 0]) - x, x - max(upper[last, 0], lower[last, 0]))
                vertices[v, 2] -= min(max(np.float32(SINK_SLOPE) * beyond, np.float32(0)), most[e])
