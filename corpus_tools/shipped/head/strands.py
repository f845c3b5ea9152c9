"""Strands of hair cards: their direction in the texture and in space, and a relief of fine strands along it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import gaussian_filter, minimum_filter, zoom
from scipy.sparse.csgraph import connected_components

from tts2face.models.hair import MEAN_RELIEF
from tts2face.numeric.arrays import LUMINANCE, FloatArray, IntArray, decode_srgb, unit_vectors

SHADE_PX = 22.0  # at 512 pixels; lighter and darker areas wider than this are painted highlights, and are removed
FINE_PX, FINE_STEPS = 0.55, 26  # width of a fine strand, and half its length, in pixels
BROAD_PX, BROAD_STEPS = 2.2, 60
FINE_GAIN, BROAD_GAIN, ALPHA_GAIN = 0.20, 0.165, 0.22
N_SMOOTHINGS = 3
OUTLINE_PX, SOLID_COVER = 5, 0.9  # width of a card's outline in its picture, and coverage inside
OUTLINE_LIGHT, OUTLINE_WEIGHT = 1.0, 0.02  # brightness of outlines relative to the hair beside, and share of direction


@dataclass(frozen=True, slots=True, eq=False)
class Cards:
    """Hair cards: vertices (N, 3) in mm, triangles (F, 3), texture coordinates (N, 2); ``weld`` numbers places (N,)."""

    vertices: FloatArray
    triangles: IntArray
    uv: FloatArray
    weld: IntArray


@dataclass(frozen=True, slots=True)
class StrandStyle:
    """How the strands of a texture are found.

    ``blur_px`` smooths the direction, ``upright`` favours strands that run along v, ``matte`` clears the dark ground
    of a texture whose coverage is too large, ``contrast`` is that of the relief of the source. ``shade_px`` is the
    least length along v of lighter and darker areas that are removed, ``broad`` the contrast of broad strands.
    """

    blur_px: float = 6.0
    upright: float = 0.0
    matte: bool = False
    contrast: float = 0.8
    shade_px: float = SHADE_PX
    broad: float = BROAD_GAIN


def strand_coverage(picture: NDArray[np.uint8], style: StrandStyle) -> FloatArray:
    """(H, W) coverage in [0, 1]."""
    cover: FloatArray = picture[:, :, 3] / 255.0
    if style.matte:
        brightest = gaussian_filter(picture[:, :, :3].max(axis=2) / 255.0, 1.0)
        cover = cover * np.clip((brightest - 0.035) / 0.04, 0, 1)
    return cover


def strand_angles(picture: NDArray[np.uint8], cover: FloatArray, style: StrandStyle) -> FloatArray:
    """(H, W) direction of the strands in the texture, radians from +u towards +v (down), by the structure tensor.

    Only texels inside the cards count: the outline of a card is no strand.
    """
    inside = solid_share(cover)
    light = np.sqrt(picture[:, :, :3] / 255.0) @ np.array([0.3, 0.6, 0.1]) * cover + 0.5 * cover
    down, across = np.gradient(gaussian_filter(light, 0.8))
    weight = inside + OUTLINE_WEIGHT
    xx, xy, yy = (
        gaussian_filter(weight * part, style.blur_px) for part in (across * across, across * down, down * down)
    )
    xx = xx + style.upright * np.mean(xx + yy)
    angles: FloatArray = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2
    return angles


def solid_share(cover: FloatArray) -> FloatArray:
    """(H, W) 1 for texels with covered ones all around, else 0."""
    return np.asarray(minimum_filter(cover, OUTLINE_PX) > SOLID_COVER, np.float64)


def flat_relief(picture: NDArray[np.uint8], cover: FloatArray, style: StrandStyle) -> FloatArray:
    """(H, W) luminance over that of the neighbourhood, so that painted highlights vanish; about 1.

    Outlines, which the pictures' ground brightens, are no lighter than the hair beside them.
    """
    light = decode_srgb(picture[:, :, :3] / 255.0) @ LUMINANCE
    inside = solid_share(cover)
    near = gaussian_filter(inside, OUTLINE_PX)
    beside = gaussian_filter(light * inside, OUTLINE_PX) / np.maximum(near, 1e-6)
    light = np.where((inside < 1) & (near > 1e-3), np.minimum(light, OUTLINE_LIGHT * beside), light)
    weight = np.maximum(cover, 1e-3)
    shade_px = (style.shade_px, SHADE_PX)
    around = gaussian_filter(light * weight, shade_px) / gaussian_filter(weight, shade_px)
    relief: FloatArray = np.clip(light / np.maximum(around, 1e-4), 0.05, 3.0) ** style.contrast
    return relief


def bake_strands(
    picture: NDArray[np.uint8], style: StrandStyle, side: int, generator: np.random.Generator
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], FloatArray]:
    """Relief (side, side), 128 where a strand has the hair's colour, coverage (side, side), and `strand_angles`."""
    cover = strand_coverage(picture, style)
    angles = strand_angles(picture, cover, style)
    gain = side / len(picture)
    double = np.stack([zoom(np.cos(2 * angles), gain, order=1), zoom(np.sin(2 * angles), gain, order=1)])
    wide_angles = np.arctan2(double[1], double[0]) / 2
    fine = streaks(wide_angles, FINE_PX, FINE_STEPS, generator)
    fine -= gaussian_filter(fine, 12.0)
    fine /= fine.std()
    broad = streaks(wide_angles, BROAD_PX, BROAD_STEPS, generator)
    relief = zoom(flat_relief(picture, cover, style), gain, order=1)
    relief *= np.clip(1 + FINE_GAIN * fine + style.broad * broad / broad.std(), 0.25, 2.2)
    alpha = np.clip(zoom(cover, gain, order=1), 0, 1)
    relief /= (relief * alpha).sum() / alpha.sum()
    has_edge = (alpha > 0.02) & (alpha < 0.97)
    alpha = np.clip(alpha * (1 + ALPHA_GAIN * fine * has_edge), 0, 1)
    relief = np.where(alpha > 0.02, relief, gaussian_filter(relief, 6.0))
    return (
        np.rint(np.clip(relief * MEAN_RELIEF, 0, 255)).astype(np.uint8),
        (np.rint(alpha * 31) * (255 / 31)).astype(np.uint8),
        angles,
    )


def streaks(angles: FloatArray, width_px: float, n_steps: int, generator: np.random.Generator) -> FloatArray:
    """(H, W) noise averaged along directions (line integral convolution; Cabral and Leedom 1993)."""
    noise = gaussian_filter(generator.standard_normal(angles.shape), width_px)
    cosine, sine = np.cos(angles), np.sin(angles)
    height, width = angles.shape
    total = np.zeros_like(noise)
    for sign in (1.0, -1.0):
        rows, columns = (grid.astype(float) for grid in np.indices(angles.shape))
        along = np.stack([sign * cosine, sign * sine])
        for _ in range(n_steps):
            row = np.clip(np.rint(rows), 0, height - 1).astype(np.int64)
            column = np.clip(np.rint(columns), 0, width - 1).astype(np.int64)
            total += noise[row, column]
            here = np.stack([cosine[row, column], sine[row, column]])
            along = here * np.where((here * along).sum(axis=0) < 0, -1.0, 1.0)
            columns += along[0]
            rows += along[1]
    return total


def strand_tangents(cards: Cards, angles: FloatArray) -> FloatArray:
    """(N, 3) unit vectors along the strands, downwards, of cards whose texture has the directions `angles` (H, W)."""
    vertices, triangles = cards.vertices, cards.triangles
    height, width = angles.shape
    to_second, to_third = (vertices[triangles[:, k]] - vertices[triangles[:, 0]] for k in (1, 2))
    first, second = ((cards.uv[triangles[:, k]] - cards.uv[triangles[:, 0]]) * [width, height] for k in (1, 2))
    determinant = first[:, 0] * second[:, 1] - second[:, 0] * first[:, 1]
    determinant = np.where(np.abs(determinant) < 1e-6, 1e-6, determinant)[:, None]
    along_u = (to_second * second[:, 1:] - to_third * first[:, 1:]) / determinant
    along_v = (to_third * first[:, :1] - to_second * second[:, :1]) / determinant
    texel = np.clip((cards.uv[triangles].mean(axis=1) * [width, height]).astype(np.int64), 0, [width - 1, height - 1])
    angle = angles[texel[:, 1], texel[:, 0]][:, None]
    flow = unit_vectors(along_u * np.cos(angle) + along_v * np.sin(angle))
    flow *= np.where(flow[:, 1:2] > 0, -1.0, 1.0)
    tangents = np.zeros_like(vertices)
    for corner in triangles.T:
        np.add.at(tangents, corner, flow)
    for _ in range(N_SMOOTHINGS):
        tangents = _weld_mean(tangents, cards.weld)
        face = tangents[triangles].mean(axis=1)
        spread = tangents.copy()
        for corner in triangles.T:
            np.add.at(spread, corner, face)
        tangents = spread
    return _weld_mean(tangents, cards.weld)


def _weld_mean(vectors: FloatArray, weld: IntArray) -> FloatArray:
    total = np.zeros((int(weld.max()) + 1, 3))
    np.add.at(total, weld, vectors)
    return unit_vectors(total[weld])


def number_islands(n: int, triangles: IntArray) -> IntArray:
    """(n,) number of the connected component of each vertex."""
    return np.asarray(connected_components(edge_graph(n, triangles), directed=False)[1], np.int64)


def edge_graph(n: int, triangles: IntArray) -> sparse.csr_array:
    """(n, n) matrix that is 1 for vertices that share an edge."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs = np.unique(np.concatenate([ends, ends[:, ::-1]]), axis=0)
    return sparse.csr_array((np.ones(len(pairs)), pairs.T), shape=(n, n))
