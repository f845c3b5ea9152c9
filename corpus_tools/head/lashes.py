"""Lashes: fine curved blades along MakeHuman's strips of lashes, moving with the lids."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import shortest_path
from scipy.spatial import cKDTree

from corpus_tools.head.cage import Cage
from corpus_tools.head.piece import MaterialSpan, Piece
from corpus_tools.head.skin import Skin
from tts2face.interpolation import interpolate_columns

Floats = NDArray[np.float64]

COLOUR = np.array([0.11, 0.075, 0.06])
MATERIAL = {"specular": 0.05, "shininess": 20.0}


@dataclass(frozen=True, slots=True)
class LashRow:
    """Lashes of one lid: the strip's number in the source, blades, length in rows of the strip, width in mm."""

    strip: int
    n_blades: int
    length: float
    width: float


UPPER, LOWER = LashRow(2, 60, 3.7, 0.24), LashRow(1, 34, 2.1, 0.15)
N_OF_BLADE = 5  # vertices; the first two are its root
ROOT_ROW = 0.85  # the strip's first row lies within the lid
SHUT_DOWN, SHUT_AHEAD = (
    0.5,
    0.87,
)  # offset of upper lashes over closed lids, in their lengths
BELOW_MM, BEHIND_MM = 0.3, 0.3  # minimum distance of the lower lashes' roots below and behind the upper ones then


def lash_piece(cage: Cage, skin: Skin, generator: np.random.Generator) -> Piece:
    """The lashes of both eyes, which also follow the corrections of the skin's shapes."""
    nearest = cKDTree(skin.vertices)
    points, triangles, count = [], [], 0
    shapes: dict[str, list[Floats]] = {name: [] for name in cage.units}
    for side, word in (("l", "Left"), ("r", "Right")):
        line = np.zeros((0, 3))  # roots of the upper lashes over closed lids
        for row in (UPPER, LOWER):
            strip = cage.source.groups[f"helper-{side}-eyelashes-{row.strip}"].corners
            used = np.unique(strip)
            weights, offset, faces = _blades(cage.vertices[used], np.searchsorted(used, strip), row, generator)
            blades = weights @ cage.vertices[used] + offset
            beside = np.repeat(nearest.query(_roots(blades))[1], N_OF_BLADE)
            for name, moved in cage.units.items():
                own = weights @ moved[used] + (skin.corrections[name][beside] if name in skin.corrections else 0.0)
                if name == f"eyeBlink{word}":
                    own = _lower_lashes(blades, own) if row is UPPER else _keep_under(blades, own, line)
                    line = _roots(blades + own)
                shapes[name].append(own)
            points.append(blades)
            triangles.append(faces + count)
            count += len(offset)
    vertices = np.concatenate(points)
    return Piece(
        vertices,
        (MaterialSpan("lashes", np.concatenate(triangles), MATERIAL),),
        np.tile(COLOUR, (len(vertices), 1)),
        {name: np.concatenate(blocks) for name, blocks in shapes.items()},
    )


def strip_grid(quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Vertex indices (across, along) of a strip of quads (F, 4) that forms a grid, the short side first."""
    n = int(quads.max()) + 1
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    steps = shortest_path(
        sparse.coo_array((np.ones(len(sides)), sides.T), shape=(n, n)), directed=False, unweighted=True
    )
    corners = np.flatnonzero(np.bincount(quads.ravel(), minlength=n) == 1)
    first = corners[0]
    second = min(corners[1:], key=lambda corner: steps[first, corner])
    n_across = int(steps[first, second]) + 1
    one, two = steps[first].astype(int), steps[second].astype(int)
    across, along = (one - two + n_across - 1) // 2, (one + two - n_across + 1) // 2
    grid = np.zeros((n_across, n // n_across), np.int64)
    grid[across, along] = np.arange(n)
    return grid


def _roots(blades: Floats) -> Floats:
    """(B, 3) roots of blades (5 B, 3)."""
    roots: Floats = blades.reshape(-1, N_OF_BLADE, 3)[:, :2].mean(axis=1)
    return roots


def _lower_lashes(blades: Floats, moved: Floats) -> Floats:
    """(5 B, 3) motion of upper lashes that follow their roots and rotate forwards and down."""
    off = blades - np.repeat(_roots(blades), N_OF_BLADE, axis=0)
    length = np.linalg.norm(off[:, 1:], axis=1)
    turned = np.column_stack([off[:, 0], -SHUT_DOWN * length, SHUT_AHEAD * length])
    lowered: Floats = np.repeat(_roots(moved), N_OF_BLADE, axis=0) + turned - off
    return lowered


def _keep_under(blades: Floats, moved: Floats, line: Floats) -> Floats:
    """(5 B, 3) motion of lower lashes whose roots stay below and behind the line (N, 3) of the upper roots."""
    roots = _roots(blades + moved)
    order = np.argsort(line[:, 0])
    y, z = (np.interp(roots[:, 0], line[order, 0], line[order, k]) for k in (1, 2))
    more = np.zeros_like(roots)
    more[:, 1] = np.minimum(y - BELOW_MM - roots[:, 1], 0)
    more[:, 2] = np.maximum(z - BEHIND_MM - roots[:, 2], 0)
    kept: Floats = moved + np.repeat(more, N_OF_BLADE, axis=0)
    return kept


def _blades(
    places: Floats, quads: NDArray[np.int64], row: LashRow, generator: np.random.Generator
) -> tuple[sparse.csr_array, Floats, NDArray[np.int64]]:
    """Weights (5 B, S) of the strip's vertices, offsets (5 B, 3) and triangles (3 B, 3), 5 vertices per blade."""
    grid = strip_grid(quads)
    if places[grid[0], 2].mean() > places[grid[-1], 2].mean():
        grid = grid[::-1]  # roots lie behind tips
    n_across, n_along = grid.shape
    n = row.n_blades
    root = (np.arange(n) + generator.uniform(0.2, 0.8, n)) / n * (n_along - 1)
    ends = np.sin(np.pi * np.clip(root / (n_along - 1), 0.06, 0.94)) ** 0.5  # shorter towards the corners
    reach = row.length * ends * generator.uniform(0.72, 1.1, n)
    lean = np.interp(root / (n_along - 1), [0, 1], [-0.35, 0.35]) + generator.normal(0, 0.16, n)
    weights = sparse.lil_array((5 * n, len(places)))
    for blade in range(n):
        for vertex, share in ((0, 0.0), (1, 0.0), (2, 0.55), (3, 0.55), (4, 1.0)):
            along = np.clip(root[blade] + lean[blade] * share, 0, n_along - 1 - 1e-6)
            out = ROOT_ROW + share * reach[blade]
            i, j = min(int(out), n_across - 2), int(along)
            u, v = out - i, along - j
            for step, part in (
                ((0, 0), (1 - u) * (1 - v)),
                ((1, 0), u * (1 - v)),
                ((0, 1), (1 - u) * v),
                ((1, 1), u * v),
            ):
                weights[5 * blade + vertex, grid[i + step[0], j + step[1]]] += part
    tangent = np.gradient(places[grid[0]], axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    aside = interpolate_columns(tangent, np.arange(n_along), root) * row.width / 2
    offset = np.stack([aside, -aside, 0.7 * aside, -0.7 * aside, 0 * aside], axis=1).reshape(-1, 3)
    one = np.array([(0, 1, 2), (1, 3, 2), (2, 3, 4)])
    return weights.tocsr(), offset, (one + 5 * np.arange(n)[:, None, None]).reshape(-1, 3)
