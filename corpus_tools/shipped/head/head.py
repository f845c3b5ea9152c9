"""The head: the pieces of any identity in a fixed order, so that their vertices correspond."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.brows import BrowCards, bind_brows, brow_piece
from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.cards import CardChoice
from corpus_tools.shipped.head.eyes import EyeStyle, eyeball_piece, fit_eyeballs
from corpus_tools.shipped.head.jaw import Jaw, fit_jaw
from corpus_tools.shipped.head.lashes import LashCards, bind_lashes, lash_piece
from corpus_tools.shipped.head.layout import layout_coordinates
from corpus_tools.shipped.head.lid_edges import LidEdge, find_lid_edges, wet_piece
from corpus_tools.shipped.head.lips import close_lips, lip_front, lip_ring
from corpus_tools.shipped.head.parts import HeadPart, HeadPieces, MaterialSpan
from corpus_tools.shipped.head.proportions import person_targets
from corpus_tools.shipped.head.retreat import add_retreat
from corpus_tools.shipped.head.shapes import clear_eyeballs, correct_shapes
from corpus_tools.shipped.head.shirt import shirt_piece
from corpus_tools.shipped.head.skin import HeadSkin, build_shoulders, build_skin
from corpus_tools.shipped.head.subdivision import triangulate
from corpus_tools.shipped.head.teeth import COVER_MM, LOWER, UPPER, arch_piece, fit_teeth, follow_lips, keep_behind
from corpus_tools.shipped.head.texture import HeadColours
from corpus_tools.shipped.head.tongue import tongue_piece
from tts2face.numeric.arrays import FloatArray

SKIN_MATERIAL = {"specular": 0.16, "shininess": 14.0, "wrap": 0.35, "texture": 0, "kind": "skin"}
SMILE = {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0}
COVERED_POSES = {"upper": (SMILE, 3.2), "lower": (SMILE | {"jawOpen": 0.3}, 1.6)}  # and mm of skin ahead of them there
PIVOT = np.array([0.0, -75.0, -95.0])  # where the skull meets the neck
# Textures, cards, haircuts and landmarks are laid out on the reference person, of whom all people are displacements.
REFERENCE_PERSON = person_targets("reference")


@dataclass(frozen=True, slots=True)
class HeadStyle:
    """Colours, eyes, brows, lashes and material of a head: everything except its shape."""

    palette: HeadColours = field(default_factory=HeadColours)
    eyes: EyeStyle = field(default_factory=EyeStyle)
    shirt: tuple[float, float, float] = (0.20, 0.29, 0.36)
    skin_material: Mapping[str, Any] = field(default_factory=lambda: SKIN_MATERIAL)
    cards: CardChoice = field(default_factory=CardChoice)
    seed: int = 7


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceHead:
    """The reference person, on whose skin texture, cards and shirt are defined."""

    cage: Cage
    skin: HeadSkin
    shoulders: HeadSkin
    lips: NDArray[np.int64]
    lids: tuple[LidEdge, LidEdge]
    brows: dict[str, BrowCards]
    lashes: dict[str, LashCards]


def build_reference(cage: Cage, assets: Path) -> ReferenceHead:
    """The reference head of a cage, with cards from the folder `assets`."""
    skin = build_skin(cage)
    lids = find_lid_edges(skin, fit_eyeballs(cage))
    lashes = bind_lashes(assets, cage, skin, lids)
    return ReferenceHead(
        cage, skin, build_shoulders(cage), lip_ring(skin), lids, bind_brows(assets, cage, skin), lashes
    )


def assemble_head(cage: Cage, reference: ReferenceHead, style: HeadStyle) -> HeadPieces:
    """Skin, eyeballs, teeth, tongue, brows, lashes and shirt of a cage."""
    jaw = fit_jaw(cage)
    balls = fit_eyeballs(cage, style.eyes)
    skin = clear_eyeballs(correct_shapes(close_lips(build_skin(cage), reference.lips)), balls)
    eyes = [eyeball_piece(ball, side, style.eyes) for ball, side in zip(balls, ("Left", "Right"), strict=True)]
    pieces = (
        skin_piece(skin, style.palette.skin, style.skin_material),
        *eyes,
        *_teeth_pieces(cage, skin, reference, jaw),
        tongue_piece(cage, jaw),
        wet_piece(skin, balls, reference.lids),
        brow_piece(skin, reference.brows, style.cards.brows),
        lash_piece(cage, skin, reference.lashes, style.cards.lashes),
        shirt_piece(reference.shoulders, build_shoulders(cage), np.array(style.shirt)),
    )
    return HeadPieces(pieces, (1, 2), balls, PIVOT)


def skin_piece(skin: HeadSkin, colour: tuple[float, float, float], material: Mapping[str, Any]) -> HeadPart:
    """The skin, of one colour where its texture is not drawn."""
    span = MaterialSpan("skin", triangulate(skin.quads), material)
    colours = np.tile(np.array(colour), (len(skin.vertices), 1))
    return HeadPart(skin.vertices, (span,), colours, skin.shapes, layout_coordinates(skin.source_uv))


def _teeth_pieces(cage: Cage, skin: HeadSkin, reference: ReferenceHead, jaw: Jaw) -> tuple[HeadPart, HeadPart]:
    pieces = []
    ahead = lip_front(skin.vertices, reference.lips) - lip_front(reference.skin.vertices, reference.lips)
    for arch, name in ((UPPER, "upper"), (LOWER, "lower")):
        strip = cage.group(f"helper-{name}-teeth")
        piece = arch_piece(arch, name)
        points = fit_teeth(piece.vertices, reference.cage.vertices[strip], cage.vertices[strip])
        points = keep_behind(follow_lips(points, piece.vertices, ahead), skin.vertices, COVER_MM[name])
        pose, cover = COVERED_POSES[name]
        points = cover_in_pose(points, skin, jaw, pose, cover)
        moved = add_retreat(points, jaw.shapes(points), skin, reference.lips) if name == "lower" else {}
        pieces.append(HeadPart(points, piece.spans, piece.colours, moved))
    return pieces[0], pieces[1]


def cover_in_pose(points: FloatArray, skin: HeadSkin, jaw: Jaw, pose: Mapping[str, float], cover: float) -> FloatArray:
    """Teeth and gums (N, 3) that stay `cover` mm behind the skin in a pose; the lower ones move with the jaw."""
    posed = skin.vertices + sum(weight * skin.shapes[name] for name, weight in pose.items())
    opened = pose.get("jawOpen", 0.0) * jaw.shapes(points)["jawOpen"]
    covered: FloatArray = keep_behind(points + opened, posed, cover) - opened
    return covered
