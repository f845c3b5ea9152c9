"""Edges of the lids: the rings where they meet, the dark line of the upper lid, and the wet line of the lower one."""

from dataclasses import dataclass

import numpy as np

from corpus_tools.dense.grids import grid_triangles
from corpus_tools.shipped.head.edge_rings import EdgeRings, find_narrowest_ring
from corpus_tools.shipped.head.eyes import RECEDE_MM, ball_radius
from corpus_tools.shipped.head.parts import Eyeball, HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin
from corpus_tools.shipped.head.subdivision import join_triangles
from tts2face.numeric.arrays import IntArray

REACH_MM = 30.0
WET_MM, WET_OFF_MM = 0.75, 0.06  # height of the wet line, and its distance from the eyeball
WET_COLOUR = np.array([0.76, 0.60, 0.56])
WET_MATERIAL = {"specular": 0.35, "shininess": 90.0, "kind": "eye"}


@dataclass(frozen=True, slots=True, eq=False)
class LidEdge:
    """Vertices of the skin along the edges of the lids of one eye, from the smaller x to the larger."""

    upper: IntArray
    lower: IntArray


def find_lid_edges(skin: HeadSkin, balls: tuple[Eyeball, Eyeball]) -> tuple[LidEdge, LidEdge]:
    """Edges of the lids of the left and the right eye."""
    strips = EdgeRings(skin.quads, skin.base)
    found = []
    for ball in balls:
        ring = find_narrowest_ring(strips, skin.vertices, ball.centre, REACH_MM, ball.radius)
        ring = np.roll(ring, -int(skin.vertices[ring, 0].argmin()))
        turn = int(skin.vertices[ring, 0].argmax())
        arcs = [ring[: turn + 1], np.append(ring[turn:], ring[0])[::-1]]
        upper, lower = sorted(arcs, key=lambda arc: -float(skin.vertices[arc, 1].mean()))
        found.append(LidEdge(upper, lower))
    return found[0], found[1]


def wet_piece(skin: HeadSkin, balls: tuple[Eyeball, Eyeball], edges: tuple[LidEdge, LidEdge]) -> HeadPart:
    """Thin strips of tear fluid between the lower lids and the eyeballs."""
    points = []
    lines = [edge.lower[1:-1] for edge in edges]
    for ball, line in zip(balls, lines, strict=True):
        rim = skin.vertices[line]
        off = rim + np.array([0.0, WET_MM, 0.0]) - ball.centre
        distance = np.linalg.norm(off, axis=1)
        angle = np.arccos(np.clip(off[:, 2] / distance, -1, 1))
        on_ball = ball.centre + off * ((ball_radius(ball, angle) + WET_OFF_MM) / distance)[:, None]
        points += [rim, on_ball]
    rows = np.concatenate([np.tile(line, 2) for line in lines])
    triangles = join_triangles([grid_triangles(2, len(line)) for line in lines], (2 * len(line) for line in lines))
    vertices = np.concatenate(points)
    moved = {name: shape[rows] for name, shape in skin.shapes.items() if shape[rows].any()}
    for side, sign in (("Left", 1.0), ("Right", -1.0)):  # behind the shut lids, as the eyeball
        moved[f"eyeBlink{side}"] = moved[f"eyeBlink{side}"] - np.outer(sign * vertices[:, 0] > 0, [0, 0, RECEDE_MM])
    return HeadPart(
        vertices,
        (MaterialSpan("wet", triangles, WET_MATERIAL),),
        np.tile(WET_COLOUR, (len(vertices), 1)),
        moved,
    )
