"""The head: the pieces of any identity in a fixed order, so that their vertices correspond."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage, fit_rotation
from corpus_tools.head.cloth import shirt_piece
from corpus_tools.head.eyes import EyeStyle, eyeball_piece, fit_eyeballs
from corpus_tools.head.hair import MATERIAL as HAIR_MATERIAL
from corpus_tools.head.hair import Haircut, hair_share, hair_thickness, lock_piece
from corpus_tools.head.lashes import lash_piece
from corpus_tools.head.layout import layout_coordinates
from corpus_tools.head.lips import close_lips, lip_ring
from corpus_tools.head.piece import HeadPieces, MaterialSpan, Piece
from corpus_tools.head.shapes import clear_eyeballs, correct_shapes
from corpus_tools.head.skin import Skin, build_shoulders, build_skin, vertex_normals
from corpus_tools.head.subdivide import catmull_clark, triangulate
from corpus_tools.head.teeth import LOWER, UPPER, arch_piece, fit_teeth
from corpus_tools.head.texture import HeadColours

Floats = NDArray[np.float64]

SKIN_MATERIAL = {"specular": 0.16, "shininess": 14.0, "wrap": 0.35, "texture": 0}
HAIR_PART_SHARE = 0.66  # of a quad that counts as hair; below it hair is only in the texture
PIVOT = np.array([0.0, -75.0, -95.0])  # where the skull meets the neck
ADULT = {
    "macrodetails/caucasian-female-young": 1.0,
    "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
}
JAW_SHAPES = ("jawOpen", "jawForward", "jawLeft", "jawRight")
TONGUE_DROP_MM = 2.5  # MakeHuman's tongue reaches the upper teeth and hides them when the jaw opens
TONGUE_FLATTENING = 0.75
TONGUE_COLOUR, TONGUE_ROOT_COLOUR = np.array([0.72, 0.36, 0.36]), np.array([0.40, 0.13, 0.14])
TONGUE_MATERIAL = {"specular": 0.35, "shininess": 30.0, "wrap": 0.3}


@dataclass(frozen=True, slots=True, eq=False)
class Jaw:
    """Rotation (3, 3) and translation (3,) in mm of the lower jaw by shape, at weight 1."""

    motions: Mapping[str, tuple[Floats, Floats]]

    def shapes(self, points: Floats) -> dict[str, Floats]:
        """Displacements (N, 3) by shape of points (N, 3) that move with the lower jaw."""
        return {name: points @ turn.T + shift - points for name, (turn, shift) in self.motions.items()}


def fit_jaw(cage: Cage) -> Jaw:
    """Rigid motion of a cage's lower jaw, fitted to MakeHuman's lower teeth."""
    teeth = cage.group("helper-lower-teeth")
    rest = cage.vertices[teeth]
    return Jaw({name: fit_rotation(rest, rest + cage.units[name][teeth]) for name in JAW_SHAPES})


def tongue_piece(cage: Cage, jaw: Jaw) -> Piece:
    """The tongue with the shapes ``jaw...`` and ``tongueOut``."""
    used, quads = np.unique(cage.source.groups["helper-tongue"].corners, return_inverse=True)
    matrix, fine = catmull_clark(len(used), quads.reshape(-1, 4))
    points = matrix @ cage.vertices[used]
    out = matrix @ cage.units["tongueOut"][used]
    middle = float(np.median(points[:, 1]))
    points[:, 1] = middle + TONGUE_FLATTENING * (points[:, 1] - middle) - TONGUE_DROP_MM
    out[:, 1] += TONGUE_DROP_MM * np.clip(out[:, 2] / max(float(out[:, 2].max()), 1e-9), 0, 1)
    depth = np.clip((points[:, 2].max() - points[:, 2]) / 45.0, 0, 1)[:, None]
    return Piece(
        points,
        (MaterialSpan("tongue", triangulate(fine), TONGUE_MATERIAL),),
        TONGUE_COLOUR + (TONGUE_ROOT_COLOUR - TONGUE_COLOUR) * depth,
        {**jaw.shapes(points), "tongueOut": out},
    )


@dataclass(frozen=True, slots=True)
class HeadStyle:
    """Colours, hair, eyes and material of a head: everything except its shape."""

    palette: HeadColours = field(default_factory=HeadColours)
    cut: Haircut = field(default_factory=Haircut)
    eyes: EyeStyle = field(default_factory=EyeStyle)
    shirt: tuple[float, float, float] = (0.20, 0.29, 0.36)
    skin_material: Mapping[str, Any] = field(default_factory=lambda: SKIN_MATERIAL)
    seed: int = 7


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceHead:
    """The default identity, on whose skin texture, hair and shirt are defined."""

    cage: Cage
    skin: Skin
    shoulders: Skin
    lips: NDArray[np.int64]


def build_reference(cage: Cage) -> ReferenceHead:
    """The reference head of a default identity's cage."""
    skin = build_skin(cage)
    return ReferenceHead(cage, skin, build_shoulders(cage), lip_ring(skin))


def assemble_head(cage: Cage, reference: ReferenceHead, style: HeadStyle) -> HeadPieces:
    """Skin with hair, eyeballs, teeth, tongue, lashes, locks and shirt of a cage."""
    jaw = fit_jaw(cage)
    balls = fit_eyeballs(cage, style.eyes)
    skin = clear_eyeballs(correct_shapes(close_lips(build_skin(cage), reference.lips)), balls)
    flesh, hairs = _flesh(skin, reference, style)
    eyes = [
        eyeball_piece(ball, side, style.eyes, _generator(style))
        for ball, side in zip(balls, ("Left", "Right"), strict=True)
    ]
    pieces = (
        flesh,
        *eyes,
        *_teeth_pieces(cage, reference, jaw),
        tongue_piece(cage, jaw),
        lash_piece(cage, skin, _generator(style)),
        hairs,
        shirt_piece(reference.shoulders, build_shoulders(cage), np.array(style.shirt)),
    )
    return HeadPieces(pieces, (1, 2), balls, PIVOT)


def _generator(style: HeadStyle) -> np.random.Generator:
    return np.random.default_rng(style.seed)


def _flesh(skin: Skin, reference: ReferenceHead, style: HeadStyle) -> tuple[Piece, Piece]:
    """The skin with the scalp raised by the hair, and the loose locks."""
    places = reference.skin.vertices
    share = hair_share(places)
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    vertices = skin.vertices + hair_thickness(places, style.cut, _generator(style))[:, None] * normals
    has_hair = share[skin.quads].mean(axis=1) > HAIR_PART_SHARE
    spans = (
        MaterialSpan("skin", triangulate(skin.quads[~has_hair]), style.skin_material),
        MaterialSpan("hair", triangulate(skin.quads[has_hair]), HAIR_MATERIAL),
    )
    colours = np.tile(np.array(style.palette.skin), (len(vertices), 1))
    colours[np.unique(spans[1].triangles)] = style.palette.hair
    hairs = lock_piece((vertices, normals, places), share, style.cut, np.array(style.palette.hair), _generator(style))
    return Piece(vertices, spans, colours, skin.shapes, layout_coordinates(skin.source_uv)), hairs


def _teeth_pieces(cage: Cage, reference: ReferenceHead, jaw: Jaw) -> tuple[Piece, Piece]:
    pieces = []
    for arch, name in ((UPPER, "upper"), (LOWER, "lower")):
        strip = cage.group(f"helper-{name}-teeth")
        piece = arch_piece(arch, name)
        points = fit_teeth(piece.vertices, reference.cage.vertices[strip], cage.vertices[strip])
        moved = jaw.shapes(points) if name == "lower" else {}
        pieces.append(Piece(points, piece.spans, piece.colours, moved))
    return pieces[0], pieces[1]
