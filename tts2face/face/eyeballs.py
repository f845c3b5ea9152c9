"""Clearance of the skin around the eyes: what a sum of shapes moves into an eyeball lies on its surface instead.

Each shape of a face keeps its lids outside the eyeballs, but sums of shapes do not: shapes move vertices on straight
lines, and those of the default person move the lids of all other people.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Eye, Face, FacePart
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
    """

    lids: NDArray[np.int64]
    eyes: NDArray[np.int64]
    margins: Float32Array
    profiles: Float32Array
    shifts: Float32Array
    followers: NDArray[np.int64]
    roots: NDArray[np.int64]
    shares: Float32Array

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
