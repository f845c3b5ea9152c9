"""The default head: its pieces for any identity, in one order."""

import numpy as np

from corpus_tools.head.cage import Cage
from corpus_tools.head.eyes import balls_of, eyeball
from corpus_tools.head.jaw import jaw_of
from corpus_tools.head.lashes import lash_piece
from corpus_tools.head.layout import laid_out
from corpus_tools.head.piece import Built, Piece, Span
from corpus_tools.head.skin import Skin
from corpus_tools.head.subdivide import triangulated
from corpus_tools.head.teeth import LOWER, UPPER, arch_piece
from corpus_tools.head.tongue import tongue_piece

SKIN_MATERIAL = {"specular": 0.16, "shininess": 14.0, "wrap": 0.35, "textured": True}
ADULT = {"macrodetails/caucasian-female-young": 1.0, "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0}


def built_head(cage: Cage, skin: Skin, seed: int) -> Built:
    """Skin, eyeballs, teeth, tongue and lashes of a cage."""
    jaw = jaw_of(cage)
    balls = balls_of(cage)
    flesh = Piece(
        skin.vertices,
        (Span("skin", triangulated(skin.quads), SKIN_MATERIAL),),
        np.tile(np.array([0.835, 0.640, 0.545]), (len(skin.vertices), 1)),
        skin.shapes,
        laid_out(skin.source_uv),
    )
    eyes = [eyeball(ball, np.random.default_rng(seed)) for ball in balls]
    upper, lower = arch_piece(UPPER, "upper"), arch_piece(LOWER, "lower")
    lower = Piece(lower.vertices, lower.spans, lower.colours, jaw.shapes(lower.vertices))
    pieces = (flesh, *eyes, upper, lower, tongue_piece(cage, jaw), lash_piece(cage))
    return Built(pieces, (1, 2), balls, np.array([0.0, -75.0, -95.0]))
