"""Where hair grows on the scalp, and the paint of the scalp under a haircut."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from corpus_tools.dense.texels import Texels, find_texels
from corpus_tools.shipped.head.layout import layout_coordinates
from corpus_tools.shipped.head.noise import value_noise
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.subdivision import triangulate
from tts2face.numeric.arrays import FloatArray, smoothstep

MIDDLE = np.array([0.0, 25.0, -72.0])  # of the skull, mm
CROWN = np.array([14.0, 122.0, -98.0])  # strands run from here
# The hairline: height y in mm by the angle from the front about the skull's middle, in degrees.
LINE_DEG = np.array([0, 18, 34, 48, 58, 66, 74, 84, 98, 108, 122, 140, 160, 180])
LINE_Y = np.array([66, 67, 68, 62, 50, 30, 4, -6, 14, -6, -42, -60, -70, -72])
EAR = (np.array([80.0, -8.0, -72.0]), np.array([26.0, 30.0, 17.0]))  # |x|, y, z: no hair grows there
SOFT_MM = 15.0  # width of the hairline, over which strands get denser
REACH_MM, STEP_MM, BESIDE_MM = 40.0, 4.0, 5.0  # hair up to so far above the skin, and beside its normal, covers it
SMOOTH_MM = 7.0  # gaps such as a parting are closed, and the edge of the cover is smoothed, over this distance
# Cropped hair: coverage at the sides and what the top has more, contrast and size of the grain; width of its hairline,
# spread and size of its irregularities.
STUBBLE, STUBBLE_TOP, GRAIN, STUBBLE_MM = 0.72, 0.16, 0.12, 0.7
STUBBLE_SOFT_MM, RAGGED_MM, RAGGED_SIZE_MM, TOP_Y = 20.0, 2.5, 8.0, (0.0, 75.0)
STRAND_MM = 0.55  # width of a painted strand


def hair_share(places: FloatArray, soft_mm: float = SOFT_MM) -> FloatArray:
    """(P,) 1 where hair grows, 0 where it does not, for positions (P, 3) on the reference skin, mm."""
    off = places - MIDDLE
    angle = np.degrees(np.arctan2(np.abs(off[:, 0]), off[:, 2]))
    line = np.interp(angle, LINE_DEG, LINE_Y)
    share = smoothstep(places[:, 1] - line, -0.35 * SOFT_MM, soft_mm - 0.35 * SOFT_MM)
    mirrored = np.column_stack([np.abs(places[:, 0]), places[:, 1:]])
    ear = np.linalg.norm((mirrored - EAR[0]) / EAR[1], axis=1)
    grown: FloatArray = share * smoothstep(ear, 0.92, 1.12)
    return grown


def covered_share(skin: HeadSkin, hair: FloatArray) -> FloatArray:
    """(N,) share of a skin's scalp that lies under hair, given as points (S, 3) on the cards where strands are."""
    share = np.zeros(len(skin.vertices))
    scalp = np.flatnonzero(hair_share(skin.vertices) > 0)
    points = skin.vertices[scalp]
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)[scalp]
    heights = np.arange(-STEP_MM, REACH_MM, STEP_MM)
    rays = points[:, None] + heights[:, None] * normals[:, None]
    distance = np.asarray(cKDTree(hair).query(rays.reshape(-1, 3), distance_upper_bound=BESIDE_MM)[0])
    covered = np.isfinite(distance).reshape(len(points), -1).any(axis=1).astype(float)
    near = cKDTree(points).sparse_distance_matrix(cKDTree(points), 2.5 * SMOOTH_MM, output_type="coo_matrix").tocsr()
    near.data = np.exp(-((near.data / SMOOTH_MM) ** 2))
    smooth = (near @ covered + covered) / (np.asarray(near.sum(axis=1)).ravel() + 1.0)
    share[scalp] = smoothstep(smooth, 0.45, 0.8)
    return share


def paint_scalp(skin: HeadSkin, share: FloatArray, side: int, generator: np.random.Generator) -> NDArray[np.uint8]:
    """(side, side) coverage of the skin's texture by hair, 0-255, with strands at its edge; `share` is (N,)."""
    texels = find_texels(layout_coordinates(skin.source_uv), triangulate(skin.quads), side)
    place = texels.interpolate(skin.vertices)
    grown = texels.interpolate(share[:, None])[:, 0] * hair_share(place)
    fine = value_noise(strand_field(place, STRAND_MM, 22.0), 1.0, generator)
    fine += 0.6 * value_noise(strand_field(place, 3 * STRAND_MM, 30.0), 1.0, generator)
    edge = 4 * grown * (1 - grown)
    cover = np.clip(grown + 0.22 * fine * edge, 0, 1) * smoothstep(grown, 0.0, 0.12)
    return _fill_gaps(texels, 0.97 * cover, side)


def paint_stubble(skin: HeadSkin, side: int, generator: np.random.Generator) -> NDArray[np.uint8]:
    """(side, side) coverage of the skin's texture by hair of a few millimetres, 0-255."""
    texels = find_texels(layout_coordinates(skin.source_uv), triangulate(skin.quads), side)
    place = texels.interpolate(skin.vertices)
    grain = value_noise(place, STUBBLE_MM, generator)
    ragged = place + np.outer(RAGGED_MM * value_noise(place, RAGGED_SIZE_MM, generator), [0.0, 1.0, 0.0])
    share = stubble_share(ragged) * (STUBBLE + STUBBLE_TOP * smoothstep(place[:, 1], *TOP_Y))
    return _fill_gaps(texels, np.clip(share * (1 + grain * GRAIN / np.sqrt(share + 0.05)), 0, 1), side)


def stubble_share(places: FloatArray) -> FloatArray:
    """`hair_share` of cropped hair, which gets denser over a longer distance from the hairline."""
    return hair_share(places, STUBBLE_SOFT_MM)


def _fill_gaps(texels: Texels, cover: FloatArray, side: int) -> NDArray[np.uint8]:
    """(side, side) coverage, 0-255 in 32 steps; texels off the surface take the nearest value on it."""
    picture, is_gap = np.zeros((side, side)), np.ones((side, side), bool)
    picture[texels.rows, texels.columns], is_gap[texels.rows, texels.columns] = cover, False
    nearest = distance_transform_edt(is_gap, return_distances=False, return_indices=True)
    return share_levels(picture[tuple(nearest)])


def share_levels(share: FloatArray) -> NDArray[np.uint8]:
    """Shares of 0 to 1 in 32 levels of coverage, which compress well."""
    levels: NDArray[np.uint8] = np.rint(share * 31).astype(np.uint8) * np.uint8(8)
    return levels


def strand_field(places: FloatArray, width_mm: float, length_mm: float) -> FloatArray:
    """(P, 3) coordinates in which noise of size 1 has the width and length of a strand that runs from the crown."""
    off = places - CROWN
    axis = (CROWN - MIDDLE) / np.linalg.norm(CROWN - MIDDLE)
    ahead = np.array([0, 0, 1.0]) - axis[2] * axis
    ahead /= np.linalg.norm(ahead)
    aside = np.cross(ahead, axis)
    turn = np.arctan2(off @ aside, off @ ahead)
    far = np.linalg.norm(off, axis=1)
    swirl = turn + 0.004 * far
    around = 75.0  # mm, about the skull's radius, where strand widths are exact
    return np.column_stack([around * np.cos(swirl) / width_mm, around * np.sin(swirl) / width_mm, far / length_mm])
