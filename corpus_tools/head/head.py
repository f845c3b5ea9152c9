"""The head: its pieces for any identity, in one order, so that vertex for vertex they are the same."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage
from corpus_tools.head.cloth import shirt
from corpus_tools.head.eyes import EyeStyle, balls_of, eyeball
from corpus_tools.head.hair import MATERIAL as HAIR_MATERIAL
from corpus_tools.head.hair import Cut, hair_share, locks, thickness
from corpus_tools.head.jaw import Jaw, jaw_of
from corpus_tools.head.lashes import lash_piece
from corpus_tools.head.layout import laid_out
from corpus_tools.head.lids import cleared
from corpus_tools.head.lips import closed, lip_ring
from corpus_tools.head.piece import Built, Piece, Span
from corpus_tools.head.shapes import softened
from corpus_tools.head.skin import Skin, shoulders, skinned, vertex_normals
from corpus_tools.head.subdivide import triangulated
from corpus_tools.head.teeth import LOWER, UPPER, arch_piece, fitted
from corpus_tools.head.texture import Palette
from corpus_tools.head.tongue import tongue_piece

Floats = NDArray[np.float64]

SKIN_MATERIAL = {"specular": 0.16, "shininess": 14.0, "wrap": 0.35, "textured": True}
HAIR_PART_SHARE = 0.66  # of a quad that counts as hair; below it the hairline is painted on skin
PIVOT = np.array([0.0, -75.0, -95.0])  # where the skull sits on the neck
ADULT = {
    "macrodetails/caucasian-female-young": 1.0,
    "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
}


@dataclass(frozen=True, slots=True)
class Look:
    """Everything about a head that is not its shape."""

    palette: Palette = field(default_factory=Palette)
    cut: Cut = field(default_factory=Cut)
    eyes: EyeStyle = field(default_factory=EyeStyle)
    shirt: tuple[float, float, float] = (0.20, 0.29, 0.36)
    skin_material: Mapping[str, Any] = field(default_factory=lambda: SKIN_MATERIAL)
    seed: int = 7


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """The default identity, on whose skin is measured where paint, hair and shirt go."""

    cage: Cage
    skin: Skin
    shoulders: Skin
    lips: NDArray[np.int64]


def grounded(cage: Cage) -> Ground:
    """The ground that a default identity's cage gives."""
    skin = skinned(cage)
    return Ground(cage, skin, shoulders(cage), lip_ring(skin))


def built_head(cage: Cage, ground: Ground, look: Look) -> Built:
    """Skin with hair, eyeballs, teeth, tongue, lashes, locks and shirt of a cage."""
    jaw = jaw_of(cage)
    balls = balls_of(cage, look.eyes)
    skin = cleared(softened(closed(skinned(cage), ground.lips)), balls)
    flesh, hairs = _flesh(skin, ground, look)
    eyes = [
        eyeball(ball, side, look.eyes, _generator(look)) for ball, side in zip(balls, ("Left", "Right"), strict=True)
    ]
    pieces = (
        flesh,
        *eyes,
        *_teeth(cage, ground, jaw),
        tongue_piece(cage, jaw),
        lash_piece(cage, skin, _generator(look)),
        hairs,
        shirt(ground.shoulders, shoulders(cage), np.array(look.shirt)),
    )
    return Built(pieces, (1, 2), balls, PIVOT)


def _generator(look: Look) -> np.random.Generator:
    return np.random.default_rng(look.seed)


def _flesh(skin: Skin, ground: Ground, look: Look) -> tuple[Piece, Piece]:
    """The skin, its scalp raised by the hair, and the loose locks."""
    places = ground.skin.vertices
    share = hair_share(places)
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    vertices = skin.vertices + thickness(places, look.cut, _generator(look))[:, None] * normals
    has_hair = share[skin.quads].mean(axis=1) > HAIR_PART_SHARE
    spans = (
        Span("skin", triangulated(skin.quads[~has_hair]), look.skin_material),
        Span("hair", triangulated(skin.quads[has_hair]), HAIR_MATERIAL),
    )
    colours = np.tile(np.array(look.palette.skin), (len(vertices), 1))
    colours[np.unique(spans[1].triangles)] = look.palette.hair
    hairs = locks((vertices, normals, places), share, look.cut, np.array(look.palette.hair), _generator(look))
    return Piece(vertices, spans, colours, skin.shapes, laid_out(skin.source_uv)), hairs


def _teeth(cage: Cage, ground: Ground, jaw: Jaw) -> tuple[Piece, Piece]:
    pieces = []
    for arch, name in ((UPPER, "upper"), (LOWER, "lower")):
        strip = cage.group(f"helper-{name}-teeth")
        piece = arch_piece(arch, name)
        points = fitted(piece.vertices, ground.cage.vertices[strip], cage.vertices[strip])
        moved = jaw.shapes(points) if name == "lower" else {}
        pieces.append(Piece(points, piece.spans, piece.colours, moved))
    return pieces[0], pieces[1]
