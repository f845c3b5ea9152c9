"""Lashes: MakeHuman's cards, which follow the edges of the lids and turn with them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from corpus_tools.shipped.head.assets import Asset, read_asset
from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.cards import CARDS_TEXTURE, HIDDEN, LASHES, lash_coordinates
from corpus_tools.shipped.head.haircut import split_seams
from corpus_tools.shipped.head.lid_edges import LidEdge
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin
from corpus_tools.shipped.head.strands import number_islands
from corpus_tools.shipped.head.subdivision import join_triangles
from tts2face.numeric.arrays import FloatArray, IntArray

COLOUR = np.array([0.07, 0.05, 0.04])
MATERIAL = {"specular": 0.05, "shininess": 20.0, "cutout": True, "kind": "strands", "texture": CARDS_TEXTURE}
N_ROOTS = 3  # vertices of the lid's edge that a lash follows
SHUT_DOWN, SHUT_AHEAD = 0.55, 0.83  # offset of upper lashes from their roots when the lids are shut, in their lengths
LOOK_DOWN_SHARE = 0.4  # of that turn when the eye looks down
LENGTH = 0.7  # of MakeHuman's lashes, which reach the crease of the lid and look like wrinkles there


@dataclass(frozen=True, slots=True, eq=False)
class LashCards:
    """A set of lashes: its asset, triangles, coordinates, roots (N, 3) on the skin and their weights."""

    asset: Asset
    order: IntArray
    triangles: IntArray
    uv: FloatArray
    roots: IntArray
    weights: FloatArray
    is_upper: NDArray[np.bool_]


def bind_lashes(folder: Path, cage: Cage, skin: HeadSkin, edges: tuple[LidEdge, LidEdge]) -> dict[str, LashCards]:
    """Each set of lashes, bound to the lids of the reference head."""
    lines = [(edge.upper, edge.lower) for edge in edges]
    bound = {}
    for name in LASHES:
        asset = read_asset(folder, f"lashes/{name}", cage.source.vertices)
        cards = split_seams(asset, asset.fit(cage.vertices, cage.source.vertices))
        roots, weights = np.zeros((len(cards.vertices), N_ROOTS), np.int64), np.zeros((len(cards.vertices), N_ROOTS))
        is_upper = np.zeros(len(cards.vertices), bool)
        islands = number_islands(len(cards.vertices), cards.triangles)
        for island in np.unique(islands):
            rows = np.flatnonzero(islands == island)
            middle = cards.vertices[rows].mean(axis=0)
            side = lines[0] if middle[0] > 0 else lines[1]
            upper = middle[1] > 0
            line = side[0] if upper else side[1]
            distance, nearest = cKDTree(skin.vertices[line]).query(cards.vertices[rows], N_ROOTS)
            share = 1 / np.maximum(distance, 0.05) ** 2
            roots[rows], weights[rows], is_upper[rows] = line[nearest], share / share.sum(1, keepdims=True), upper
        uv = lash_coordinates(name, cards.uv)
        bound[name] = LashCards(asset, cards.weld, cards.triangles, uv, roots, weights, is_upper)
    return bound


def lash_piece(cage: Cage, skin: HeadSkin, bound: Mapping[str, LashCards], shown: str) -> HeadPart:
    """All sets of lashes of a head; those that are not shown lie inside the skull."""
    points, tangents = [], []
    shapes: dict[str, list[FloatArray]] = {name: [] for name in skin.shapes}
    for name, own in bound.items():
        places = own.asset.fit(cage.vertices, cage.source.vertices)[own.order]
        root = np.einsum("nk,nkd->nd", own.weights, skin.vertices[own.roots])
        off = LENGTH * (places - root)
        for shape, moved in skin.shapes.items():
            follow = np.einsum("nk,nkd->nd", own.weights, moved[own.roots])
            shapes[shape].append(follow + _turn(off, shape, own.is_upper & _is_beside(shape, root)))
        points.append(root + off if name == shown else np.tile(HIDDEN, (len(root), 1)))
        tangents.append(off / np.maximum(np.linalg.norm(off, axis=1, keepdims=True), 1e-6))
    triangles = join_triangles([own.triangles for own in bound.values()], map(len, points))
    vertices = np.concatenate(points)
    joined = {name: np.concatenate(blocks) for name, blocks in shapes.items()}
    return HeadPart(
        vertices,
        (MaterialSpan("lashes", triangles, MATERIAL),),
        np.tile(COLOUR, (len(vertices), 1)),
        {name: moved for name, moved in joined.items() if np.abs(moved).max() > 1e-3},
        np.concatenate([own.uv for own in bound.values()]),
        np.concatenate(tangents),
    )


def _is_beside(shape: str, root: FloatArray) -> NDArray[np.bool_]:
    """(N,) whether lashes belong to the eye that a shape moves."""
    beside: NDArray[np.bool_] = root[:, 0] > 0 if shape.endswith("Left") else root[:, 0] < 0
    return beside


def _turn(off: FloatArray, shape: str, turns: NDArray[np.bool_]) -> FloatArray:
    """(N, 3) displacement of lashes relative to their roots: those of a shut or lowered lid turn forwards and down."""
    share = {"eyeBlink": 1.0, "eyeLookDown": LOOK_DOWN_SHARE}.get(shape.removesuffix("Left").removesuffix("Right"), 0.0)
    length = np.linalg.norm(off[:, 1:], axis=1)
    turned = np.column_stack([off[:, 0], -SHUT_DOWN * length, SHUT_AHEAD * length])
    moved: FloatArray = np.where(turns[:, None], share * (turned - off), 0.0)
    return moved
