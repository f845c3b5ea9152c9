"""The head: the pieces of any identity in a fixed order, so that their vertices correspond.

A round-necked shirt: the shoulders, cut along a tilted plane and offset from the skin.

Proportions of people: weights of MakeHuman's modelling targets, by which a person differs from the macro targets.

They were solved for nineteen proportions that the face tracker reads from rendered stills, as it reads them from filmed
people, and then chosen by eye (docs/decisions/014-built-faces.md).
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.cards import CardChoice
from corpus_tools.shipped.head.eyes import EyeStyle, eyeball_piece, fit_eyeballs
from corpus_tools.shipped.head.lashes import BrowCards, LashCards, bind_brows, bind_lashes, brow_piece, lash_piece
from corpus_tools.shipped.head.lips import add_retreat, close_lips, lip_front, lip_ring
from corpus_tools.shipped.head.mesh import Cage, HeadPart, HeadPieces, MaterialSpan, layout_coordinates, triangulate
from corpus_tools.shipped.head.mouth import (
    COVER_MM,
    LOWER,
    UPPER,
    arch_piece,
    fit_teeth,
    follow_lips,
    keep_behind,
    tongue_piece,
)
from corpus_tools.shipped.head.shapes import (
    Jaw,
    LidEdge,
    clear_eyeballs,
    correct_shapes,
    find_lid_edges,
    fit_jaw,
    wet_piece,
)
from corpus_tools.shipped.head.skin import HeadSkin, build_shoulders, build_skin, vertex_normals
from corpus_tools.shipped.head.texture import HeadColours

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COLLAR_Y, COLLAR_SLOPE = -164.0, -0.30  # height in front of the neck, mm, and rise per mm towards the back
BAND_MM = 13.0  # height of the collar's band
BAND_OFF, BODY_OFF = 3.0, 1.8  # mm off the skin
BOTTOM_Y, WIDEST = -330.0, 300.0  # where the bust ends, mm
MATERIAL = {"specular": 0.04, "shininess": 8.0, "wrap": 0.2}


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Points (N, D) of any attributes, and triangles (F, 3)."""

    points: Floats
    triangles: Ints


def height_above_collar(places: Floats) -> Floats:
    """(P,) signed height above the collar's edge in mm, for positions on the default skin."""
    return places[:, 1] - COLLAR_Y - COLLAR_SLOPE * np.minimum(places[:, 2], 20.0)


def shirt_piece(default: HeadSkin, own: HeadSkin, colour: Floats) -> HeadPart:
    """The shirt over the shoulders `own` of an identity, cut where the shoulders of the `default` identity are."""
    normals = vertex_normals(own.vertices, own.quads, own.base)
    whole = Sheet(np.column_stack([default.vertices, own.vertices, normals]), triangulate(own.quads))
    whole = clip_sheet(clip_sheet(whole, whole.points[:, 1] - BOTTOM_Y), None)
    whole = clip_sheet(whole, WIDEST - np.abs(whole.points[:, 0]))
    below = clip_sheet(whole, -height_above_collar(whole.points))
    band = clip_sheet(below, height_above_collar(below.points) + BAND_MM)
    body = clip_sheet(below, -height_above_collar(below.points) - BAND_MM + 0.6)
    points, faces, colours, count = [], [], [], 0
    for sheet, off, shade in ((body, BODY_OFF, 1.0), (band, BAND_OFF, 0.88)):
        rolled = _roll_collar(sheet, off)
        points.append(rolled.points)
        faces.append(rolled.triangles + count)
        colours.append(np.tile(colour * shade, (len(rolled.points), 1)))
        count += len(rolled.points)
    return HeadPart(
        np.concatenate(points), (MaterialSpan("shirt", np.concatenate(faces), MATERIAL),), np.concatenate(colours)
    )


def clip_sheet(sheet: Sheet, inside: Floats | None) -> Sheet:
    """The part of a sheet where `inside` (N,) is not negative, without unused points."""
    points, triangles = sheet.points, sheet.triangles
    if inside is not None:
        points, triangles = _cut_triangles(points, triangles, inside)
    used, packed = np.unique(triangles, return_inverse=True)
    return Sheet(points[used], packed.reshape(-1, 3).astype(np.int64))


def _cut_triangles(points: Floats, triangles: Ints, inside: Floats) -> tuple[Floats, Ints]:
    is_in = inside >= 0
    n_in = is_in[triangles].sum(axis=1)
    new_points: list[Floats] = []
    known: dict[tuple[int, int], int] = {}

    def crossing(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in known:
            share = inside[key[0]] / (inside[key[0]] - inside[key[1]])
            known[key] = len(points) + len(new_points)
            new_points.append(points[key[0]] + share * (points[key[1]] - points[key[0]]))
        return known[key]

    faces: list[tuple[int, int, int]] = []
    for a, b, c in triangles[(n_in > 0) & (n_in < 3)].tolist():
        turns = ((a, b, c), (b, c, a), (c, a, b))
        odd, one, two = next(turn for turn in turns if is_in[turn[0]] != is_in[turn[1]] == is_in[turn[2]])
        to_one, to_two = crossing(odd, one), crossing(odd, two)
        faces += [(odd, to_one, to_two)] if is_in[odd] else [(to_one, one, two), (to_one, two, to_two)]
    cut = np.array(faces, np.int64).reshape(-1, 3)
    return np.concatenate([points, np.array(new_points).reshape(-1, points.shape[1])]), np.concatenate(
        [triangles[n_in == 3], cut]
    )


def _roll_collar(sheet: Sheet, off: float) -> Sheet:
    """The sheet offset from the skin by `off` mm, its upper edge joined to the skin."""
    raised = sheet.points[:, 3:6] + off * sheet.points[:, 6:9]
    sides = np.stack([sheet.triangles, np.roll(sheet.triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, first, uses = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    free = sides[first[uses == 1]]
    height = height_above_collar(sheet.points)
    top = free[(height[free] > height.max() - 1.0).all(axis=1)]
    n = len(raised)
    low = sheet.points[:, 3:6] - 0.5 * sheet.points[:, 6:9] + [0.0, 0.8, 0.0]
    strip = np.concatenate([top[:, ::-1], top + n], axis=1)  # b, a, a', b'
    rim = np.concatenate([strip[:, [0, 1, 2]], strip[:, [0, 2, 3]]])
    return clip_sheet(Sheet(np.concatenate([raised, low]), np.concatenate([sheet.triangles, rim])), None)


SKIN_MATERIAL = {"specular": 0.16, "shininess": 14.0, "wrap": 0.35, "texture": 0, "kind": "skin"}

SMILE = {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0}
COVERED_POSES = {"upper": (SMILE, 3.2), "lower": (SMILE | {"jawOpen": 0.3}, 1.6)}  # and mm of skin ahead of them there
PIVOT = np.array([0.0, -75.0, -95.0])  # where the skull meets the neck
ADULT = {
    "macrodetails/caucasian-female-young": 1.0,
    "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
}
# Textures, cards, haircuts and landmarks are laid out on the reference person, of whom all people are displacements.
REFERENCE_PERSON = ADULT | {
    "head/head-oval": 0.35, "chin/chin-width-decr": 0.35, "chin/chin-height-decr": 0.15,
    "chin/chin-prominent-decr": 0.1, "cheek/l-cheek-bones-incr": 0.25, "cheek/r-cheek-bones-incr": 0.25,
    "cheek/l-cheek-volume-decr": 0.1, "cheek/r-cheek-volume-decr": 0.1, "eyes/l-eye-scale-incr": 0.15,
    "eyes/r-eye-scale-incr": 0.15, "eyes/l-eye-corner2-up": 0.2, "eyes/r-eye-corner2-up": 0.2,
    "mouth/mouth-angles-up": 0.3, "mouth/mouth-cupidsbow-incr": 0.25, "mouth/mouth-lowerlip-volume-incr": 0.15,
    "mouth/mouth-upperlip-volume-incr": 0.25, "mouth/mouth-scale-horiz-incr": 0.15, "neck/neck-scale-horiz-decr": 0.3,
    "eyebrows/eyebrows-trans-up": 0.25, "eyebrows/eyebrows-angle-up": 0.15,
    "nose/nose-scale-horiz-decr": 0.35, "nose/nose-point-width-decr": 0.3, "nose/nose-width3-decr": 0.3,
}  # fmt: skip


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


def cover_in_pose(points: Floats, skin: HeadSkin, jaw: Jaw, pose: Mapping[str, float], cover: float) -> Floats:
    """Teeth and gums (N, 3) that stay `cover` mm behind the skin in a pose; the lower ones move with the jaw."""
    posed = skin.vertices + sum(weight * skin.shapes[name] for name, weight in pose.items())
    opened = pose.get("jawOpen", 0.0) * jaw.shapes(points)["jawOpen"]
    covered: Floats = keep_behind(points + opened, posed, cover) - opened
    return covered


TABLE = Path(__file__).with_name("proportions.csv")
BOTH_SIDES = "*"  # in the name of a target that the left and the right half of the face have


def modelling_targets(person: str) -> dict[str, float]:
    """Weight of each modelling target of a person; rows of the table with a negative weight name the opposite one."""
    found: dict[str, float] = {}
    with TABLE.open(newline="") as file:
        for row in csv.DictReader(file):
            weight = float(row[person] or 0)
            name = row["target"] + (row["more"] if weight > 0 else row["less"])
            sides = ("l", "r") if BOTH_SIDES in name else ("",)
            found |= {name.replace(BOTH_SIDES, side): abs(weight) for side in sides if weight}
    return found


def add_targets(one: Mapping[str, float], other: Mapping[str, float]) -> dict[str, float]:
    """Sums of the weights of two sets of targets."""
    return {name: one.get(name, 0.0) + other.get(name, 0.0) for name in {**one, **other}}
