"""Texture of the cards of brows and lashes, and sets of cards of which a person shows one.

Strands of hair cards: their direction in the texture and in space, and a relief of fine strands along it.

Where hair grows on the scalp, and the paint of the scalp under a haircut.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import distance_transform_edt, gaussian_filter, minimum_filter, zoom
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from corpus_tools.dense.texels import Texels, find_texels
from corpus_tools.shipped.head.mesh import layout_coordinates, triangulate, value_noise
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.source import asset_files, read_picture
from tts2face.models.face import Texture
from tts2face.models.hair import MEAN_RELIEF
from tts2face.numeric.arrays import LUMINANCE, decode_srgb, smoothstep, unit_vectors

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

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

    vertices: Floats
    triangles: Ints
    uv: Floats
    weld: Ints


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


def strand_coverage(picture: NDArray[np.uint8], style: StrandStyle) -> Floats:
    """(H, W) coverage in [0, 1]."""
    cover: Floats = picture[:, :, 3] / 255.0
    if style.matte:
        brightest = gaussian_filter(picture[:, :, :3].max(axis=2) / 255.0, 1.0)
        cover = cover * np.clip((brightest - 0.035) / 0.04, 0, 1)
    return cover


def strand_angles(picture: NDArray[np.uint8], cover: Floats, style: StrandStyle) -> Floats:
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
    angles: Floats = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2
    return angles


def solid_share(cover: Floats) -> Floats:
    """(H, W) 1 for texels with covered ones all around, else 0."""
    return np.asarray(minimum_filter(cover, OUTLINE_PX) > SOLID_COVER, np.float64)


def flat_relief(picture: NDArray[np.uint8], cover: Floats, style: StrandStyle) -> Floats:
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
    relief: Floats = np.clip(light / np.maximum(around, 1e-4), 0.05, 3.0) ** style.contrast
    return relief


def bake_strands(
    picture: NDArray[np.uint8], style: StrandStyle, side: int, generator: np.random.Generator
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], Floats]:
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


def streaks(angles: Floats, width_px: float, n_steps: int, generator: np.random.Generator) -> Floats:
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


def strand_tangents(cards: Cards, angles: Floats) -> Floats:
    """(N, 3) unit vectors along the strands, downwards, of cards whose texture has the directions `angles` (H, W)."""
    vertices, triangles, uv, weld = cards.vertices, cards.triangles, cards.uv, cards.weld
    height, width = angles.shape
    one, two = (vertices[triangles[:, k]] - vertices[triangles[:, 0]] for k in (1, 2))
    first, second = ((uv[triangles[:, k]] - uv[triangles[:, 0]]) * [width, height] for k in (1, 2))
    determinant = first[:, 0] * second[:, 1] - second[:, 0] * first[:, 1]
    determinant = np.where(np.abs(determinant) < 1e-6, 1e-6, determinant)[:, None]
    along_u = (one * second[:, 1:] - two * first[:, 1:]) / determinant
    along_v = (two * first[:, :1] - one * second[:, :1]) / determinant
    texel = np.clip((uv[triangles].mean(axis=1) * [width, height]).astype(np.int64), 0, [width - 1, height - 1])
    angle = angles[texel[:, 1], texel[:, 0]][:, None]
    flow = unit_vectors(along_u * np.cos(angle) + along_v * np.sin(angle))
    flow *= np.where(flow[:, 1:2] > 0, -1.0, 1.0)
    tangents = np.zeros_like(vertices)
    for corner in triangles.T:
        np.add.at(tangents, corner, flow)
    for _ in range(N_SMOOTHINGS):
        tangents = _weld_mean(tangents, weld)
        face = tangents[triangles].mean(axis=1)
        spread = tangents.copy()
        for corner in triangles.T:
            np.add.at(spread, corner, face)
        tangents = spread
    return _weld_mean(tangents, weld)


def _weld_mean(vectors: Floats, weld: Ints) -> Floats:
    total = np.zeros((int(weld.max()) + 1, 3))
    np.add.at(total, weld, vectors)
    return unit_vectors(total[weld])


def number_islands(n: int, triangles: Ints) -> Ints:
    """(n,) number of the connected component of each vertex."""
    return np.asarray(connected_components(edge_graph(n, triangles), directed=False)[1], np.int64)


def edge_graph(n: int, triangles: Ints) -> sparse.csr_array:
    """(n, n) matrix that is 1 for vertices that share an edge."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs = np.unique(np.concatenate([ends, ends[:, ::-1]]), axis=0)
    return sparse.csr_array((np.ones(len(pairs)), pairs.T), shape=(n, n))


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


def hair_share(places: Floats, soft_mm: float = SOFT_MM) -> Floats:
    """(P,) 1 where hair grows, 0 where it does not, for positions (P, 3) on the reference skin, mm."""
    off = places - MIDDLE
    angle = np.degrees(np.arctan2(np.abs(off[:, 0]), off[:, 2]))
    line = np.interp(angle, LINE_DEG, LINE_Y)
    share = smoothstep(places[:, 1] - line, -0.35 * SOFT_MM, soft_mm - 0.35 * SOFT_MM)
    mirrored = np.column_stack([np.abs(places[:, 0]), places[:, 1:]])
    ear = np.linalg.norm((mirrored - EAR[0]) / EAR[1], axis=1)
    grown: Floats = share * smoothstep(ear, 0.92, 1.12)
    return grown


def covered_share(skin: HeadSkin, hair: Floats) -> Floats:
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


def paint_scalp(skin: HeadSkin, share: Floats, side: int, generator: np.random.Generator) -> NDArray[np.uint8]:
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


def stubble_share(places: Floats) -> Floats:
    """`hair_share` of cropped hair, which gets denser over a longer distance from the hairline."""
    return hair_share(places, STUBBLE_SOFT_MM)


def _fill_gaps(texels: Texels, cover: Floats, side: int) -> NDArray[np.uint8]:
    """(side, side) coverage, 0-255 in 32 steps; texels off the surface take the nearest value on it."""
    picture, is_gap = np.zeros((side, side)), np.ones((side, side), bool)
    picture[texels.rows, texels.columns], is_gap[texels.rows, texels.columns] = cover, False
    nearest = distance_transform_edt(is_gap, return_distances=False, return_indices=True)
    return share_levels(picture[tuple(nearest)])


def share_levels(share: Floats) -> NDArray[np.uint8]:
    """Shares of 0 to 1 in 32 levels of coverage, which compress well."""
    levels: NDArray[np.uint8] = np.rint(share * 31).astype(np.uint8) * np.uint8(8)
    return levels


def strand_field(places: Floats, width_mm: float, length_mm: float) -> Floats:
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


SIDE = 1024
BROWS = ("eyebrow001", "eyebrow010", "eyebrow008", "eyebrow012")  # two finer sets, two fuller ones
LASHES = ("eyelashes02", "eyelashes01")
# Rows of each brow's picture that hold hairs, and where they go: rows of the texture, columns 0 to 512.
BROW_ROWS = {"eyebrow001": (140, 400), "eyebrow010": (252, 512), "eyebrow008": (200, 460), "eyebrow012": (240, 500)}
BROW_HEIGHT = 252
LASH_LEFT = 512
BROW_COLOUR, LASH_COLOUR = (0.195, 0.138, 0.105), (0.065, 0.047, 0.040)  # sRGB
BROW_BLUR_PX, BROW_COVER = 0.7, 0.94  # of the hairs of brows: softer and lighter than ink
HAZE = 40.0  # coverage between the hairs of the pictures, of 255
CARDS_TEXTURE, EYE_TEXTURE = 1, 2  # numbers of the face's textures
HIDDEN = np.array([0.0, 10.0, -85.0])  # inside the skull: cards that a person does not show


@dataclass(frozen=True, slots=True)
class CardChoice:
    """The cards that a person shows: names of `BROWS` and `LASHES`."""

    brows: str = "eyebrow001"
    lashes: str = "eyelashes02"


def cards_texture(folder: Path, brow_colour: tuple[float, float, float] = BROW_COLOUR) -> Texture:
    """The texture of all brows and lashes."""
    alpha = np.zeros((SIDE, SIDE))
    for number, name in enumerate(BROWS):
        low, high = BROW_ROWS[name]
        top = number * BROW_HEIGHT
        picture = read_picture(folder / asset_files()[f"brows/{name}"][1])
        alpha[top : top + BROW_HEIGHT, :512] = picture[low:high, :, 3][:BROW_HEIGHT]
    for number, name in enumerate(LASHES):
        picture = read_picture(folder / asset_files()[f"lashes/{name}"][1])
        alpha[number * 512 : number * 512 + 512, LASH_LEFT:] = picture[:, :, 3]
    pixels = np.zeros((SIDE, SIDE, 3))
    pixels[:], pixels[:, :LASH_LEFT] = LASH_COLOUR, brow_colour
    cover = np.clip((alpha - HAZE) * 255 / (225 - HAZE), 0, 255)
    cover[:, :LASH_LEFT] = BROW_COVER * gaussian_filter(cover[:, :LASH_LEFT], BROW_BLUR_PX)
    return Texture(np.rint(255 * pixels).astype(np.uint8), np.rint(cover).astype(np.uint8))


def brow_coordinates(name: str, uv: Floats) -> Floats:
    """(N, 2) coordinates in the texture of a brow's own (N, 2)."""
    top = BROWS.index(name) * BROW_HEIGHT
    rows = np.clip(512 * uv[:, 1] - BROW_ROWS[name][0], 1, BROW_HEIGHT - 1)
    placed: Floats = np.column_stack([512 * uv[:, 0], top + rows]) / SIDE
    return placed


def lash_coordinates(name: str, uv: Floats) -> Floats:
    """(N, 2) coordinates in the texture of a set of lashes' own (N, 2)."""
    placed: Floats = (512 * uv + [LASH_LEFT, 512 * LASHES.index(name)]) / SIDE
    return placed
