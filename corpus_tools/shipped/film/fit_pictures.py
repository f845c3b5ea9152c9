"""Fit of the light round the mouth to the path tracer's pictures, pixel by pixel.

A baked vertex of a tooth lies behind a lip where the opening is narrow, and is dark; what is seen of the tooth between
two such vertices is not. Texels in the fold of a lip are coarse. So responses are corrected by what the pictures of the
fitted poses show: ridge regression on all of their pixels, by conjugate gradients (Hestenes and Stiefel 1952).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from corpus_tools.shipped.film.compare import over_grey
from corpus_tools.shipped.film.fit_light import MOST_SHARE, neighbours, vertex_parts
from corpus_tools.shipped.film.poses import LitPose
from tts2face.models.baked_light import LIMIT_STEP, BakedLight, quantised
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, Pixels
from tts2face.picture.baked.scene import LitScene
from tts2face.picture.baked.visibility import TRIANGLE_MASK, X, Y, nearest_triangles, project
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

SIDE_PX = 640
RIDGE = 60.0  # of changes of responses, in pixels
ALIKE_RIDGE = 1e-4  # of those of all vertices of a part alike, of their squares
MOST_MISSING = 80.0  # of 255: more is another surface at an edge
LIMIT_ROUNDS = 2  # of neighbours
OPPONENT = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]).T / np.sqrt([3.0, 2.0, 6.0])  # colours to tone and two others
ROUNDS = 40  # of conjugate gradients
TONE_ROUNDS, COLOUR_ROUNDS = 3, 6  # of neighbours over which changes are alike; colours of teeth, too: else striped


@dataclass(frozen=True, slots=True, eq=False)
class Missing:
    """Light that a drawn picture lacks in n pixels of one surface each.

    Attributes
    ----------
    shares : (n, N)
        Of the lit vertices in each pixel.
    light : (n, 3)
    terms : (T, N)
    """

    shares: Any
    light: FloatArray
    terms: FloatArray


def fit_to_pictures(face: Face, poses: Sequence[LitPose], pictures: Mapping[str, Pixels]) -> BakedLight:
    """Light of a face whose pictures (S, S, 4) of poses, by their names, are nearer to these; S is `SIDE_PX`."""
    scene, skin, mouth = _missing(face, poses, pictures)
    light, drawn = scene.lit.baked, scene.surface.light
    rows, mouth_rows = (
        np.flatnonzero(np.isin(every, own))
        for every, own in ((light.rows, drawn.rows), (light.mouth_rows, drawn.mouth_rows))
    )
    parts = vertex_parts(face)[drawn.mouth_rows]
    alike = np.zeros((len(light.mouth_responses), 3, len(parts)))
    for name in np.unique(parts):
        own = parts == name
        alike[:, :, own] = _alike([_among(item, own) for item in mouth])[:, :, None]
    near, among = _neighbours(face, drawn.rows), _neighbours(face, light.mouth_rows)
    changes = _changes(skin, near)
    of_skin = _corrected((_responses(light.responses, light.response_sizes), light.limits), rows, skin, changes, near)
    found = _unstriped(_responses(light.mouth_responses, light.mouth_sizes).transpose(0, 2, 1), among).transpose(
        0, 2, 1
    )
    of_mouth = _corrected((found, light.mouth_limits), mouth_rows, mouth, alike, _neighbours(face, drawn.mouth_rows))
    base = _unstriped(light.mouth_base[None].astype(np.float64), among)[0]
    return replace(
        light,
        mouth_base=np.rint(base).clip(0, 255).astype(np.uint8),
        responses=of_skin[0],
        response_sizes=of_skin[1],
        limits=of_skin[2],
        mouth_responses=of_mouth[0],
        mouth_sizes=of_mouth[1],
        mouth_limits=of_mouth[2],
    )


def _missing(
    face: Face, poses: Sequence[LitPose], pictures: Mapping[str, Pixels]
) -> tuple[LitScene, list[Missing], list[Missing]]:
    """Light that is missing in each pose, of the skin's and the mouth's vertices that are drawn."""
    renderer = mesh_renderer(face, Picture(size=f"{SIDE_PX}x{SIDE_PX}", background="transparent"))
    scene = renderer.scene
    if not isinstance(scene, LitScene):
        raise TypeError("the face has no baked light")
    n, m = len(scene.surface.light.rows), len(scene.surface.light.mouth_rows)
    buffers = scene.surface.terms.allocate_buffers()
    found: tuple[list[Missing], list[Missing]] = ([], [])
    for pose in poses:
        shares, pixels = _shares(scene, pose, pictures[pose.name][:, :, 3] == 255)
        drawn = over_grey(renderer.draw(pose.weights, pose.head))[pixels].astype(np.float64)
        light = np.clip(over_grey(pictures[pose.name])[pixels] - drawn, -MOST_MISSING, MOST_MISSING)
        scene.surface.terms.update(scene.deform(pose.weights), buffers)
        for own, span, terms in (
            (found[0], slice(0, n), buffers.terms[:, :n]),
            (found[1], slice(n, n + m), buffers.mouth),
        ):
            among = shares[:, span]
            lit = np.asarray(among.sum(axis=1)).ravel() > 0
            own.append(Missing(among[lit], light[lit], terms.astype(np.float64)))
    return scene, *found


def _shares(scene: LitScene, pose: LitPose, wanted: NDArray[np.bool_]) -> tuple[Any, Any]:
    """Shares (n, V) of the surface's vertices in those wanted pixels (S, S) that one piece fills, and the pixels."""
    surface, side, n = scene.surface, SIDE_PX, scene.picture.samples_per_side
    table = surface.template.copy()
    optics = (scene.optics.view.astype(np.float32), scene.optics.lens.astype(np.float32))
    project(scene.pose(pose.weights, pose.head), surface.source, *optics, table)
    nearest, _, _ = nearest_triangles(table, surface.triangles, (side * n, side * n))
    seen = (nearest[:, : side * n] & TRIANGLE_MASK) - 1
    samples = seen.reshape(side, n, side, n).transpose(0, 2, 1, 3).reshape(side, side, n * n)
    pieces = np.where(samples >= 0, surface.piece_of[samples], -1)
    down, across = np.nonzero(wanted & (samples >= 0).all(axis=2) & (pieces == pieces[:, :, :1]).all(axis=2))
    corners = surface.triangles[samples[down, across, n * n // 2]]
    a, b, c = np.moveaxis(table[corners][:, :, [X, Y]].astype(np.float64), 1, 0)
    place = np.column_stack([across, down]) * n + (n - 1) / 2 - a
    first, second = b - a, c - a
    whole = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    at_b = (place[:, 0] * second[:, 1] - place[:, 1] * second[:, 0]) / whole
    at_c = (first[:, 0] * place[:, 1] - first[:, 1] * place[:, 0]) / whole
    shares = np.clip(np.column_stack([1 - at_b - at_c, at_b, at_c]), 0, 1)
    shares /= shares.sum(axis=1, keepdims=True)
    starts = np.arange(0, shares.size + 1, 3)
    return sparse.csr_matrix((shares.ravel(), corners.ravel(), starts), (len(corners), len(table))), (down, across)


def _among(missing: Missing, own: NDArray[np.bool_]) -> Missing:
    """Light that is missing in the pixels of some vertices (N,) of a part."""
    shares = missing.shares[:, own]
    seen = np.asarray(shares.sum(axis=1)).ravel() > 0
    return Missing(shares[seen], missing.light[seen], missing.terms[:, own])


def _alike(missing: Sequence[Missing]) -> FloatArray:
    """(T, 3) change of the responses of all vertices of a part; each pose counts by the root of its pixels."""
    rows = [(view.shares @ view.terms.T, view.light, max(len(view.light), 1) ** -0.5) for view in missing]
    gram = sum(share * terms.T @ terms for terms, _, share in rows)
    sizes = np.sqrt(np.diag(gram)) + 1e-9
    moments = sum(share * terms.T @ light for terms, light, share in rows)
    scaled = gram / np.outer(sizes, sizes) + ALIKE_RIDGE * np.eye(len(gram))
    change: FloatArray = np.linalg.solve(scaled, moments / sizes[:, None]) / sizes[:, None]
    return change


def _responses(steps: NDArray[np.int8], sizes: NDArray[np.float32]) -> FloatArray:
    found: FloatArray = steps.astype(np.float64) * sizes[:, None, None]
    return found


def _corrected(
    answers: tuple[FloatArray, NDArray[np.int8]],
    rows: NDArray[np.int64],
    missing: Sequence[Missing],
    changes: FloatArray,
    near: Any,
) -> tuple[NDArray[np.int8], NDArray[np.float32], NDArray[np.int8]]:
    """Steps of responses (T, 3, N), their sizes and limits, of which those of rows (n,) take changes (T, 3, n).

    Limits are means over neighbours (n, n): single vertices that are cut off are specks.
    """
    found, limits = answers
    found[:, :, rows] += changes
    least, most = limits[:, :, rows].astype(np.float64) * LIMIT_STEP
    for view in missing:
        shown = np.asarray(view.shares.sum(axis=0)).ravel() > 0
        change = np.where(shown, np.einsum("tn,tcn->cn", view.terms, found[:, :, rows]), 0.0)
        least, most = np.minimum(least, change), np.maximum(most, change)
    for _ in range(LIMIT_ROUNDS):
        least, most = least @ near.T, most @ near.T
    wider = limits.copy()
    wider[:, :, rows] = np.clip(np.rint(np.array([least, most]) / LIMIT_STEP), -127, 127)
    return *quantised(found, MOST_SHARE), wider


def _neighbours(face: Face, rows: NDArray[np.int32]) -> Any:
    """(N, N) means over the neighbours of vertices (N,)."""
    at = np.full(len(face.vertices), -1)
    at[rows] = np.arange(len(rows))
    corners = at[face.triangles]
    return neighbours(corners[(corners >= 0).all(axis=1)], face.vertices[rows])


def _smoothed(values: FloatArray, near: Any, tone_rounds: int) -> FloatArray:
    """Values (T, N, 3) as means over neighbours (N, N): so many rounds for tones, `COLOUR_ROUNDS` for colours.

    The channels are those of `OPPONENT`.
    """
    found = values.copy()
    for channel, n_rounds in enumerate((tone_rounds, COLOUR_ROUNDS, COLOUR_ROUNDS)):
        for _ in range(n_rounds):
            found[:, :, channel] = found[:, :, channel] @ near.T
    return found


def _unstriped(values: FloatArray, near: Any) -> FloatArray:
    """Values (T, N, 3) of vertices that change slowly over each part; noise makes stripes on teeth."""
    found: FloatArray = _smoothed(values @ OPPONENT, near, TONE_ROUNDS) @ OPPONENT.T
    return found


def _changes(missing: Sequence[Missing], near: Any) -> FloatArray:
    """(T, 3, N) changes of responses that add what is missing, smooth over neighbours (N, N)."""
    sizes = np.sqrt(np.mean([(view.terms**2).mean(axis=1) for view in missing], axis=0)) + 1e-9
    terms = [(view.terms / sizes[:, None])[:, :, None] for view in missing]
    back = [view.shares.T.tocsr() for view in missing]

    def normal(change: FloatArray) -> FloatArray:
        spread = _smoothed(change, near, TONE_ROUNDS)
        total = sum(
            own * (gather @ (view.shares @ (own * spread).sum(axis=0)))
            for view, own, gather in zip(missing, terms, back, strict=True)
        )
        return RIDGE * change + _smoothed(total, near.T, TONE_ROUNDS)

    change = np.zeros((*terms[0].shape[:2], 3))
    rest = sum(own * (gather @ (view.light @ OPPONENT)) for view, own, gather in zip(missing, terms, back, strict=True))
    rest = _smoothed(rest, near.T, TONE_ROUNDS)
    step, size = rest.copy(), (rest**2).sum(axis=(0, 1))
    for _ in range(ROUNDS):
        ahead = normal(step)
        share = size / np.maximum((step * ahead).sum(axis=(0, 1)), 1e-12)
        change, rest = change + share * step, rest - share * ahead
        before, size = size, (rest**2).sum(axis=(0, 1))
        step = rest + size / np.maximum(before, 1e-12) * step
    found: FloatArray = _smoothed(change, near, TONE_ROUNDS) @ OPPONENT.T / sizes[:, None, None]
    return found.transpose(0, 2, 1)
