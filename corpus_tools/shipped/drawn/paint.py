"""Textures of a drawn character: skin in soft gradients, computed per texel, and an iris of clean rings."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from corpus_tools.dense.texels import Texels, find_texels
from corpus_tools.shipped.drawn.character import Brow, CharacterColours, Colour, DrawnCharacter
from corpus_tools.shipped.drawn.fields import profile, smooth_line
from corpus_tools.shipped.head.eyes import TEXTURE_SIDE, EyeStyle
from corpus_tools.shipped.head.layout import layout_coordinates
from corpus_tools.shipped.head.lid_edges import LidEdge
from corpus_tools.shipped.head.noise import gaussian_bump
from corpus_tools.shipped.head.skin import HeadSkin
from corpus_tools.shipped.head.source import SourceMesh
from corpus_tools.shipped.head.subdivision import triangulate
from corpus_tools.shipped.head.texture import INNER_LIP_Z, fill_gaps, in_mouth, line_distance, sample_mask
from tts2face.numeric.arrays import FloatArray, smoothstep
from tts2face.picture.baked.eyes import EDGE_RAD

SIDE = 1024  # pixels of the square texture
NEAR_MM = 14.0  # from a line, as far as a tint along it may reach
FRONT_Z, FRONT_TINT_Z = (-40.0, -5.0), -20.0  # tints whose centre lies before the second fade out over the first
LID_LINE_MM, SHUT_LINE_MM, LID_LINE = 2.6, 2.8, 0.9  # reach of the dark edge, open and shut, and its strength
CREASE_OFF_MM, CREASE_MM, CREASE = 5.0, 2.6, 0.28
WATERLINE_MM, WATERLINE = 1.0, 0.45
FRECKLE_SEED, FRECKLE = 3, (0.80, 0.68, 0.60)
HAIR_SHADE = 0.9  # of the colour of hair, on the skin under it
BROW_SEED, N_LINE = 5, 200
HAIR_WIDTH_MM, HAIR_MM = 0.30, ((0, 5.5), (0.3, 6.5), (0.7, 5.0), (1, 3.0))  # of a brow's hairs, along the brow
HAIR_LEAN_DEG = ((0, 80), (0.15, 55), (0.4, 30), (0.7, 12), (1, 2))  # of a brow's hairs over its line
SPOKES = ((23, 0.5, 0.3), (37, 0.35, 1.9), (52, 0.25, 4.0))  # of the iris: number, strength, phase


def paint_skin(
    source: SourceMesh,
    skin: HeadSkin,
    lids: Sequence[LidEdge],
    character: DrawnCharacter,
    mouth_y: float,
    hair: FloatArray,
) -> NDArray[np.uint8]:
    """(SIDE, SIDE, 3) texture of the skin.

    `mouth_y` is the height of the middle of the line between the lips, `hair` (N,) the share of the skin under hair.
    """
    palette = character.palette
    texels = find_texels(layout_coordinates(skin.source_uv), triangulate(skin.quads), SIDE)
    place, where = texels.interpolate(skin.vertices), texels.interpolate(skin.source_uv)
    colour = _Paint(np.tile(np.array(palette.skin), (len(place), 1)))
    front = smoothstep(place[:, 2], *FRONT_Z)
    for centre, reach, factor in palette.tints:
        colour.tint(gaussian_bump(place, centre, reach) * (front if centre[2] > FRONT_TINT_Z else 1), factor)
    colour.tint(_mask(source, "ears", 6, where), palette.ears)
    colour.tint(_mask(source, "eyelids", 5, where), palette.lids)
    share = smoothstep(_mask(source, "lips", 3.2, where), 0.12, 0.88) * palette.lip_strength
    colour.blend(share, _lips(place, palette, mouth_y))
    colour.blend(*_mouth(source, place, where, palette))
    _paint_lids(colour, texels, skin, lids, palette)
    _sprinkle(colour, place, palette.n_freckles)
    colour.blend(_brow_hairs(place, character.brow), np.array(palette.brows))
    colour.blend(texels.interpolate(hair[:, None])[:, 0], HAIR_SHADE * np.array(palette.hair))
    return fill_gaps(texels, colour.values, SIDE)


def vertex_masks(source: SourceMesh, source_uv: FloatArray, depth: FloatArray) -> dict[str, FloatArray]:
    """Shares (N,) of the skin's vertices that are ``lips``, and ``inner``, the inside of the mouth behind them.

    `source_uv` (N, 2) are their coordinates in MakeHuman's layout, `depth` (N,) their z in mm.
    """
    lips = smoothstep(_mask(source, "lips", 3.2, source_uv), 0.12, 0.88)
    inner = _in_mouth(source, source_uv) * (1 - smoothstep(depth, *INNER_LIP_Z))
    return {"lips": lips, "inner": inner}


class _Paint:
    """Colours (P, 3) of texels that are tinted and painted over."""

    def __init__(self, values: FloatArray) -> None:
        self.values = values

    def tint(self, share: FloatArray, factor: Colour) -> None:
        """Multiply by a colour's factors, where the share (P,) is 1."""
        self.values = self.values * (1 + share[:, None] * (np.array(factor) - 1))

    def blend(self, share: FloatArray, colours: FloatArray) -> None:
        """Paint over by colours (3,) or (P, 3), where the share (P,) is 1."""
        self.values = self.values + share[:, None] * (colours - self.values)


def _mask(source: SourceMesh, name: str, blur: float, where: FloatArray) -> FloatArray:
    """(P,) values of a blurred mask of the source at coordinates (P, 2), v up."""
    return sample_mask(gaussian_filter(source.mask(name), blur), where)


def _lips(place: FloatArray, palette: CharacterColours, mouth_y: float) -> FloatArray:
    """(P, 3) colour of the lips: the upper one darker, both deeper towards the line between them."""
    upper = smoothstep(place[:, 1], mouth_y - 0.6, mouth_y + 2.2)
    line = np.exp(-(((place[:, 1] - mouth_y) / 1.3) ** 2)) * (np.abs(place[:, 0]) < 40)
    darker = 1 - 0.10 * upper[:, None] * np.array([0.8, 1, 1])
    return np.asarray(np.array(palette.lips) * darker * (1 - 0.16 * line[:, None]))


def _mouth(
    source: SourceMesh, place: FloatArray, where: FloatArray, palette: CharacterColours
) -> tuple[FloatArray, FloatArray]:
    """Share (P,) and colour (P, 3) of the inside of the mouth: dark towards the throat, lips towards the front."""
    colour = np.array(palette.cavity) * (1 - 0.55 * smoothstep(-place[:, 2], -15.0, 25.0))[:, None]
    near = smoothstep(place[:, 2], *INNER_LIP_Z)[:, None]
    return _in_mouth(source, where), colour + near * (0.93 * np.array(palette.lips) - colour)


def _in_mouth(source: SourceMesh, where: FloatArray) -> FloatArray:
    """(P,) share of places (P, 2) in MakeHuman's layout that is the inside of the mouth."""
    return smoothstep(np.maximum(_mask(source, "inside-mouth", 2.0, where), in_mouth(where)), 0.15, 0.95)


def _paint_lids(
    colour: _Paint, texels: Texels, skin: HeadSkin, lids: Sequence[LidEdge], palette: CharacterColours
) -> None:
    """The dark edge of the upper lid, the shadow of its crease, and the waterline of the lower one."""
    place = texels.interpolate(skin.vertices)
    shut = skin.vertices + skin.shapes["eyeBlinkLeft"] + skin.shapes["eyeBlinkRight"]
    shut_place = texels.interpolate(shut)
    for edge in lids:
        upper = skin.vertices[edge.upper]
        distance = line_distance(place, upper, NEAR_MM)
        shut_distance = line_distance(
            shut_place, shut[edge.upper], NEAR_MM
        )  # not the skin that is folded behind the edge
        line = np.minimum(_near(distance, LID_LINE_MM), _near(shut_distance, SHUT_LINE_MM))
        colour.tint(LID_LINE * line, palette.lid_line)
        order = np.argsort(upper[:, 0])
        is_above = place[:, 1] > np.interp(place[:, 0], upper[order, 0], upper[order, 1])
        colour.tint(CREASE * _near(distance - CREASE_OFF_MM, CREASE_MM) * is_above, palette.crease)
        colour.tint(
            WATERLINE * _near(line_distance(place, skin.vertices[edge.lower], NEAR_MM), WATERLINE_MM), palette.waterline
        )


def _near(distance: FloatArray, reach: float) -> FloatArray:
    return np.asarray(np.exp(-((distance / reach) ** 2)))


def _sprinkle(colour: _Paint, place: FloatArray, number: int) -> None:
    """Freckles across the nose and cheeks."""
    generator = np.random.default_rng(FRECKLE_SEED)
    for _ in range(number):
        x = generator.normal(0, 17)
        y = -24 - 0.012 * x * x + generator.normal(0, 5)
        size = generator.uniform(0.45, 0.8)
        squared = ((place[:, :2] - [x, y]) ** 2).sum(axis=1)
        is_near = (squared < 9) & (place[:, 2] > 0)
        strength = generator.uniform(0.25, 0.6)
        colour.tint(np.where(is_near, strength * np.exp(-squared / size**2), 0.0), FRECKLE)


def _brow_hairs(place: FloatArray, brow: Brow) -> FloatArray:
    """(P,) share of skin that the hairs of both brows cover; they rise at the nose and lie along the line outside."""
    uncovered = np.ones(len(place))
    generator = np.random.default_rng(BROW_SEED)
    line = smooth_line(brow.line, N_LINE)
    ahead = np.gradient(line, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    tree = cKDTree(place[:, :2])
    is_front = place[:, 2] > 0
    for sign in (1.0, -1.0):
        at = generator.beta(1.1, 1.25, brow.hairs)
        row = np.minimum((at * N_LINE).astype(int), N_LINE - 1)
        off = np.clip(generator.normal(0, 0.5, brow.hairs), -1, 1) * profile(brow.half_width, at)
        lean = np.radians(np.interp(at, *np.array(HAIR_LEAN_DEG).T) - 22 * off / brow.half_width[2][1])
        lean += generator.normal(0, 0.12, brow.hairs)
        out = ahead[row]
        up = np.column_stack([-out[:, 1], out[:, 0]])
        root = line[row] + off[:, None] * up
        way = np.cos(lean)[:, None] * out + np.sin(lean)[:, None] * up
        long = generator.uniform(0.75, 1.15, brow.hairs) * np.interp(at, *np.array(HAIR_MM).T)
        strength = generator.uniform(0.35, 0.75, brow.hairs)
        for start, direction, length, dark in zip(root, way, long, strength, strict=True):
            middle = (start + direction * length / 2) * [sign, 1]
            near = np.array(tree.query_ball_point(middle, length / 2 + 1.0), np.int64)
            near = near[is_front[near]]
            from_root = place[near, :2] * [sign, 1] - start
            along = np.clip(from_root @ direction, 0, length)
            apart = np.linalg.norm(from_root - along[:, None] * direction, axis=1)
            thin = HAIR_WIDTH_MM * (1 - 0.5 * along / length)
            uncovered[near] *= 1 - dark * np.exp(-((apart / thin) ** 2))
    return np.asarray(1 - uncovered)


def paint_eye(style: EyeStyle, palette: CharacterColours) -> NDArray[np.uint8]:
    """(TEXTURE_SIDE, TEXTURE_SIDE, 3) texture of an eyeball: a dark ring, a light crescent opposite the key light."""
    grid = (np.arange(TEXTURE_SIDE) + 0.5) / TEXTURE_SIDE - 0.5
    across, up = np.meshgrid(grid, -grid)
    off, turn = 2 * EDGE_RAD * np.hypot(across, up), np.arctan2(up, across)
    radius, pupil = off / style.iris, style.pupil / style.iris
    pixel = 2 * EDGE_RAD / TEXTURE_SIDE / style.iris
    dark, middle = np.array(palette.iris_dark), np.array(palette.iris)
    iris = dark + (middle - dark) * np.clip(1.5 * smoothstep(radius, pupil, 0.93)[..., None], 0, 1)
    # light gathers in the lower half: the transparent look of a drawn eye
    low = (
        np.clip(0.30 - 0.75 * np.sin(turn), 0, 1)
        * smoothstep(radius, 0.30, 0.62)
        * (1 - smoothstep(radius, 0.74, 0.95))
    )
    iris = iris + 0.95 * low[..., None] * (np.array(palette.iris_light) - iris)
    spokes = sum(strength * np.cos(number * turn + phase) for number, strength, phase in SPOKES)
    ring = smoothstep(radius, 0.35, 0.6) * (1 - smoothstep(radius, 0.8, 0.95))
    iris = iris * (1 + 0.05 * (spokes * ring)[..., None])
    iris = iris + smoothstep(radius, 0.80, 0.95)[..., None] * (np.array(palette.iris_rim) - iris)
    is_pupil = 1 - smoothstep(radius, pupil - 1.5 * pixel, pupil + 2.5 * pixel + 0.03)[..., None]
    iris = iris + is_pupil * (np.array(palette.pupil) - iris)
    far = smoothstep(off, style.iris + 0.10, 1.0)[..., None]
    white = np.array(palette.sclera) * (1 - far * np.array([0.05, 0.11, 0.11]))
    white = white * (1 - 0.12 * np.exp(-(((off - style.iris) / 0.05) ** 2))[..., None])
    border = smoothstep(off, style.iris - 0.012, style.iris + 0.020)[..., None]
    return np.asarray(np.rint(255 * np.clip(iris + border * (white - iris), 0, 1)), np.uint8)
