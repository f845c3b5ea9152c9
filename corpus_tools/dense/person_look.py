"""Look of a person's head from videos, besides shape and skin: light, hair, eyes, brows and shirt."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.hair_region import (
    ACROSS_MM,
    CELL_MM,
    OFF_BACKGROUND,
    UP_MM,
    Portrait,
    SeenHair,
    find_hair,
    portrait_grid,
)
from corpus_tools.dense.hairdo import HAIRCUTS, UNSEEN, name_below_hat, name_hair
from corpus_tools.dense.hats import HAIR_LINE, below_hat
from corpus_tools.dense.light_colour import (
    MIN_IRIS_PX,
    EyeColours,
    clear_iris,
    estimate_cast,
    log_colour,
    median_eyes,
    sample_eyes,
    srgb_colour,
)
from corpus_tools.dense.mesh_fit import part_vertices
from corpus_tools.dense.skin_colour import PictureFitter, sample_picture
from corpus_tools.dense.texels import find_texels
from lexicon.values.fields import check_fields
from tts2face.models.face import Face, Hairdo
from tts2face.models.face_tint import tint_parts
from tts2face.models.landmarks import CHIN, EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.models.named_colours import EYE_COLOURS, HAIR_COLOURS, parse_eye_colour, parse_hair_colour
from tts2face.numeric.arrays import FloatArray, Mask, smoothstep
from tts2face.photo.matte import Network, read_person

NOSE_BASE = 2  # landmark
UNSEEN_HAIR = "dark-brown"  # where the top of the head is outside of the picture
SHADOW_CELLS = 2  # of the portrait, beside hair: its shadow on the skin
N_PERSONS = 12  # pictures in which a network reads the person
HAIR_LIGHT = (0.005, 0.6)  # luminance of the darkest and lightest hair
CROPPED_LIGHT = -1.3  # most luminance of cropped hair, of the skin's, logarithm: what is seen is hair and skin mixed
SEEN_SKIN = 0.4  # of what differs from skin, which cropped hair lets through: rendered heads of three tones
SHINE = 0.5  # logarithm by which hair in a picture is lighter than its strands and brows; median of rendered haircuts
# Casts of cameras and walls lead off the line of natural hair; what is further off than these is dyed or red.
NATURAL = (0.4, 0.7)
GREY = 0.35  # log R/G below which hair is rather grey in yellowish light than blond
BLACK_SHINE, DARK_GREY = 1.0, (0.9, 1.6)  # logarithms: of shine on black hair, which is so much darker than skin
CHILD_BROWN = 0.5  # least log R/G of a child's hair
# Heights of eyes above chin and base of the nose, of the distance of the outer eye corners, summed: a child of
# nine 1.67, adults 1.75 (a broad smile, no teeth) to 1.99.
CHILD = 1.71
DRAWN_CHILD = 1.4  # the same of drawn people: a girl to 1.37, a young woman 1.43, others from 1.47
NEUTRAL_IRIS = EYE_COLOURS["brown"]
# least luminance; up to which irises are brown
IRIS_LIGHT = 0.012
DARK_IRIS = 0.02
DARK_IRIS_HUE = (0.55, -0.55)
BROWN_FROM, BROWN_BLUE = 0.45, -0.3  # least log R/G and most log B/G of brown irises; others are less red
PALE_IRIS, PALE_BROWN_FROM = 0.11, 0.6  # luminance from which irises are hazel up to this log R/G
IRIS_WHITE = np.array([0.08, 0.0])  # log R/G and B/G of the white of the eye, beside which irises are measured
BROWN_SLOPE, BROWN_LIGHT = -0.8, 0.035  # of B/G: their least R/G; usual luminance
WHITE_SHARE, OFF_SKIN = 0.7, (0.05, 0.3)  # of the white's cast; log R/G by which it must be less red than the skin
DRAWN_CHROMA = 0.7  # painted brown is more vivid than irises: their log R/G and B/G, of its
AMBER = -0.9  # log B/G up to which more yellow is redder; irises beyond are amber
BROW_LIGHT = -1.9  # most luminance of brows, of the skin's, logarithm
ROOT_MM, LASH_MM = 0.7, 10.0  # off the skin: roots of lashes, and lashes that are shown
LASH_LENGTH = 0.55  # of the default head's, which are those of made-up eyes
NEUTRAL_SHIRT = "6a6b6d"
# below the chin; deviation of its luminance, logarithm
SHIRT_MM = 30.0
SHIRT_SPREAD = 0.5
MIN_SHIRT_CELLS = 60
SHIRT_HUE, SHIRT_LIGHT = 0.35, (0.03, 0.2)  # share of its colour that is kept, bounds of its luminance
VIVID_SHADE = 0.25  # by which the upper bound falls with the colour, logarithms
NAMING_LIGHT = 0.5  # weight of luminance beside hue where a colour is named
PLAIN_CAST = 0.03  # logarithm up to which light is called neutral
MIN_SHARE = 0.3  # of the frames that show a cell of the portrait
TINT_LIMITS = (0.25, 4.0)


@dataclass(frozen=True, slots=True, eq=False)
class PersonLook:
    """Cast of the light (2,), colour of the skin in it (3,), and colours, sRGB (3,), of iris, brows and shirt."""

    cast: FloatArray
    skin: FloatArray
    hairdo: Hairdo
    length: str
    iris: NDArray[np.uint8]
    brows: NDArray[np.uint8]
    shirt: NDArray[np.uint8]
    notes: tuple[str, ...] = ()

    def summary(self) -> str:
        """One line for people; warm light lacks that share of blue, beside red, cold light of red, beside blue."""
        hair = self.length if self.length == "bald" else f"{self.length}, {_hair_word(self.hairdo.colour)}"
        warmth = float(self.cast[0] - self.cast[1])
        light = "neutral"
        if abs(warmth) > PLAIN_CAST:
            light = f"{-np.expm1(-abs(warmth)):.0%} {'warm' if warmth > 0 else 'cold'}, corrected".replace("%", " %")
        eyes = _nearest(log_colour(self.iris.astype(np.float64)), EYE_COLOURS).replace("-", " ")
        return "; ".join([f"hair: {hair}", f"eyes: {eyes}", f"light: {light}", *self.notes])


@dataclass(frozen=True, slots=True)
class LookChoices:
    """Choices of a look: a name of `EYE_COLOURS` or #rrggbb, whether fine lines of the skin stay, and seen glasses."""

    eye_color: str | None = None
    keeps_lines: bool = True
    wears_glasses: bool = True

    def __post_init__(self) -> None:
        """Refuse values of other types, and colours that do not exist (`InputError`)."""
        check_fields(self)
        if self.eye_color is not None:
            parse_eye_colour(self.eye_color)

    def applied(self, look: PersonLook) -> PersonLook:
        """The look with the colour of the eyes that is chosen."""
        if self.eye_color is None:
            return look
        return replace(look, iris=np.rint(255.0 * parse_eye_colour(self.eye_color)).astype(np.uint8))


AS_SEEN = LookChoices()


@dataclass(slots=True, eq=False)
class LookSampler:
    """Collects what frames show of a person, whose head a fitter places in them; a network reads the person in some."""

    fit: PictureFitter
    network: Network | None = None
    shares: list[NDArray[np.float32]] = field(default_factory=list)
    fine: NDArray[np.float32] | None = None
    slant: FloatArray | None = None  # (2,) of the first picture: mm by which it shows a place aside for each in depth
    hair: Mask | None = None
    portraits: list[NDArray[np.float32]] = field(default_factory=list)
    eyes: list[EyeColours] = field(default_factory=list)

    def add(self, picture: NDArray[np.uint8], points: NDArray[np.floating]) -> None:
        """Sample one frame (H, W, 3) with its landmarks (478, 3) in pixels."""
        self.portraits.append(self._cells(picture, points))
        if self.fine is None:
            self.fine = self._cells(picture, points, 2)
            turn = self.fit.pose(points)[0]
            self.slant = np.asarray(np.linalg.solve(turn[:2, :2], turn[:2, 2]), np.float64)
        if self.network is not None and len(self.shares) < N_PERSONS:
            apart = float(np.linalg.norm(points[EYE_OUTER_LEFT, :2] - points[EYE_OUTER_RIGHT, :2]))
            share = read_person(picture, points[:, :2].astype(np.float64), apart, self.network).share
            grey = np.repeat(np.rint(255.0 * share).astype(np.uint8)[..., None], 3, axis=2)
            self.shares.append(self._cells(grey, points)[..., 0] / 255.0)
        self.eyes.append(sample_eyes(picture, points))

    def _cells(self, picture: NDArray[np.uint8], points: NDArray[np.floating], step: int = 1) -> NDArray[np.float32]:
        """(R, C, 3) colours of the cells of a portrait, NaN outside of the picture."""
        linear, shift, _ = self.fit.pose(points)
        places = portrait_grid(self.fit.marks, step) @ linear.T + shift
        colours, inside = sample_picture(picture, places[:, :2] * (1.0, -1.0))
        colours[~inside] = np.nan
        return colours.astype(np.float32).reshape(step * (len(UP_MM) - 1) + 1, -1, 3)

    def look(self) -> PersonLook:
        """The look of the person in all frames."""
        grid = np.array(self.portraits)
        known = np.isfinite(grid[..., 0]).mean(axis=0) > MIN_SHARE
        middle = np.full(grid.shape[1:], np.nan)
        middle[known] = np.nanmedian(grid[:, known], axis=0)
        share = np.nan_to_num(self.shares).mean(axis=0).astype(np.float64) if self.shares else None
        fine = None if self.fine is None else self.fine.astype(np.float64)
        portrait = Portrait(middle, self.fit.marks, share, fine)
        eyes = median_eyes(self.eyes)
        cast = estimate_cast(eyes)
        hair = find_hair(portrait, eyes.skin)
        self.hair = hair.region
        hatted = below_hat(portrait, hair, cast)
        length = name_hair(portrait, hair, eyes.skin) if hatted is None else name_below_hat(portrait, hatted)
        hair = hatted or hair
        colour, code = log_colour(255.0 * parse_hair_colour(UNSEEN_HAIR)), UNSEEN_HAIR
        if np.isfinite(hair.colour).all():
            seen, most = hair.colour, 0.0
            if length == "cropped":
                seen, most = seen + SEEN_SKIN * (seen - eyes.skin), eyes.skin[0] + CROPPED_LIGHT
            seen = without_gloss_of_dark(neutral(seen, cast), eyes.skin)
            colour = hair_colour(seen, most, CHILD_BROWN if is_child(self.fit.marks, is_drawn=eyes.is_drawn) else 0.0)
            code = "#{:02x}{:02x}{:02x}".format(*srgb_colour(colour).tolist())
        notes = [] if length else ["top of the head not seen"]
        notes += [] if hatted is None else ["a hat, left off"]
        length = length or UNSEEN
        is_visible = eyes.radius_px >= MIN_IRIS_PX and np.isfinite(eyes.iris).all()
        iris = srgb_colour(iris_colour(eyes, cast)) if is_visible else parse_hex(NEUTRAL_IRIS)
        notes += [] if is_visible else ["eyes too small to tell their colour"]
        brows = np.array([min(colour[0] - SHINE, eyes.skin[0] + BROW_LIGHT), *colour[1:]])
        return PersonLook(
            cast, eyes.skin, Hairdo(HAIRCUTS[length], code), length, iris, srgb_colour(brows),
            shirt_colour(portrait, hair, cast), tuple(notes),
        )  # fmt: skip

    def under_hair(self, places: FloatArray) -> Mask:
        """(P,) which places (P, 3) of the head lie under the hair that `look` has found, or beside it in its shadow."""
        from scipy.ndimage import binary_dilation

        if self.hair is None or self.slant is None or not self.hair.any():
            return np.zeros(len(places), bool)
        near = binary_dilation(self.hair, iterations=SHADOW_CELLS)
        seen = places[:, :2] + (places[:, 2:] - portrait_grid(self.fit.marks)[0, 2]) * self.slant
        columns, rows = np.rint((seen - (ACROSS_MM[0], UP_MM[0])) / (CELL_MM, -CELL_MM)).astype(np.int64).T
        return np.asarray(near[rows.clip(0, len(UP_MM) - 1), columns.clip(0, len(ACROSS_MM) - 1)])


def neutral(colour: FloatArray, cast: FloatArray) -> FloatArray:
    """A colour (..., 3), `log_colour`, without a cast of the light."""
    clean: FloatArray = colour - np.concatenate([[0.0], cast])
    return clean


def is_child(marks: FloatArray, *, is_drawn: bool = False) -> bool:
    """Whether landmarks (468, 3) of a head, of a drawn person or another, are a child's."""
    outer = marks[[EYE_OUTER_RIGHT, EYE_OUTER_LEFT]]
    heights = outer[:, 1].mean() - marks[[CHIN, NOSE_BASE], 1]
    return bool(heights.sum() < (DRAWN_CHILD if is_drawn else CHILD) * np.linalg.norm(outer[0] - outer[1]))


def without_gloss_of_dark(hair: FloatArray, skin: FloatArray) -> FloatArray:
    """Colour (3,), `log_colour`, of hair beside skin: grey that is much darker than skin is black hair that shines."""
    is_grey = hair[1:] @ HAIR_LINE / (HAIR_LINE @ HAIR_LINE) < GREY
    shine = BLACK_SHINE * is_grey * smoothstep(skin[0] - hair[0], *DARK_GREY)
    return np.array([hair[0] - shine, *hair[1:]])


def hair_colour(seen: FloatArray, most: float = 0.0, least_brown: float = 0.0) -> FloatArray:
    """Colour of hair (3,), `log_colour`, that looks as `seen` in neutral light: natural colours are kept natural.

    `most` limits the logarithm of its luminance, `least_brown` is the least of R/G: a child's hair is not grey.
    """
    brown = max(float(seen[1:] @ HAIR_LINE / (HAIR_LINE @ HAIR_LINE)), 0.0)
    away = seen[1:] - brown * HAIR_LINE
    brown = max(brown, least_brown)
    along = brown * min(brown / GREY, 1.0) * HAIR_LINE
    kept = np.clip((np.linalg.norm(away) - NATURAL[0]) / (NATURAL[1] - NATURAL[0]), 0.0, 1.0)
    light = np.clip(min(seen[0], most), *np.log(HAIR_LIGHT))
    return np.array([light, *(along + kept * away)])


def iris_colour(eyes: EyeColours, cast: FloatArray) -> FloatArray:
    """Colour of the iris (3,), `log_colour`, in neutral light: by the cast, and by the white of the eye.

    A white whose hue is that of the skin is the lid's, and does not count.
    """
    clear = clear_iris(eyes)
    by_cast = neutral(clear, cast)
    light, hue = max(by_cast[0], np.log(IRIS_LIGHT)), by_cast[1:]
    if np.isfinite(eyes.sclera).all():
        trust = WHITE_SHARE * smoothstep(eyes.skin[1] - eyes.sclera[1], *OFF_SKIN)
        hue = hue + trust * (clear[1:] - eyes.sclera[1:] + IRIS_WHITE - hue)
    red, blue = hue * (DRAWN_CHROMA if eyes.is_drawn and hue[0] > 0 else 1.0)
    if light < np.log(DARK_IRIS):
        return np.array([light, *DARK_IRIS_HUE])
    if red > (PALE_BROWN_FROM if light > np.log(PALE_IRIS) else BROWN_FROM) and blue < BROWN_BLUE:
        usual = np.log(BROWN_LIGHT)
        return np.array([min(light, (light + usual) / 2), max(red, BROWN_SLOPE * max(blue, AMBER)), blue])
    return np.array([light, red, blue])


def shirt_colour(portrait: Portrait, hair: SeenHair, cast: FloatArray) -> NDArray[np.uint8]:
    """Muted colour of the clothes below the neck, sRGB; a neutral grey where they are not clearly seen."""
    from scipy.spatial import cKDTree

    known = np.isfinite(portrait.srgb[..., 0])
    low = known & (UP_MM[:, None] < portrait.marks[CHIN, 1] - SHIRT_MM) & ~hair.region & ~hair.other
    colours = log_colour(np.nan_to_num(portrait.srgb))
    if low.sum() < MIN_SHIRT_CELLS:
        return parse_hex(NEUTRAL_SHIRT)
    beyond = cKDTree(colours[hair.other & (UP_MM[:, None] > portrait.marks[CHIN, 1])])
    cloth = colours[low][beyond.query(colours[low])[0] > OFF_BACKGROUND]
    if len(cloth) < MIN_SHIRT_CELLS or np.median(np.abs(cloth[:, 0] - np.median(cloth[:, 0]))) > SHIRT_SPREAD:
        return parse_hex(NEUTRAL_SHIRT)
    light, *hue = np.median(cloth, axis=0)
    vivid = float(np.linalg.norm(hue))
    clean = np.array(hue) - cast * np.exp(-vivid)  # a clipped channel has no cast
    most = np.log(SHIRT_LIGHT[1]) - VIVID_SHADE * vivid
    return srgb_colour(np.array([np.clip(light, np.log(SHIRT_LIGHT[0]), most), *(SHIRT_HUE * clean)]))


def dress_head(face: Face, look: PersonLook) -> Face:
    """The head with iris, brows, shirt and hairdo of a look, and lashes of a length that suits everyone."""
    tints = {}
    for name, wanted in (("iris", look.iris), ("brows", look.brows), ("shirt", look.shirt)):
        n_times = sum(part.name == name and part.is_textured for part in face.parts)  # eyes share their texels
        factors = np.clip(wanted / np.maximum(part_colour(face, name), 1.0), *TINT_LIMITS) ** (1 / max(n_times, 1))
        tints[name] = (float(factors[0]), float(factors[1]), float(factors[2]))
    return replace(tint_parts(shorten_lashes(face, LASH_LENGTH), tints), hairdo=look.hairdo)


def shorten_lashes(face: Face, length: float) -> Face:
    """The face with lashes of a share of their length, at rest and in all shapes; sets that are not shown stay."""
    from scipy.spatial import cKDTree

    lashes, skin = part_vertices(face, ("lashes",)), part_vertices(face, ("skin",))
    off = cKDTree(face.vertices[skin]).query(face.vertices[lashes])[0]
    roots, rest = lashes[off < ROOT_MM], lashes[(off >= ROOT_MM) & (off < LASH_MM)]
    nearest = roots[cKDTree(face.vertices[roots]).query(face.vertices[rest])[1]]
    vertices, shapes = face.vertices.copy(), face.shapes.copy()
    vertices[rest] = vertices[nearest] + length * (vertices[rest] - vertices[nearest])
    shapes[:, rest] = shapes[:, nearest] + length * (shapes[:, rest] - shapes[:, nearest])
    return replace(face, vertices=vertices, shapes=shapes)


def part_colour(face: Face, name: str) -> FloatArray:
    """Mean colour (3,) of a part, sRGB 0..255: of the brighter half of its texels, or of its vertices."""
    part = next(part for part in face.parts if part.name == name)
    triangles = face.triangles[part.first : part.first + part.count].astype(np.int64)
    if not part.is_textured or part.cutout or face.uv is None:
        return np.asarray(face.colours[np.unique(triangles)].astype(np.float64).mean(axis=0))
    pixels = face.textures[part.texture].pixels
    texels = find_texels(face.uv.astype(np.float64), triangles, len(pixels))
    colours = pixels[texels.rows, texels.columns].astype(np.float64)
    light = colours.sum(axis=1)
    return np.asarray(colours[light > np.median(light)].mean(axis=0))


def parse_hex(digits: str) -> NDArray[np.uint8]:
    """8-bit sRGB (3,) of rrggbb."""
    return np.array([int(digits[at : at + 2], 16) for at in (0, 2, 4)], np.uint8)


def _hair_word(colour: str) -> str:
    found = log_colour(255.0 * parse_hair_colour(colour))
    return _nearest(found, HAIR_COLOURS).replace("-", " ")


def _nearest(colour: FloatArray, names: Mapping[str, str]) -> str:
    """The name whose colour, rrggbb, is nearest."""

    def distance(name: str) -> float:
        off = colour - log_colour(parse_hex(names[name]).astype(np.float64))
        return float(np.linalg.norm(off * (NAMING_LIGHT, 1.0, 1.0)))

    return min(names, key=distance)
