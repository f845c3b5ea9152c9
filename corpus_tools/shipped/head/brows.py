"""Brows: MakeHuman's cards, laid on the skin and moving with it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corpus_tools.shipped.head.assets import read_asset
from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.cards import BROWS, CARDS_TEXTURE, HIDDEN, brow_coordinates
from corpus_tools.shipped.head.correspondence import nearest_surface_points
from corpus_tools.shipped.head.haircut import split_seams
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.subdivision import join_triangles, triangulate
from tts2face.numeric.arrays import FloatArray, IntArray

OFF_MM = 0.45  # above the skin
AHEAD_Z = -5.0
BROW_MATERIAL = {"specular": 0.05, "shininess": 12.0, "cutout": True, "kind": "strands", "texture": CARDS_TEXTURE}


@dataclass(frozen=True, slots=True, eq=False)
class BrowCards:
    """The cards of a set of brows on the reference skin: corners (N, 3), weights (N, 3), triangles and coordinates."""

    corners: IntArray
    weights: FloatArray
    triangles: IntArray
    uv: FloatArray


def bind_brows(folder: Path, cage: Cage, skin: HeadSkin) -> dict[str, BrowCards]:
    """Each set of brows, bound to the skin of the reference head."""
    triangles = triangulate(skin.quads)
    places = skin.vertices[triangles].mean(axis=1)
    triangles = triangles[(np.abs(places[:, 1] - 15) < 30) & (places[:, 2] > AHEAD_Z)]
    bound = {}
    for name in BROWS:
        asset = read_asset(folder, f"brows/{name}", cage.source.vertices)
        cards = split_seams(asset, asset.fit(cage.vertices, cage.source.vertices))
        number, weights, _ = nearest_surface_points(cards.vertices, skin.vertices, triangles)
        bound[name] = BrowCards(triangles[number], weights, cards.triangles, brow_coordinates(name, cards.uv))
    return bound


def brow_piece(skin: HeadSkin, bound: dict[str, BrowCards], shown: str) -> HeadPart:
    """All sets of brows on a skin; those that are not shown lie inside the skull."""
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    points = []
    for name, cards in bound.items():
        on_skin = np.einsum("nk,nkd->nd", cards.weights, (skin.vertices + OFF_MM * normals)[cards.corners])
        points.append(on_skin if name == shown else np.tile(HIDDEN, (len(on_skin), 1)))
    triangles = join_triangles([cards.triangles for cards in bound.values()], map(len, points))
    corners = np.concatenate([cards.corners for cards in bound.values()])
    weights = np.concatenate([cards.weights for cards in bound.values()])
    vertices = np.concatenate(points)
    moved = {name: np.einsum("nk,nkd->nd", weights, shape[corners]) for name, shape in skin.shapes.items()}
    along = np.einsum("nk,nkd->nd", weights, skin.vertices[corners])[:, :1]
    return HeadPart(
        vertices,
        (MaterialSpan("brows", triangles, BROW_MATERIAL),),
        np.tile([0.27, 0.20, 0.15], (len(vertices), 1)),
        {name: shape for name, shape in moved.items() if np.abs(shape).max() > 1e-3},
        np.concatenate([cards.uv for cards in bound.values()]),
        np.sign(along) * np.array([0.95, 0.2, -0.25]),
    )
