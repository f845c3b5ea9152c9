"""Pictures of shipped heads whose haircut, colours, glasses and hats are known, by number."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter

from corpus_tools.dense.glasses import MATERIAL, Glasses, wear_glasses
from corpus_tools.dense.mesh_fit import part_vertices
from corpus_tools.dense.person_look import parse_hex
from tts2face.models.face import Face, Texture
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import BALD, haircut_names
from tts2face.models.face_tint import _part_texel_levels
from tts2face.models.hair import Hair, attach_hair
from tts2face.models.hair_file import load_hair
from tts2face.models.light import Lamps
from tts2face.models.named_colours import EYE_COLOURS, HAIR_COLOURS
from tts2face.numeric.arrays import LUMINANCE, FloatArray, decode_srgb, encode_light, encode_srgb
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw

HEAD, LIT = "head", ("ada", "ben", "noor", "zuri", "mara", "tomas")
DRAWN = LIT[:4]
IDENTITIES = (None, "erik", "amara", "kofi", "mei", "leila", "ravi", "ingrid", "nia")
BOB, SHORT = ("bob", "bob with a fringe"), ("short", "flat")
# Names of hair that are right, by haircut, or by drawn face and haircut: what is seen from in front.
RIGHT: Mapping[str, tuple[str, ...]] = {
    "bald": ("bald", "stubble"), "stubble": ("bald", "stubble", "cropped"), "cropped": ("cropped", "stubble", "flat"),
    "short01": SHORT, "short02": SHORT, "short03": ("short", "short with a fringe"), "short04": (*SHORT, "cropped"),
    "curly01": ("curly", "afro"), "afro01": ("curly", "afro"), "bob01": BOB, "bob02": BOB,
    "braid01": (*BOB, "tied back"), "wavy02": ("wavy bob",), "long01": ("long",), "fringe01": ("long with a fringe",),
    "wavy01": ("long and wavy",), "curly02": ("long and curly", "long and wavy"), "ponytail01": ("tied back", *SHORT),
    "ada": BOB, "ada-bun": ("tied back",), "ada-long": ("long",), "ben": SHORT, "ben-parted": SHORT,
    "ben-curls": ("curly", "afro"), "noor": ("tied back",), "noor-bob": BOB,
    "noor-pixie": ("short", "short with a fringe"), "zuri": ("tied back",), "zuri-afro": ("afro",),
    "zuri-puff": ("tied back",), "mara": ("long", "bob"), "tomas": SHORT,
}  # fmt: skip
UNDER_HATS = ("bald", "cropped", "short01", "short04", "long01", "bob02")
FRAMES = ((20, 18, 18), (90, 60, 35), (130, 120, 110), (60, 20, 25))
DRAWN_IRIS = 2.2  # by which textures of drawn irises are lighter than they are seen
SHELL = (28, 72)  # rows and columns of a hat


class Seen(NamedTuple):
    """How a person is seen: turn of the head (3,), degrees, side of the picture, px, distance, of the usual."""

    turn: FloatArray
    side_px: int
    distance: float
    gains: FloatArray
    exposure: float
    slope: float
    background: str


@dataclass(frozen=True, slots=True, eq=False)
class KnownLook:
    """Face, identity and haircut, the colours of hair (None: the face's own) and eyes, glasses, hat, and the view."""

    number: int
    face: str
    identity: str | None
    haircut: str | None
    colour: str | None
    eyes: str
    has_glasses: bool
    frame: tuple[int, ...]
    hat: str | None
    seen: Seen

    @property
    def key(self) -> str:
        """Its row of `RIGHT`."""
        if self.face == HEAD:
            return str(self.haircut)
        return f"{self.face}-{self.haircut}" if self.haircut else self.face


def known_look(number: int) -> KnownLook:
    rng = np.random.default_rng([77, number])
    is_head = rng.random() < 0.56
    if is_head:
        face, identity = HEAD, IDENTITIES[rng.integers(len(IDENTITIES))]
        haircut: str | None = str(rng.choice([BALD, *haircut_names()]))
    else:
        face, identity = LIT[rng.integers(len(LIT))], None
        own = [None, *haircut_names(face)]
        haircut = own[rng.integers(len(own))]
    colour = str(rng.choice(list(HAIR_COLOURS))) if haircut != BALD else None
    if face == "zuri" and rng.random() < 0.5:
        colour = None
    eyes = str(rng.choice(list(EYE_COLOURS)))
    turn = np.array([rng.uniform(-8, 8), rng.uniform(-20, 20), rng.uniform(-6, 6)])
    has_glasses = face == "noor" or (is_head and rng.random() < 0.2)
    frame = tuple(int(level) for level in rng.choice(np.array(FRAMES)))
    hat = str(rng.choice(["beanie", "cap"])) if is_head and haircut in UNDER_HATS and rng.random() < 0.4 else None
    side, distance, warmth = int(rng.integers(300, 800)), float(rng.uniform(1.0, 1.5)), rng.normal(0, 0.16)
    gains = np.exp([0.6 * warmth, 0.0, -warmth]) if rng.random() < 0.6 else np.ones(3)
    exposure, slope = float(np.exp(rng.normal(0, 0.25))), float(rng.normal(0, 0.25))
    background = str(rng.choice(["plain", "grad", "blobs", "sharp"]))
    seen = Seen(turn, side // 2 * 2, distance, gains, exposure, slope, background)
    return KnownLook(number, face, identity, haircut, colour, eyes, has_glasses, frame, hat, seen)


def draw_look(look: KnownLook) -> Image.Image:
    """The picture of a look, as JPEG leaves it."""
    rng, seen = np.random.default_rng([78, look.number]), look.seen
    face, side = _person(look, rng), seen.side_px
    camera = f"0,0,{int(550 * seen.distance)}" if look.face == HEAD else "0,0"
    pose = np.array([*np.radians(seen.turn), 0, 0, 0], np.float32)
    picture = Picture(size=f"{side}x{side}", camera=camera, background="transparent")
    drawn = draw(face, np.zeros(len(face.shape_names), np.float32), pose, picture=picture)
    cover = drawn[..., 3:4] / 255.0
    wall = _wall(seen.background, rng, side)
    light = decode_srgb(drawn[..., :3] / 255.0) * cover + decode_srgb(wall / 255.0) * (1 - cover)
    across = np.linspace(-1, 1, side)[None, :, None]
    levels = encode_srgb(np.clip(light * np.exp(seen.slope * across) * seen.gains * seen.exposure, 0, 1)).astype(float)
    levels += rng.normal(0, rng.uniform(0, 4), levels.shape)
    held = io.BytesIO()
    Image.fromarray(np.clip(np.rint(levels), 0, 255).astype(np.uint8)).save(
        held, "JPEG", quality=int(rng.integers(70, 96))
    )
    return Image.open(held).convert("RGB")


def _person(look: KnownLook, rng: np.random.Generator) -> Face:
    face = load_face(look.face, look.identity, hair=look.haircut, hair_color=look.colour)
    if look.has_glasses and look.face == HEAD:
        half, turn = np.array([rng.uniform(21, 28), rng.uniform(16, 24)]), np.linspace(0, 2 * np.pi, 64, endpoint=False)
        rims = [eye.centre[:2] + half * np.column_stack([np.cos(turn), np.sin(turn)]) for eye in face.eyes]
        glasses = Glasses(np.array(rims), np.zeros((0, 2)), np.array(look.frame, float))
        face = wear_glasses(load_face(HEAD, look.identity, hair=BALD), glasses)
        if look.haircut != BALD:
            cards = load_hair(str(look.haircut))
            assert isinstance(cards, Hair)
            face = attach_hair(face, cards, str(look.colour))
    if look.hat:
        face = _wear_hat(face, look.hat, rng)
    return _with_eyes(face, look.eyes)


def _with_eyes(face: Face, name: str) -> Face:
    """The face with irises of a named colour, whose texels keep their relief."""
    wanted = decode_srgb(parse_hex(EYE_COLOURS[name]) / 255.0)
    wanted = wanted * (1.0 if isinstance(face.light, Lamps) else DRAWN_IRIS)
    pixels = [texture.pixels for texture in face.textures]
    irises = [part for part in face.parts if part.name == "iris" and part.is_textured]
    for number in {part.texture for part in irises}:
        own = decode_srgb(pixels[number] / 255.0)
        levels = [_part_texel_levels(face, part, own.shape) for part in irises if part.texture == number]
        share = np.max(levels, axis=0) / 255.0
        light = own @ LUMINANCE
        inside = light[share > 0.9]
        usual = inside[inside > np.median(inside)].mean()
        mixed = share[..., None] * wanted * np.minimum(light / usual, 2.5)[..., None] + (1 - share[..., None]) * own
        pixels[number] = np.rint(255 * encode_light(np.clip(mixed, 0, 1))).astype(np.uint8)
    changed = [Texture(own, old.alpha) for own, old in zip(pixels, face.textures, strict=True)]
    return replace(face, textures=tuple(changed))


def _wear_hat(face: Face, kind: str, rng: np.random.Generator) -> Face:
    """The face with a shell over the skull, with a peak if it is a cap."""
    skin, eye = face.vertices[part_vertices(face, ("skin",))], np.mean([one.centre for one in face.eyes], axis=0)
    skull = skin[skin[:, 1] > eye[1] + 40]
    middle = np.array([0, eye[1] + 45, np.ptp(skull[:, 2]) / 2 + skull[:, 2].min()])
    wide, deep = np.abs(skull[:, 0]).max() + 10, np.ptp(skull[:, 2]) / 2 + 10
    rows, columns = SHELL
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, columns, endpoint=False), np.linspace(-0.12, np.pi / 2, rows))
    reach = np.where(rise > 0, np.cos(np.maximum(rise, 0)) ** 0.8, 1.0)
    high = skin[:, 1].max() - middle[1] + 16
    points = [np.stack([wide * reach * np.sin(turn), high * np.sin(rise), deep * reach * np.cos(turn)], -1) + middle]
    at = np.arange(rows * columns).reshape(rows, columns)
    low, right = at[:-1], np.roll(at, -1, axis=1)
    triangles = [np.stack([low, right[:-1], right[1:]], -1), np.stack([low, right[1:], at[1:]], -1)]
    if kind == "cap":
        bow = np.linspace(-1.0, 1.0, 24)
        inner = middle + np.column_stack([wide * np.sin(bow), 0 * bow, deep * np.cos(bow)])
        points += [inner, inner * (0.95, 1, 1) + np.column_stack([0 * bow, 0 * bow - 14, 60 * np.cos(bow)])]
        edge = rows * columns + np.arange(23)
        for corners in ((0, 24, 25), (0, 25, 1), (0, 25, 24), (0, 1, 25)):
            triangles.append(edge[:, None] + corners)
    vertices, faces = (np.concatenate([some.reshape(-1, 3) for some in parts]) for parts in (points, triangles))
    return _with_part(face, vertices, faces, _cloth(kind, rng, len(vertices)))


def _cloth(kind: str, rng: np.random.Generator, n: int) -> FloatArray:
    """Colours (N, 3) of a hat; beanies have ribs and a hem."""
    colours = np.tile(rng.integers(20, 220, 3), (n, 1)).astype(float)
    if kind == "beanie":
        rows, columns = np.divmod(np.arange(n), SHELL[1])
        colours *= np.where(columns % 3 == 0, 0.88, 1.0)[:, None] * np.where(rows < 8, 0.85, 1.0)[:, None]
    return colours


def _with_part(face: Face, points: FloatArray, triangles: NDArray[np.int64], colours: FloatArray) -> Face:
    n, n_old = len(points), len(face.vertices)
    part = replace(MATERIAL, first=len(face.triangles), count=len(triangles), specular=0.05, shininess=5.0)
    return replace(
        face, vertices=np.concatenate([face.vertices, points.astype(np.float32)]),
        triangles=np.concatenate([face.triangles, (triangles + n_old).astype(np.int32)]), parts=(*face.parts, part),
        shapes=np.pad(face.shapes, ((0, 0), (0, n), (0, 0))),
        colours=np.concatenate([face.colours, np.rint(colours).astype(np.uint8)]),
        uv=None if face.uv is None else np.pad(face.uv, ((0, n), (0, 0))),
        tangents=None if face.tangents is None else np.pad(face.tangents, ((0, n), (0, 0))), occlusion=None,
    )  # fmt: skip


def _wall(kind: str, rng: np.random.Generator, side: int) -> FloatArray:
    """(S, S, 3) what is behind a person, sRGB 0..255."""
    above, below = rng.integers(20, 245, (2, 3)).astype(float)
    if kind == "plain":
        return np.broadcast_to(above, (side, side, 3))
    if kind == "grad":
        down = np.linspace(0, 1, side)[:, None, None]
        return np.repeat(above * (1 - down) + below * down, side, axis=1)
    noise = rng.normal(size=(side, side, 3))
    spread = max(side / (14 if kind == "blobs" else 60), 1)
    noise = np.stack([gaussian_filter(noise[..., channel], spread) for channel in range(3)], axis=-1)
    wall = above + noise / noise.std() * (35 if kind == "blobs" else 25)
    for _ in range(12 * (kind == "sharp")):
        x, y = rng.integers(0, side), rng.integers(0, side)
        wall[y : y + rng.integers(10, side // 2), x : x + rng.integers(5, side // 3)] = rng.integers(0, 255, 3)
    return np.asarray(np.clip(wall, 0, 255), np.float64)
