"""The tongue: MakeHuman's, smoothed, lowered to lie between the lower teeth and tied to the jaw."""

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage
from corpus_tools.head.jaw import Jaw
from corpus_tools.head.piece import Piece, Span
from corpus_tools.head.subdivide import catmull_clark, triangulated

Floats = NDArray[np.float64]

DROP_MM = 2.5  # MakeHuman's tongue stands up to the upper teeth and hides them when the jaw opens
FLATTER = 0.75
COLOUR, ROOT = np.array([0.72, 0.36, 0.36]), np.array([0.40, 0.13, 0.14])
MATERIAL = {"specular": 0.35, "shininess": 30.0, "wrap": 0.3}


def tongue_piece(cage: Cage, jaw: Jaw) -> Piece:
    """The tongue with the shapes ``jaw...`` and ``tongueOut``."""
    used, quads = np.unique(cage.source.groups["helper-tongue"].corners, return_inverse=True)
    matrix, fine = catmull_clark(len(used), quads.reshape(-1, 4))
    points = matrix @ cage.vertices[used]
    out = matrix @ cage.units["tongueOut"][used]
    middle = float(np.median(points[:, 1]))
    points[:, 1] = middle + FLATTER * (points[:, 1] - middle) - DROP_MM
    out[:, 1] += DROP_MM * np.clip(out[:, 2] / max(float(out[:, 2].max()), 1e-9), 0, 1)
    depth = np.clip((points[:, 2].max() - points[:, 2]) / 45.0, 0, 1)[:, None]
    return Piece(
        points,
        (Span("tongue", triangulated(fine), MATERIAL),),
        COLOUR + (ROOT - COLOUR) * depth,
        {**jaw.shapes(points), "tongueOut": out},
    )
