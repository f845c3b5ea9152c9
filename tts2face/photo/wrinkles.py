"""Wrinkles of a photographed face: shading that deepens with the motion of raised brows and of smiles.

Lines that the picture shows become deeper, and faint ones appear. Each vertex answers to its own movement (terms 4 to 6
of `tts2face.render.film.response`).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric import smoothstep
from tts2face.photo.colours import grey_at
from tts2face.photo.lip_line import LEAST_BLUR_PX
from tts2face.photo.photo_mesh import PhotoMesh
from tts2face.photo.photo_shapes import PhotoPerson
from tts2face.render.film.response import MOVE_MM

Floats = NDArray[np.float64]

RAISED = ("browInnerUp", "browOuterUpLeft", "browOuterUpRight")
SMILING = ("mouthSmileLeft", "mouthSmileRight")
UNLIKE_SMILES = ("jawOpen", "mouthPucker")  # whose motion of the cheeks is none of a smile
LEAST_MM = 0.6  # of movement, below which skin has no wrinkles
BROW_EDGES = (70, 63, 105, 66, 107, 336, 296, 334, 293, 300)  # upper edges, from the person's right to the left
FOREHEAD_TOP, NOSE_TIP = 10, 1  # landmarks
FOREHEAD = (0.12, 0.3, 0.75, 1.0)  # of the way from brows to its top, over which lines begin and end
LEAST_HIGH = 0.1  # of that half width, of the height of a forehead
N_LINES = 3.0  # from brows to top
FOREHEAD_SIDE = (0.75, 1.05)  # of the half width of the brows, over which lines end
FOLDS = ((129, 203, 206, 216, 212), (358, 423, 426, 436, 432))  # from the wings of the nose past the mouth
FOLD_ENDS = (0.1, 0.3, 0.75, 1.0)  # of the way along it, over which it begins and ends
FOLD_REACH, CHEEK_REACH = 0.024, 0.045  # of the eye distance, of the shade of a fold and of the light beside it
CHEEK_SHARE = 0.5  # of that light
FOLD_BAND = 0.1  # of the eye distance to either side of a fold, beyond which nothing is looked for
NEAR_FOLD = 2.0  # reaches of a fold, in which what the picture shows is one
N_FOLD_POINTS = 81  # points along a fold
TINY = 1e-9  # mm squared
FAINT_LINES, FAINT_FOLDS = 0.018, 0.05  # of the colour: lines that the picture does not show
DEEPER = 1.2  # lines that it shows, by how much of them
MOST_SHOWN = 0.05  # of the colour, of what counts as a line
LINE_BLUR = 0.01  # of the eye distance, as all of these ways
ON_LINE = (-0.06, -0.03, 0.0, 0.03, 0.06)  # places on a line that are compared with those to its sides
BESIDE_LINE = (-0.06, -0.045, 0.045, 0.06)


def wrinkles(pixels: NDArray[np.uint8], mesh: PhotoMesh, motion: Mapping[str, Floats], person: PhotoPerson) -> Floats:
    """(3, V) change of the light of vertices by their movement over `MOVE_MM`, of their colour.

    Parameters
    ----------
    motion
        Displacements (V, 3) by shape, mm.
    """
    raised, smiling = (np.sum([motion[name] for name in names], axis=0) for names in (RAISED, SMILING))
    others = [motion[name] for name in UNLIKE_SMILES]
    lines, folds = _forehead_lines(pixels, mesh, person), _smile_folds(pixels, mesh, person)
    found = _answers(raised, []) * lines[:, None] + _answers(smiling, others) * folds[:, None]
    return np.ascontiguousarray(found.T) * float(MOVE_MM)


def _answers(motion: Floats, others: Sequence[Floats]) -> Floats:
    """(V, 3) factors of a movement that are 1 together for a motion (V, 3), and as near to 0 as may be for others."""
    moves = np.linalg.norm(motion, axis=1) > LEAST_MM
    rows = np.stack([motion, *others], axis=1)[moves]
    gram = rows @ rows.transpose(0, 2, 1) + np.diag([TINY] + [LEAST_MM**2] * len(others))
    shares = np.linalg.solve(gram, np.eye(len(others) + 1)[:, :1])
    answers = np.zeros_like(motion)
    answers[moves] = (shares * rows).sum(axis=1)
    return answers


def _forehead_lines(pixels: NDArray[np.uint8], mesh: PhotoMesh, person: PhotoPerson) -> Floats:
    """(V,) change of light in lines across the forehead, of the colour."""
    brows, top = person.landmarks[list(BROW_EDGES), :2], person.landmarks[FOREHEAD_TOP, :2]
    along = brows[-1] - brows[0]
    half = float(np.linalg.norm(along)) / 2
    along = along / (2 * half)
    up = np.array([along[1], -along[0]])
    middle = (brows[0] + brows[-1]) / 2
    across = (mesh.places - middle) @ along
    edge = np.interp(across, (brows - middle) @ along, (brows - middle) @ up)
    high = float((top - middle) @ up)
    share = ((mesh.places - middle) @ up - edge) / np.maximum(high - edge, LEAST_HIGH * half)
    faint = FAINT_LINES * np.cos(2 * np.pi * N_LINES * share)
    inside = _between(share, FOREHEAD) * (1 - smoothstep(np.abs(across) / half, *FOREHEAD_SIDE))
    rows = np.flatnonzero(inside)
    faint[rows] += DEEPER * _shown_lines(pixels, mesh.places[rows], np.tile(along, (len(rows), 1)), person.scale)
    found: Floats = inside * faint
    return found


def _smile_folds(pixels: NDArray[np.uint8], mesh: PhotoMesh, person: PhotoPerson) -> Floats:
    """(V,) change of light at the folds from nose to mouth, of the colour; less where the picture smiles already."""
    found = np.zeros(len(mesh.places))
    for numbers in FOLDS:
        line = person.landmarks[list(numbers), :2]
        way, at, direction = _nearest(line, mesh.places)
        outwards = np.sign((line[0] - person.landmarks[NOSE_TIP, :2])[0])
        aside = way * outwards / person.scale
        beside = np.where(aside > 0, np.exp(-(((aside - CHEEK_REACH) / CHEEK_REACH) ** 2)), 0.0)
        change = FAINT_FOLDS * (CHEEK_SHARE * beside - np.exp(-((aside / FOLD_REACH) ** 2)))
        within = _between(at, FOLD_ENDS)
        rows = np.flatnonzero((within > 0) & (np.abs(aside) < FOLD_BAND))
        shown = _shown_lines(pixels, mesh.places[rows], direction[rows], person.scale)
        near = np.exp(-((aside[rows] / (NEAR_FOLD * FOLD_REACH)) ** 2))
        change[rows] += DEEPER * near * np.minimum(shown, 0.0)
        found += within * change
    return found * (1 - person.smile)


def _nearest(line: Floats, places: Floats) -> tuple[Floats, Floats, Floats]:
    """Way from a line (M, 2) to places (V, 2), positive to the right in the picture, share of it, and its direction."""
    fine = np.stack(
        [np.interp(np.linspace(0, len(line) - 1, N_FOLD_POINTS), np.arange(len(line)), line[:, k]) for k in (0, 1)], 1
    )
    steps = np.gradient(fine, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    off = places[:, None] - fine
    best = np.linalg.norm(off, axis=2).argmin(axis=1)
    rows = np.arange(len(places))
    direction = steps[best]
    right = np.column_stack([np.abs(direction[:, 1]), -direction[:, 0] * np.sign(direction[:, 1])])
    way: Floats = (off[rows, best] * right).sum(axis=1)
    return way, best / (len(fine) - 1), direction


def _shown_lines(pixels: NDArray[np.uint8], places: Floats, direction: Floats, scale: float) -> Floats:
    """(V,) how much brighter a picture is on lines in a direction (V, 2) than to their sides, of its brightness."""
    if not len(places):
        return np.zeros(0)
    side = np.column_stack([-direction[:, 1], direction[:, 0]])
    on = [places + way * scale * direction for way in ON_LINE]
    off = [one + way * scale * side for way in BESIDE_LINE for one in on]
    grey = grey_at(pixels, np.stack([*on, *off], axis=1), max(LEAST_BLUR_PX, LINE_BLUR * scale))
    own, others = grey[:, : len(on)].mean(axis=1), grey[:, len(on) :].mean(axis=1)
    found: Floats = np.clip((own - others) / np.maximum(others, 1.0), -MOST_SHOWN, MOST_SHOWN)
    return found


def _between(share: Floats, limits: tuple[float, float, float, float]) -> Floats:
    """1 between the second and the third of four limits, falling to 0 at the first and the last."""
    found: Floats = smoothstep(share, *limits[:2]) * (1 - smoothstep(share, *limits[2:]))
    return found
