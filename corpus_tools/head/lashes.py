"""Lashes: fine blades along MakeHuman's strips of lashes, moving with the lids."""

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage
from corpus_tools.head.piece import Piece, Span
from corpus_tools.head.subdivide import triangulated

Floats = NDArray[np.float64]

COLOUR = np.array([0.10, 0.065, 0.05])
MATERIAL = {"specular": 0.1, "shininess": 20.0, "opacity": 0.85}
STRIPS = tuple(f"helper-{side}-eyelashes-{number}" for side in "lr" for number in (1, 2))


def lash_piece(cage: Cage) -> Piece:
    """The strips as they are."""
    used, quads = np.unique(np.concatenate([cage.source.groups[name].corners for name in STRIPS]), return_inverse=True)
    points = cage.vertices[used]
    return Piece(
        points,
        (Span("lashes", triangulated(quads.reshape(-1, 4)), MATERIAL),),
        np.tile(COLOUR, (len(points), 1)),
        {name: moved[used] for name, moved in cage.units.items()},
    )
