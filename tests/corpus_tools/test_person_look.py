"""What heads of people get from pictures: drawn people whose light, hair, eyes and clothes are known."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from cli.main import run
from corpus_tools.dense.hair_region import ACROSS_MM, CELL_MM, UP_MM, Portrait, find_hair, portrait_grid
from corpus_tools.dense.hairdo import HAIRCUTS, KNOT_MM, knot_depth, name_below_hat, name_hair
from corpus_tools.dense.hats import below_hat
from corpus_tools.dense.light_colour import (
    GLOSSY,
    IRISES,
    EyeColours,
    estimate_cast,
    log_colour,
    remove_cast,
    sample_eyes,
    skin_texture,
    srgb_colour,
    without_gloss,
)
from corpus_tools.dense.mesh_fit import face_landmarks, part_vertices
from corpus_tools.dense.person_look import (
    CHILD_BROWN,
    LASH_LENGTH,
    NEUTRAL_IRIS,
    LookSampler,
    PersonLook,
    dress_head,
    hair_colour,
    iris_colour,
    is_child,
    parse_hex,
    part_colour,
    shorten_lashes,
)
from corpus_tools.dense.skin_colour import PictureFitter
from tests.face.posing import posed_vertices
from tts2face.models.face import Face, Hairdo
from tts2face.models.face_file import read_face
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import BALD
from tts2face.models.landmarks import LID_RINGS, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.models.named_colours import EYE_COLOURS, HAIR_COLOURS, parse_eye_colour, parse_hair_colour
from tts2face.numeric.arrays import decode_srgb, encode_srgb
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import parse_camera
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.session.catalogue import identities
from tts2face.storage.shipped import find_file

CAMERA, SIDE_PX = "0,0,900", 448
FOREHEAD_MM = 8.0  # by which the tracker sees the top of the forehead above the drawn people's own landmark
SKINS = ((232, 190, 172), (198, 134, 102), (141, 85, 60), (84, 52, 39))  # light to dark, in neutral light
SKIN = np.array(SKINS[1], np.float64)
WHITE = (188, 182, 176)
NO_COLOUR = np.full(3, np.nan)
SHORT, LONG = ("bald", "cropped", "flat", "short"), ("bob", "long")
WORN = {"erik": ("short02", "dark-blond"), "mei": ("bob02", "blond"), "kofi": ("cropped", "black")}
WARM, COLD = (1.25, 1.0, 0.6), (0.9, 1.0, 1.35)


@pytest.fixture(scope="module")
def head() -> Face:
    return read_face(find_file("head", "face"))


@cache
def drawn_person(identity: str | None, hair: str | None, colour: str | None) -> tuple[Face, np.ndarray]:
    """A person with hair, and a picture of it in neutral light."""
    person = load_face("head", identity, hair=hair, hair_color=colour)
    picture = Picture(size=f"{SIDE_PX}x{SIDE_PX}", camera=CAMERA)
    return person, draw(person, np.zeros(len(person.shape_names)), picture=picture)


@cache
def seen_look(
    identity: str | None, hair: str | None, colour: str | None, gains: tuple[float, ...] = (1, 1, 1), size: int = 1
) -> PersonLook:
    """Look of a drawn person in one picture, in light that multiplies its channels, at a `size`-th of its size."""
    person, picture = drawn_person(identity, hair, colour)
    bare = load_face("head", identity, hair=BALD)
    lit = encode_srgb(decode_srgb(picture / 255.0) * gains)
    lens = camera_matrices(parse_camera(CAMERA), person, (SIDE_PX, SIDE_PX))
    marks = face_landmarks(bare, bare.vertices.astype(np.float64))[:N_LANDMARKS]
    marks[10, 1] += FOREHEAD_MM
    across, down, ahead = (marks @ lens.view[:, :3].T + lens.view[:, 3]).T
    scale = lens.lens[0] / ahead
    points = np.column_stack([across * scale + lens.lens[1], down * scale + lens.lens[2], ahead * scale.mean()])
    used = np.arange(N_MESH_LANDMARKS)
    sampler = LookSampler(PictureFitter(used, bare.vertices.astype(np.float64), marks[used], used, np.zeros((1, 1))))
    sampler.add(lit[::size, ::size].copy(), (points / size).astype(np.float32))
    return sampler.look()


def test_colours_return_from_their_logarithms() -> None:
    colours = np.array([*SKINS, WHITE, (20, 16, 14), (250, 40, 70)], np.float64)
    np.testing.assert_allclose(srgb_colour(log_colour(colours)), colours, atol=1)


@pytest.mark.parametrize("skin", SKINS)
def test_a_cast_is_found_on_every_tone_of_skin(skin: tuple[int, ...]) -> None:
    gains = np.array([1.15, 1.0, 0.55])
    lit = [255.0 * _encoded(decode_srgb(np.array(colour) / 255.0) * gains) for colour in (skin, WHITE)]
    eyes = EyeColours(log_colour(lit[0]), log_colour(lit[1]), NO_COLOUR, 8.0)
    cast = estimate_cast(eyes)
    np.testing.assert_allclose(cast, np.log(gains[[0, 2]]), atol=0.25)
    before, after = log_colour(lit[0]), log_colour(remove_cast(lit[0], cast, eyes.skin))
    assert after[0] == pytest.approx(before[0], abs=0.01)  # as light or dark as it was
    np.testing.assert_allclose(after[1:], log_colour(np.array(skin, np.float64))[1:], atol=0.25)


@pytest.mark.parametrize("skin", SKINS)
def test_neutral_light_is_left_as_it_is(skin: tuple[int, ...]) -> None:
    colours = [log_colour(np.array(colour, np.float64)) for colour in (skin, WHITE)]
    np.testing.assert_allclose(estimate_cast(EyeColours(*colours, NO_COLOUR, 8.0)), 0.0, atol=0.08)


def test_red_eyes_alone_are_no_red_light() -> None:
    skin, white = (log_colour(np.array(colour, np.float64)) for colour in (SKINS[1], WHITE))
    red = EyeColours(skin, white + np.array([0.0, 0.6, -0.2]), NO_COLOUR, 8.0)
    assert np.abs(estimate_cast(red)).max() < 0.08


def test_without_white_of_the_eye_half_of_the_skins_cast_is_corrected() -> None:
    skin = log_colour(np.array(SKINS[1], np.float64)) + np.array([0.0, 0.0, -0.8])
    alone = estimate_cast(EyeColours(skin, NO_COLOUR, NO_COLOUR, 2.0))
    assert -0.45 < alone[1] < -0.3


def _encoded(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def painted_portrait(
    head: Face, wall: tuple[int, ...], hair: tuple[int, ...], lowest_mm: float, top_mm: float
) -> Portrait:
    """A face of plain skin before a wall, with hair to a height beside it and above the forehead."""
    marks = face_landmarks(head, head.vertices.astype(np.float64))[:N_MESH_LANDMARKS]
    across, up = np.meshgrid(ACROSS_MM, UP_MM)
    picture = np.tile(np.array(wall, np.float64), (*across.shape, 1))
    forehead, chin = marks[10, 1], marks[152, 1]
    skull = (across / 78) ** 2 + ((up - forehead + 60) / (60 + top_mm)) ** 2 < 1
    beside = (np.abs(across) < 95) & (up > chin - lowest_mm) & (up < forehead)
    if top_mm:
        picture[skull & (up > chin - lowest_mm) | beside] = hair
    face = (across / 66) ** 2 + ((up + 20) / 92) ** 2 < 1
    picture[face & (up < forehead + 6) | (np.abs(across) < 40) & (up < chin + 20)] = SKINS[1]
    if not top_mm:
        picture[(across / 66) ** 2 + ((up + 20) / 132) ** 2 < 1] = SKINS[1]
    return Portrait(picture + np.random.default_rng(0).normal(0, 2, picture.shape), marks)


def name_of(portrait: Portrait) -> str:
    return name_hair(portrait, find_hair(portrait, log_colour(SKIN)), log_colour(SKIN))


@pytest.mark.parametrize(
    ("lowest_mm", "top_mm", "lengths"),
    [(-95.0, 0.0, ("bald",)), (-95.0, 75.0, ("short",)), (-20.0, 75.0, ("bob",)), (45.0, 75.0, ("long",))],
)
def test_hair_is_measured_to_where_it_ends(
    head: Face, lowest_mm: float, top_mm: float, lengths: tuple[str, ...]
) -> None:
    portrait, skin = painted_portrait(head, (70, 120, 170), (60, 42, 30), lowest_mm, top_mm), log_colour(SKIN)
    found = find_hair(portrait, skin)
    assert name_hair(portrait, found, skin) in lengths
    if top_mm:
        np.testing.assert_allclose(srgb_colour(found.colour), (60, 42, 30), atol=3)


def test_hair_that_is_like_the_wall_on_one_side_is_measured_on_the_other(head: Face) -> None:
    portrait = painted_portrait(head, (70, 120, 170), (60, 42, 30), 45.0, 75.0)
    one_sided = portrait.srgb.copy()
    one_sided[:, ACROSS_MM < -34] = (70, 120, 170)
    assert name_of(replace(portrait, srgb=one_sided)) == "long"


def test_a_wall_in_the_colour_of_the_hair_is_no_long_hair(head: Face) -> None:
    portrait = painted_portrait(head, (58, 43, 33), (60, 42, 30), -95.0, 75.0)
    assert name_of(portrait) in SHORT


@pytest.mark.parametrize(("above_mm", "names"), [(8.0, SHORT), (-60.0, ("",))])
def test_hair_of_a_head_cut_by_the_pictures_edge_is_that_beside_it(
    head: Face, above_mm: float, names: tuple[str, ...]
) -> None:
    portrait = painted_portrait(head, (70, 120, 170), (60, 42, 30), -95.0, 75.0)
    cut = portrait.srgb.copy()
    cut[portrait.marks[10, 1] + above_mm < UP_MM] = np.nan
    assert name_of(replace(portrait, srgb=cut)) in names


@pytest.mark.parametrize("is_smooth", [True, False])
def test_a_hat_is_smooth_and_not_of_a_natural_colour(head: Face, *, is_smooth: bool) -> None:
    """Green hair in which strands are seen is dyed; of a green hat the hair below it has the colour."""
    portrait = painted_portrait(head, (70, 120, 170), (60, 42, 30), -95.0, 75.0)
    above = portrait.marks[10, 1] - 3 < UP_MM
    green, size = np.array((30.0, 140.0, 60.0)), (2 * len(UP_MM) - 1, 2 * len(ACROSS_MM) - 1)
    region = find_hair(portrait, log_colour(SKIN)).region
    srgb = np.where((region & above[:, None])[..., None], green, portrait.srgb)
    strands = gaussian_filter(np.random.default_rng(3).normal(size=size), (8.0, 0.8))
    fine = np.repeat((90 + (0.5 if is_smooth else 14) * strands / strands.std())[..., None], 3, axis=2)
    hatted = replace(portrait, srgb=srgb, fine=fine)
    found = below_hat(hatted, replace(find_hair(portrait, log_colour(SKIN)), region=region), np.zeros(2))
    assert (found is not None) == is_smooth
    if found is not None:
        np.testing.assert_allclose(srgb_colour(found.colour), (60, 42, 30), atol=3)
        assert name_below_hat(hatted, found) in HAIRCUTS


def test_a_drawn_iris_is_read_off_pupil_white_and_catchlight() -> None:
    """An eye as drawn people have it: a wide pupil, a coloured ring around it, a large catchlight."""
    size, middle, radius = 240, np.array([(70.0, 60.0), (170.0, 60.0)]), 12.0
    rows, columns = np.mgrid[:120, :size].astype(float)
    picture = np.full((120, size, 3), SKIN)
    points = np.zeros((478, 3))
    points[:, :2] = (120.0, 100.0)
    for (x, y), (centre, rim), lids in zip(middle, IRISES, LID_RINGS, strict=True):
        off = np.hypot(columns - x, rows - y)
        is_open = np.hypot((columns - x) / 28, (rows - y) / 26) < 1
        for colour, inside in (((235, 232, 228), is_open), ((70, 105, 140), off < 22), ((5, 5, 5), off < radius)):
            picture[is_open & inside] = colour
        picture[np.hypot(columns - x + 9, rows - y + 8) < 5] = 250
        points[centre, :2] = (x, y)
        points[list(rim), :2] = (x, y) + radius * np.array([(1, 0), (0, -1), (-1, 0), (0, 1)])
        turn = np.linspace(0, 2 * np.pi, len(lids), endpoint=False)
        points[list(lids), :2] = np.array((x, y)) + np.column_stack([28 * np.cos(turn), 26 * np.sin(turn)])
    eyes = sample_eyes(np.rint(picture).astype(np.uint8), points)
    assert eyes.is_drawn
    np.testing.assert_allclose(srgb_colour(eyes.iris), (70, 105, 140), atol=6)


def test_hollows_beside_a_bun_are_seen(head: Face) -> None:
    portrait = painted_portrait(head, (70, 120, 170), (60, 42, 30), 45.0, 55.0)
    across, up = np.meshgrid(ACROSS_MM, UP_MM - portrait.marks[10, 1])
    plain = np.hypot(across / 80, (up + 15) / 75) < 1
    bun = np.hypot(across, up - 75) < 26
    assert knot_depth(portrait, plain) < KNOT_MM / 2
    assert knot_depth(portrait, plain | bun) > KNOT_MM
    cut = portrait.srgb.copy()
    cut[up > 40] = np.nan
    assert knot_depth(replace(portrait, srgb=cut), plain | bun) < KNOT_MM / 2


@pytest.mark.parametrize("name", HAIR_COLOURS)
def test_natural_hair_keeps_its_hue(name: str) -> None:
    colour = log_colour(255.0 * parse_hair_colour(name))
    np.testing.assert_allclose(hair_colour(colour)[1:], colour[1:], atol=0.3)


def test_olive_hair_becomes_grey_and_blue_hair_stays_blue() -> None:
    olive, blue = (log_colour(np.array(colour, float)) for colour in ((120, 124, 96), (40, 60, 160)))
    assert 0.0 < hair_colour(olive)[1] < 0.35
    np.testing.assert_allclose(hair_colour(blue)[1:], blue[1:], atol=1e-9)


@pytest.mark.build
def test_children_are_told_by_their_proportions() -> None:
    path = find_file("head", "face")
    children = [
        entry for entry in (None, *(one.name for one in identities())) if is_child(_marks(read_face(path, entry)))
    ]
    assert children == ["nia"]


@pytest.mark.build
def test_drawn_people_are_children_from_larger_eyes_on() -> None:
    """Drawn adults have the proportions of children."""
    marks = _marks(read_face(find_file("head", "face"), "nia"))
    assert not is_child(marks, is_drawn=True)
    lower = np.where(np.isin(np.arange(len(marks)), (33, 263))[:, None], (1.2, 1.0, 1.0), 1.0)
    assert is_child(marks * lower, is_drawn=True)


def _marks(face: Face) -> np.ndarray:
    return face_landmarks(face, face.vertices.astype(np.float64))[:N_MESH_LANDMARKS]


def test_a_childs_hair_is_not_grey() -> None:
    seen = log_colour(np.array((150, 146, 140), float))
    assert hair_colour(seen)[1] < 0.1
    child = hair_colour(seen, least_brown=CHILD_BROWN)
    assert child[1] > 0.4
    assert child[2] < -0.3


def test_skin_under_a_fringe_is_known(head: Face) -> None:
    """Places of a head turned in the picture, whose hair lies above the brows."""
    used, marks = np.arange(N_MESH_LANDMARKS), _marks(head)
    sampler = LookSampler(PictureFitter(used, head.vertices.astype(np.float64), marks, used, np.zeros((1, 1))))
    turn = Rotation.from_euler("y", 12, degrees=True).as_matrix()
    sampler.slant = np.linalg.solve(turn[:2, :2], turn[:2, 2])
    depth = portrait_grid(marks)[0, 2]
    across, up = np.meshgrid(ACROSS_MM, UP_MM)
    sampler.hair = (up > 40) & (np.abs(across) < 60)
    places = np.array([(x, y, depth) for x in (-30.0, 30.0) for y in (10.0, 60.0)])
    assert sampler.under_hair(places).tolist() == [False, True, False, True]
    ahead = np.array([[58.0, 60.0, depth + 60.0]])
    assert sampler.under_hair(ahead).tolist() == [bool(abs(58 + 60 * sampler.slant[0]) < 60 + 3 * CELL_MM)]
    sampler.hair = sampler.hair & False
    assert not sampler.under_hair(places).any()


def test_green_and_hazel_eyes_are_not_brown() -> None:
    skin, white = log_colour(SKIN), log_colour(np.array(WHITE, float))
    for name in ("green", "hazel", "grey", "blue", "brown"):
        eyes = EyeColours(skin, white, log_colour(255.0 * parse_eye_colour(name)), 12.0)
        found = iris_colour(eyes, np.zeros(2))
        known = {other: log_colour(255.0 * parse_eye_colour(other))[1:] for other in EYE_COLOURS}
        off = {other: float(np.linalg.norm(found[1:] - hue)) for other, hue in known.items()}
        assert min(off, key=off.__getitem__).removeprefix("dark-") == name


@pytest.mark.parametrize("is_curly", [False, True])
def test_curls_are_told_from_straight_hair(head: Face, is_curly: bool) -> None:
    """Strands fall straight, or turn to all sides within a few millimetres."""
    portrait = painted_portrait(head, (70, 120, 170), (60, 42, 30), 45.0, 75.0)
    size = (2 * len(UP_MM) - 1, 2 * len(ACROSS_MM) - 1)
    noise = np.random.default_rng(2).normal(size=size)
    strands = gaussian_filter(noise, 1.5 if is_curly else (12.0, 0.8))
    fine = np.repeat((50 + 14 * strands / strands.std())[..., None], 3, axis=2).clip(0, 255)
    found = name_hair(replace(portrait, fine=fine), find_hair(portrait, log_colour(SKIN)), log_colour(SKIN))
    assert found == ("long and curly" if is_curly else "long")


@pytest.mark.parametrize(
    ("identity", "hair", "colour", "lengths", "names"),
    [
        (None, "long01", "brown", ("long",), ("brown", "dark-brown")),
        ("erik", "short02", "dark-blond", ("short",), ("dark-blond", "light-brown")),
        ("mei", "bob02", "blond", ("bob",), ("blond",)),
        ("kofi", "bald", None, ("bald",), ()),
        ("nia", "bald", None, ("bald",), ()),
        pytest.param("kofi", "cropped", "black", ("cropped", "flat"), ("black", "dark-brown"), marks=pytest.mark.smoke),
        ("ravi", "short01", "black", ("flat", "short"), ("black",)),
        ("ingrid", "bob02", "white", ("bob",), ("white", "grey")),
    ],
)
def test_drawn_peoples_hair_is_found(
    identity: str | None, hair: str, colour: str | None, lengths: tuple[str, ...], names: tuple[str, ...]
) -> None:
    look = seen_look(identity, hair, colour)
    assert look.length in lengths
    if names:
        found = log_colour(255.0 * parse_hair_colour(look.hairdo.colour))
        off = {name: np.linalg.norm(found - log_colour(255.0 * parse_hair_colour(name))) for name in HAIR_COLOURS}
        assert min(off, key=off.__getitem__) in names


@pytest.mark.build
@pytest.mark.parametrize(
    ("identity", "gains", "is_told"),
    [
        *((name, gains, True) for name in ("erik", "mei") for gains in (WARM, COLD)),
        ("kofi", WARM, True),
        (
            "kofi",
            COLD,
            False,
        ),  # the white of his eyes is brown beyond its spread: it does not agree, and nothing is done
    ],
)
def test_a_coloured_light_is_told_from_drawn_people(
    identity: str, gains: tuple[float, float, float], is_told: bool
) -> None:
    plain, lit = seen_look(identity, *WORN[identity]), seen_look(identity, *WORN[identity], gains)
    wanted = np.log(gains[2])
    if is_told:
        assert lit.cast[1] - plain.cast[1] == pytest.approx(wanted, abs=0.2)
        assert np.sign(lit.cast[1]) == np.sign(wanted)
    else:
        assert lit.cast[1] == 0.0
    assert lit.length == plain.length


def test_blue_eyes_are_blue_and_dark_eyes_brown() -> None:
    blue, dark = (seen_look(name, *WORN[name]).iris.astype(int) for name in ("erik", "kofi"))
    assert blue[2] > blue[0] + 8
    assert dark[0] > dark[2]
    assert blue.sum() > 2 * dark.sum()


def test_small_eyes_are_brown_and_said_to_be_unseen() -> None:
    look = seen_look("erik", *WORN["erik"], size=3)
    np.testing.assert_array_equal(look.iris, parse_hex(NEUTRAL_IRIS))
    assert look.summary().endswith("eyes too small to tell their colour")
    assert look.length == "short"


def test_a_head_is_drawn_as_the_person_looks(head: Face) -> None:
    look = replace(seen_look("ravi", "short01", "black"), iris=parse_hex("58402f"), shirt=parse_hex("6a6b6d"))
    dressed = dress_head(head, look)
    assert dressed.hairdo == look.hairdo == Hairdo("short01", look.hairdo.colour)
    np.testing.assert_allclose(part_colour(dressed, "iris"), look.iris, atol=3)
    np.testing.assert_allclose(part_colour(dressed, "shirt"), look.shirt, atol=2)
    np.testing.assert_array_equal(dressed.textures[0].pixels, head.textures[0].pixels)
    assert "hair: flat, black; eyes: brown; light: " in look.summary()


def test_lashes_become_shorter_and_still_follow_the_lids(head: Face) -> None:
    short, lashes = shorten_lashes(head, LASH_LENGTH), part_vertices(head, ("lashes",))
    moved = np.linalg.norm(short.vertices - head.vertices, axis=1)
    assert moved[lashes].max() > 2.0
    assert moved[np.setdiff1d(np.arange(len(moved)), lashes)].max() == 0
    shut = np.array([float(name.startswith("eyeBlink")) for name in head.shape_names], np.float32)
    lids = posed_vertices(head, shut)[part_vertices(head, ("skin",))]
    shown = lashes[head.vertices[lashes, 2] > -20]
    off = [_distances(posed_vertices(face, shut)[shown], lids) for face in (head, short)]
    assert np.percentile(off[1], 95) < LASH_LENGTH * np.percentile(off[0], 95) + 0.5


def _distances(places: np.ndarray, others: np.ndarray) -> np.ndarray:
    return np.array([np.linalg.norm(others - place, axis=1).min() for place in places])


def test_gloss_goes_and_wrinkles_stay() -> None:
    skin = np.array([0.42, 0.22, 0.14])
    shade = np.array([0.3, 0.7, 1.0, 1.05])[:, None]
    np.testing.assert_array_equal(without_gloss(shade * skin, skin), shade * skin)  # wrinkles and shadows
    lit = np.array([[1.6], [2.0]]) * skin
    np.testing.assert_allclose(without_gloss(lit + 0.15, skin), lit, atol=1e-12)  # what lies under gloss
    np.testing.assert_allclose(
        without_gloss(np.ones((1, 3)), skin)[0], GLOSSY[0] * skin, atol=1e-12
    )  # nothing is known


def test_gloss_on_lips_keeps_their_colour() -> None:
    """A white spot on red places among skin becomes red; the mean around it is that of the red places."""
    skin, red = np.array([200.0, 150.0, 120.0]), np.array([170.0, 80.0, 80.0])
    colours = np.vstack([np.tile(skin, (60, 1)), np.tile(red, (20, 1)), [[255.0, 240.0, 240.0]]])
    is_lip = np.arange(len(colours)) >= 60

    def around(values: np.ndarray) -> np.ndarray:
        return np.where(is_lip[:, None], values[is_lip].mean(axis=0), values[~is_lip].mean(axis=0))

    found = skin_texture(colours, around)
    np.testing.assert_allclose(found[-1] / found[-1, 0], found[70] / found[70, 0], atol=0.05)  # the hue
    assert 1.0 < found[-1, 0] / found[70, 0] < 1.15
    assert np.abs(found[-1] - found[0]).max() > 30


def test_the_command_offers_the_eye_colours_and_refuses_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["face", "photo", "--help"]) == 0
    shown = " ".join(re.sub("[^a-z-]", " ", capsys.readouterr().out).split())
    assert " ".join(EYE_COLOURS) in shown
    Image.new("RGB", (64, 64)).save(tmp_path / "me.png")
    words = ["face", "photo", str(tmp_path / "me.png"), "--out", str(tmp_path / "me.face"), "--consent", "nobody"]
    assert run([*words, "--eye-color", "pink"]) == 2
    assert "there is no eye colour 'pink'; give #rrggbb or one of dark-brown" in capsys.readouterr().err
