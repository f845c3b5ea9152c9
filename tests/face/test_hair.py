"""Haircuts: files, fit to a head, colours, and painted scalps."""

import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.picture.tiny_face import tiny_face
from tts2face.models.face import Face, Hairdo
from tts2face.models.face_file import Identity, read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.hair import Hair, attach_hair, fit_hair, seen_colour, strand_colour
from tts2face.models.hair_file import read_hair, write_hair
from tts2face.models.named_colours import HAIR_COLOURS, parse_hair_colour
from tts2face.picture.camera import camera_matrices
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.storage.tensors import read_tensors, write_tensors

GREEN = "#10c020"


def cap(face: Face) -> Hair:
    """Four cards 20 mm above the crown of the tiny face, carried by vertices all around it."""
    corners = np.array([[-40, 0, -40], [40, 0, -40], [40, 0, 40], [-40, 0, 40]], np.float32)
    vertices = np.concatenate([corners + np.float32([0, 95 + 2 * layer, 0]) for layer in range(4)])
    quads = np.arange(16).reshape(4, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    anchors = np.arange(0, 200, 7, dtype=np.int32)
    return Hair(
        vertices=vertices,
        triangles=triangles,
        uv=np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (4, 1)),
        tangents=np.tile(np.array([0, 0, 1], np.float32), (16, 1)),
        pictures=(
            np.full((8, 8), 128, np.uint8),
            np.repeat(np.array([[0], [255]], np.uint8), 4, axis=0) * np.ones((1, 8), np.uint8),
            np.full((4, 4), 255, np.uint8),
        ),
        anchors=anchors,
        anchor_places=face.vertices[anchors].copy(),
        n_face_vertices=len(face.vertices),
        metadata={"name": "cap", "summary": "four cards"},
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a face, whose hair is a cap in green, and the cap."""
    face = tiny_face(textured=True)
    write_hair(tmp_path / "cap.hair", cap(face))
    person = Identity(np.zeros((len(face.vertices), 3), np.float32), {}, "with the face's own hair")
    bald = replace(person, hairdo=Hairdo("bald", "black"))
    own = replace(face, hairdo=Hairdo(str(tmp_path / "cap.hair"), GREEN))
    write_face(tmp_path / "dressed.face", own, {"same": person, "smooth": bald})
    write_face(tmp_path / "plain.face", face)
    return tmp_path


def test_a_haircut_round_trips(tmp_path: Path) -> None:
    hair = cap(tiny_face())
    write_hair(tmp_path / "cap.hair", hair)
    read = read_hair(tmp_path / "cap.hair")
    for name in ("vertices", "triangles", "uv", "tangents", "alpha", "anchors", "anchor_places", "scalp"):
        assert np.array_equal(getattr(read, name), getattr(hair, name)), name
    assert np.abs(read.relief.astype(int) - hair.relief).max() <= 1
    assert (read.n_face_vertices, dict(read.metadata)) == (hair.n_face_vertices, dict(hair.metadata))


def test_a_face_is_loaded_with_its_hair_and_with_that_of_its_identity(folder: Path) -> None:
    name = str(folder / "dressed.face")
    n_bare = len(read_face(folder / "dressed.face").vertices)
    assert len(load_face(name).vertices) == n_bare + 16
    assert len(load_face(name, "same").vertices) == n_bare + 16
    assert len(load_face(name, "smooth").vertices) == len(load_face(name, hair="bald").vertices) == n_bare
    assert load_face(name, "smooth", hair=str(folder / "cap.hair")).parts[-1].name == "hair"


def test_hair_has_its_colour_and_the_scalp_below_it_too(folder: Path) -> None:
    face = load_face(str(folder / "dressed.face"))
    own = np.rint(255 * strand_colour(parse_hair_colour(GREEN)))
    for texture in (face.textures[face.parts[-1].texture], face.textures[0]):
        assert np.abs(texture.pixels - own).max() <= 3
    red = load_face(str(folder / "dressed.face"), hair_color="#c01010")
    assert np.abs(red.textures[0].pixels[0, 0] - 255 * strand_colour(np.array([0xC0, 0x10, 0x10]) / 255)).max() <= 3


def test_half_of_a_card_is_covered() -> None:
    bare = tiny_face(textured=True)
    half = replace(cap(bare), pictures=cap(bare).pictures[:2])
    heads = (
        bare,
        attach_hair(bare, half, GREEN),
        attach_hair(bare, replace(half, pictures=(half.relief, half.alpha | 255)), GREEN),
    )
    options = Picture(size="128x128", background="white", camera="0,60")
    pictures = [draw(face, np.zeros(len(face.shape_names)), picture=options).astype(int) for face in heads]
    skin, covered, cards = (picture[:, :, 1] - picture[:, :, ::2].max(axis=2) > 20 for picture in pictures)  # green
    assert not skin.any()
    assert 0.3 < covered.sum() / cards.sum() < 0.7


@pytest.mark.parametrize("seed", range(6))
def test_a_sliver_of_hair_stays_within_its_corners(seed: int) -> None:
    bare, rng = tiny_face(textured=True), np.random.default_rng(seed)
    begin, end = np.array([-30.0, 115.0, 0.0]), np.array([10.0, 115.0 + rng.normal(0, 1), 0.0])
    middle = begin + 0.5 * (end - begin) + [0.0, 10.0 ** rng.uniform(-3, 0), 0.0]
    sliver = replace(
        cap(bare),
        vertices=np.float32([begin, end, middle]),
        triangles=np.int32([[0, 1, 2]]),
        uv=np.float32([[0, 0], [1, 0], [1, 1]]),
        tangents=np.float32([[1, 0, 0]] * 3),
        pictures=(cap(bare).relief, np.full((8, 8), 255, np.uint8)),
    )
    options = Picture(size="256x256", background="white")
    seen, unseen = (
        attach_hair(bare, one, GREEN)
        for one in (sliver, replace(sliver, pictures=(sliver.relief, np.zeros((8, 8), np.uint8))))
    )
    hair, skin = (draw(face, np.zeros(len(face.shape_names)), picture=options).astype(int) for face in (seen, unseen))
    wall = (skin == 255).all(axis=2)
    columns = np.flatnonzero(((hair != skin).any(axis=2) & wall).any(axis=0))
    camera = camera_matrices(options.view, seen, (256, 256))
    places = sliver.vertices @ camera.view[:, :3].T + camera.view[:, 3]
    across = camera.lens[1] + camera.lens[0] * places[:, 0] / places[:, 2]
    assert len(columns) > 0
    assert across.min() - 2 <= columns.min() <= columns.max() <= across.max() + 2


def test_hair_moves_as_its_anchors_do() -> None:
    face = tiny_face()
    hair = cap(face)
    assert np.array_equal(fit_hair(face, hair), hair.vertices)
    wide = replace(face, vertices=face.vertices * np.float32([1.2, 1.0, 1.0]) + np.float32([0, 3, 0]))
    assert fit_hair(wide, hair) == pytest.approx(hair.vertices * [1.2, 1.0, 1.0] + [0, 3, 0], abs=0.01)


def test_hair_of_another_layout_is_refused() -> None:
    face = tiny_face()
    with pytest.raises(DataError, match=f"heads of 7 vertices, but the face has {len(face.vertices)}"):
        attach_hair(face, replace(cap(face), n_face_vertices=7), "black")


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"hair": "beehive"}, "there is no haircut 'beehive'; give bald"),
        ({"hair_color": "mauve"}, "there is no hair colour 'mauve'; give #rrggbb or one of black, dark-brown"),
        ({"hair": "bald", "hair_color": "#12345"}, "there is no hair colour '#12345'"),
    ],
)
def test_unknown_hair_is_refused(folder: Path, options: dict[str, str], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        load_face(str(folder / "dressed.face"), **options)


def test_a_picture_of_too_many_pixels_is_refused_before_it_is_decoded(tmp_path: Path) -> None:
    write_hair(tmp_path / "cap.hair", cap(tiny_face()))
    arrays, header = read_tensors(tmp_path / "cap.hair", "hair", 1)
    picture = bytearray(arrays["alpha"].tobytes())
    picture[16:24] = (20_000).to_bytes(4, "big") * 2  # width and height of a PNG
    picture[29:33] = zlib.crc32(picture[12:29]).to_bytes(4, "big")
    wrong = {**arrays, "alpha": np.frombuffer(bytes(picture), np.uint8)}
    write_tensors(tmp_path / "wrong.hair", "hair", 1, wrong, header)
    with pytest.raises(DataError, match=r"the texture of .*wrong\.hair is too large; at most 100 million"):
        read_hair(tmp_path / "wrong.hair")


def test_hair_for_a_face_without_haircuts_is_refused(folder: Path) -> None:
    assert load_face(str(folder / "plain.face"), hair="bald").hairdo is None
    with pytest.raises(InputError, match="no haircut fits the face"):
        load_face(str(folder / "plain.face"), hair=str(folder / "cap.hair"))


def test_every_named_colour_is_a_colour() -> None:
    assert all(parse_hair_colour(name).shape == (3,) for name in HAIR_COLOURS)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"anchors": np.array([0, 1, 2], np.int32)}, "has 3 anchors, which do not surround the head"),
        ({"triangles": np.array([[0, 1, 99]], np.int32)}, "triangles holds 99, beyond its 16 vertices"),
        ({"n_face_vertices": 5}, "anchors holds 196, beyond its 5 vertices of the head"),
    ],
)
def test_a_wrong_haircut_is_refused(tmp_path: Path, change: dict[str, object], reason: str) -> None:
    hair = cap(tiny_face())
    if "anchors" in change:
        change["anchor_places"] = hair.anchor_places[:3]
    write_hair(tmp_path / "wrong.hair", replace(hair, **change))
    with pytest.raises(DataError, match=reason):
        read_hair(tmp_path / "wrong.hair")


def test_strands_are_seen_in_the_colour_that_is_asked() -> None:
    asked = np.array([parse_hair_colour(name) for name in HAIR_COLOURS])
    for haircut in ("", "long01"):
        np.testing.assert_allclose(seen_colour(strand_colour(asked, haircut), haircut), asked, atol=0.01)
    assert (strand_colour(asked)[asked > 0.3] < asked[asked > 0.3]).all()
    assert (strand_colour(asked, "long01") > strand_colour(asked)).all()
