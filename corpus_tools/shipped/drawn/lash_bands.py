"""Upper lashes of a drawn character: one tapered band along each lid, which ends in a wing and turns with the lid."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.grids import grid_triangles
from corpus_tools.shipped.drawn.character import Colour, Profile
from corpus_tools.shipped.drawn.fields import Front, arc_length, profile
from corpus_tools.shipped.head.lid_edges import LidEdge
from corpus_tools.shipped.head.parts import Eyeball, HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.numeric.arrays import FloatArray, smoothstep, unit_vectors

N_ALONG, N_ROWS = 72, 4
EDGE_SPREAD = 0.030  # of the lid's length, over which a lash follows its edge; the vertices of the edge zigzag
WING, WING_EXPONENT = (0.84, 1.0), 1.3  # shares of the lid over which the band runs into a point
GAPS_MM = (0.3, 0.55, 0.45)  # of the outer rows in front of the lid at rest; a shut lid has `SHUT_GAP_MM`
SHUT_GAP_MM = 0.35
TURNS = {"eyeBlink": 1.0, "eyeLookDown": 0.4}  # share of the turn of a shut lid
SHUT_ACROSS, SHUT_DOWN, SHUT_AHEAD, SHUT_AHEAD_MM = 0.9, 0.62, 0.70, 0.6  # offset from the roots on a shut lid
ROW_TURNS = np.array([0.0, 0.10, 0.8, 1.0])
MATERIAL = {"specular": 0.03, "shininess": 8.0, "wrap": 0.3}


def lash_piece(
    skin: HeadSkin, lids: Sequence[LidEdge], balls: Sequence[Eyeball], length: Profile, colour: Colour
) -> HeadPart:
    """The lashes of both eyes; `length` in mm by share of the lid from the inner corner."""
    rows = np.flatnonzero((skin.vertices[:, 2] > -25) & (np.abs(skin.vertices[:, 1]) < 34))
    points, faces = [], []
    shapes: dict[str, list[FloatArray]] = {name: [] for name in skin.shapes}
    for number, (edge, ball, side) in enumerate(zip(lids, balls, ("Left", "Right"), strict=True)):
        line = edge.upper if side == "Left" else edge.upper[::-1]
        band = _Band(skin, line, ball, 1.0 if side == "Left" else -1.0, length)
        band.come_forward(Front(skin.vertices[rows]))
        points.append(band.points())
        grid = grid_triangles(N_ALONG, N_ROWS)
        faces.append((grid[:, ::-1] if side == "Left" else grid) + number * N_ALONG * N_ROWS)
        for name, moved in skin.shapes.items():
            follow = np.repeat(band.share @ moved[line], N_ROWS, axis=0)
            turn = TURNS.get(name.removesuffix(side), 0.0) if name.endswith(side) else 0.0
            if turn:
                follow = band.turned(follow, turn, Front(skin.vertices[rows] + moved[rows]))
            shapes[name].append(follow)
    vertices = np.concatenate(points)
    joined = {name: np.concatenate(blocks) for name, blocks in shapes.items()}
    return HeadPart(
        vertices,
        (MaterialSpan("lashes", np.concatenate(faces), MATERIAL),),
        np.tile(colour, (len(vertices), 1)),
        {name: moved for name, moved in joined.items() if np.abs(moved).max() > 1e-3},
    )


class _Band:
    """The band of one eye: rows of points along the lid's edge `line`, from the root outwards."""

    def __init__(self, skin: HeadSkin, line: NDArray[np.int64], ball: Eyeball, sign: float, length: Profile) -> None:
        edge = skin.vertices[line]
        along = arc_length(edge)
        along /= along[-1]
        at = np.linspace(0.0, 1.0, N_ALONG)
        share = np.exp(-(((at[:, None] - along) / EDGE_SPREAD) ** 2)) * np.gradient(along)
        self.share: FloatArray = share / share.sum(axis=1, keepdims=True)
        self.root: FloatArray = self.share @ edge
        outward = unit_vectors(self.root - ball.centre)
        long = profile(length, at)[:, None]
        thick, lean = np.minimum(long, 1.7), smoothstep(at, 0.30, 1.0)
        up = unit_vectors(np.column_stack([sign * (1.15 * lean - 0.10), 1.0 - 0.28 * lean, 0.45 - 0.1 * lean]))
        self._rows = [
            self.root - 0.2 * outward + [0, 0.1, -0.2],
            self.root + thick * outward - thick * [0, 0.95, 0],  # thick below: half shut, the band is seen edge-on
            self.root + 1.5 * thick * outward + 0.5 * long * up,
            self.root + thick * outward + long * unit_vectors(up + np.array([0, 0.22, -0.08])),
        ]
        self._pointed: FloatArray = smoothstep(at, *WING)[:, None] ** WING_EXPONENT

    def come_forward(self, lid: Front) -> None:
        """Move the rows in front of the lid, then run them into a point."""
        for row, gap in zip(self._rows[1:], GAPS_MM, strict=True):
            row[:, 2] += lid.lacking(row, gap)
        self._rows = [row + self._pointed * (self._rows[-1] - row) for row in self._rows]

    def points(self) -> FloatArray:
        """(`N_ALONG` x `N_ROWS`, 3) points of the band."""
        return np.stack(self._rows, axis=1).reshape(-1, 3)

    def turned(self, follow: FloatArray, turn: float, lid: Front) -> FloatArray:
        """Displacements of the band that turns down with the lid, in front of it, from those of its roots."""
        points = self.points()
        off = points - np.repeat(self.root, N_ROWS, axis=0)
        size = np.linalg.norm(off[:, 1:], axis=1)
        down = np.column_stack([SHUT_ACROSS * off[:, 0], -SHUT_DOWN * size, SHUT_AHEAD * size + SHUT_AHEAD_MM])
        share = (ROW_TURNS * (1 - self._pointed) + self._pointed).reshape(-1, 1)
        shut = (points + follow + turn * share * (down - off)).reshape(N_ALONG, N_ROWS, 3)
        for row in range(1, N_ROWS):
            shut[:, row, 2] += lid.lacking(shut[:, row], SHUT_GAP_MM)
        moved: FloatArray = shut.reshape(-1, 3) - points
        return moved
