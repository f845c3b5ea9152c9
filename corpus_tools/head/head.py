"""The default head: its pieces for any identity, in one order."""

import numpy as np

from corpus_tools.head.cage import Cage
from corpus_tools.head.cloth import is_bare, shirt
from corpus_tools.head.eyes import balls_of, eyeball
from corpus_tools.head.hair import MATERIAL as HAIR_MATERIAL
from corpus_tools.head.hair import Cut, hair_share, locks, thickness
from corpus_tools.head.jaw import jaw_of
from corpus_tools.head.lashes import lash_piece
from corpus_tools.head.layout import laid_out
from corpus_tools.head.lids import cleared
from corpus_tools.head.lips import closed
from corpus_tools.head.piece import Built, Piece, Span
from corpus_tools.head.skin import Skin, vertex_normals
from corpus_tools.head.subdivide import triangulated
from corpus_tools.head.teeth import LOWER, UPPER, arch_piece
from corpus_tools.head.texture import Palette
from corpus_tools.head.tongue import tongue_piece

SKIN_MATERIAL = {"specular": 0.16, "shininess": 14.0, "wrap": 0.35, "textured": True}
SHIRT = np.array([0.20, 0.29, 0.36])
ADULT = {"macrodetails/caucasian-female-young": 1.0, "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0}


def built_head(cage: Cage, skin: Skin, painted_on: Skin, palette: Palette, cut: Cut, seed: int) -> Built:
    """Skin, eyeballs, teeth, tongue and lashes of a cage."""
    jaw = jaw_of(cage)
    balls = balls_of(cage)
    skin = cleared(closed(skin), balls)
    default_places = painted_on.vertices
    share = hair_share(default_places)
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    raised = thickness(default_places, cut, np.random.default_rng(seed))
    vertices = skin.vertices + raised[:, None] * normals
    has_hair = share[skin.quads].mean(axis=1) > 0.45
    bare = is_bare(default_places, skin.quads)
    top = shirt(default_places, skin.vertices, normals, triangulated(skin.quads), SHIRT)
    flesh = Piece(
        vertices,
        (
            Span("skin", triangulated(skin.quads[bare & ~has_hair]), SKIN_MATERIAL),
            Span("hair", triangulated(skin.quads[has_hair]), HAIR_MATERIAL),
        ),
        np.tile(np.array([0.835, 0.640, 0.545]), (len(skin.vertices), 1)),
        skin.shapes,
        laid_out(skin.source_uv),
    )
    eyes = [eyeball(ball, side, np.random.default_rng(seed)) for ball, side in zip(balls, ("Left", "Right"), strict=True)]
    upper, lower = arch_piece(UPPER, "upper"), arch_piece(LOWER, "lower")
    lower = Piece(lower.vertices, lower.spans, lower.colours, jaw.shapes(lower.vertices))
    hairs = locks(vertices, normals, share, cut, np.array(palette.hair), np.random.default_rng(seed))
    pieces = (flesh, *eyes, upper, lower, tongue_piece(cage, jaw), lash_piece(cage, skin, np.random.default_rng(seed)), hairs, top)
    return Built(pieces, (1, 2), balls, np.array([0.0, -75.0, -95.0]))
