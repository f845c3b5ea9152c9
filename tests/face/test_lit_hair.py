"""Haircuts of faces with baked light: files, wearing, and any colour."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.face.test_hair import cap
from tests.picture.film.lit_face import lit_tiny_face
from tests.picture.tiny_face import tiny_face
from tts2face.models.baked_light import BakedLight, HairLight, HairTint
from tts2face.models.face import Face, Hairdo
from tts2face.models.face_file import read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.hair_file import read_hair, write_hair, write_lit_hair
from tts2face.models.hair_tint import tint_hair
from tts2face.models.light import Baked
from tts2face.models.lit_hair import LitHair, swing_shapes, wear_hair
from tts2face.models.named_colours import parse_hair_colour
from tts2face.models.view_transform import table_levels
from tts2face.numeric.arrays import decode_srgb, encode_srgb
from tts2face.storage.deflated import deflate, unpack_arrays
from tts2face.storage.tensors import read_tensors, write_tensors

OWN, BLACK, LIGHT = (0.3, 0.2, 0.1), (0.1, 0.08, 0.06), (0.7, 0.65, 0.6)
SHINE = 0.05  # linear light of gloss, whatever the colour
N_OWN = 3  # vertices of the face's own hair


def page_of(colour, side: int) -> np.ndarray:
    """(side / 2, side, 3) hair in a colour, as displayed."""
    return np.tile(np.array(colour) * 255, (side // 2, side, 1)).astype(np.uint8)


def tint(n_vertices: int, side: int) -> HairTint:
    known = np.array([OWN, BLACK, LIGHT], np.float32)
    vertices = np.tile(np.rint(known[1:, None] * 255), (1, n_vertices, 1)).astype(np.uint8)
    return HairTint(known, np.stack([page_of(one, side // 2) for one in (BLACK, LIGHT)]), vertices)


def haired_face() -> Face:
    """The tiny lit face with a triangle of hair, its last part, in brown."""
    bare = lit_tiny_face()
    light, n = bare.light.baked, len(bare.vertices)
    crown = np.array([[-20, 90, 0], [20, 90, 0], [0, 90, 30]], np.float32)
    corners = np.array([[n, n + 1, n + 2]], np.int32)
    part = replace(bare.parts[0], name="hair", first=len(bare.triangles), count=1, texture=-1)
    pages = light.pages.copy()
    pages[1, : pages.shape[1] // 2] = page_of(OWN, pages.shape[1])
    return replace(
        bare,
        vertices=np.concatenate([bare.vertices, crown]),
        triangles=np.concatenate([bare.triangles, corners]),
        parts=(*bare.parts, part),
        shapes=np.pad(bare.shapes, ((0, 0), (0, N_OWN), (0, 0))),
        colours=np.concatenate([bare.colours, np.tile(np.rint(np.array(OWN) * 255).astype(np.uint8), (N_OWN, 1))]),
        uv=np.concatenate([bare.uv, np.zeros((N_OWN, 2), np.float32)]),
        hairdo=Hairdo("fringe", "#4c3319"),
        light=Baked(
            replace(
                light,
                page_of={**light.page_of, "hair": 1},
                triangles=np.append(light.triangles, np.int32(len(bare.triangles))),
                is_inside=np.append(light.is_inside, False),
                pages=pages,
                tint=tint(N_OWN, pages.shape[1]),
            )
        ),
        metadata={"name": "tiny"},
    )


def wig_of(face: Face) -> LitHair:
    """Two triangles higher up, loose at one corner, whose skin is lit in red."""
    light, own = face.light.baked, face.parts[-1]
    vertices = np.array([[-30, 110, 0], [30, 110, 0], [0, 110, 40], [0, 150, 0]], np.float32)
    first = len(face.triangles) - own.count
    drawn = np.append(light.triangles, np.int32(first + 1))
    worn = HairLight(
        pages=np.stack([np.full_like(light.pages[0], (90, 20, 10)), light.pages[1]]),
        triangles=drawn,
        is_inside=np.zeros(len(drawn), bool),
        base=light.base + np.uint8(3),
        turns_deg=light.turns_deg,
        turn_weights=light.turn_weights,
        turn_modes=light.turn_modes,
        camera_yaws_deg=light.camera_yaws_deg,
        camera_modes=light.camera_modes,
        camera_sizes=light.camera_sizes,
        tint=tint(len(vertices), light.pages.shape[1]),
    )
    return LitHair(
        face="tiny",
        n_face_vertices=len(face.vertices) - N_OWN,
        n_face_triangles=first,
        vertices=vertices,
        triangles=np.array([[0, 1, 2], [1, 3, 2]], np.int32),
        uv=np.full((4, 2), 0.25, np.float32),
        tangents=np.tile(np.array([0, 1, 0], np.float32), (4, 1)),
        colours=np.tile(np.rint(np.array(OWN) * 255).astype(np.uint8), (4, 1)),
        loose=np.array([0, 0, 0, 255], np.uint8),
        middle=np.array([0, 100, 0], np.float32),
        shapes={face.shape_names[0]: np.full((4, 3), 2.0, np.float32)},
        skins=(np.full((8, 8, 3), 77, np.uint8),),
        lights=(worn,),
        metadata={"name": "wig", "summary": "two triangles"},
    )


@pytest.fixture(scope="module")
def face() -> Face:
    return haired_face()


@pytest.fixture(scope="module")
def wig(face: Face) -> LitHair:
    return wig_of(face)


def test_a_haircut_takes_the_place_of_the_own_hair(face: Face, wig: LitHair) -> None:
    worn = wear_hair(face, wig)
    n = wig.n_face_vertices
    assert np.array_equal(worn.vertices, np.concatenate([face.vertices[:n], wig.vertices]))
    assert np.array_equal(worn.triangles[wig.n_face_triangles :], wig.triangles + n)
    assert (worn.parts[:-1], worn.parts[-1].count, worn.parts[-1].name) == (face.parts[:-1], 2, "hair")
    assert worn.hairdo == Hairdo("wig", "#4c3319")
    assert (worn.shapes[0, n:] == 2).all()
    assert not worn.shapes[1:, n:].any()  # the face has no shape by which hair swings
    assert (worn.textures[0].pixels == 77).all()
    assert worn.textures[1:] == face.textures[1:]
    light = worn.light.baked
    assert (light.pages[0] == (90, 20, 10)).all()
    assert (light.base == face.light.baked.base + 3).all()
    assert light.responses is face.light.baked.responses


def test_loose_hair_lags_about_the_middle_of_the_head(wig: LitHair) -> None:
    moved = swing_shapes(wig.vertices, wig.loose / np.float32(255), wig.middle)
    assert list(moved) == ["hairPitch", "hairYaw", "hairRoll"]
    assert not np.any([shape[:3] for shape in moved.values()])
    assert moved["hairPitch"][3].tolist() == [0, 0, 50]  # 50 mm above, it goes ahead
    assert moved["hairRoll"][3].tolist() == [-50, 0, 0]


def test_skin_adds_its_own_gloss_from_cameras_to_what_a_haircut_changes_of_it(face: Face, wig: LitHair) -> None:
    light = face.light.baked
    n = light.camera_modes.shape[2]
    both = np.concatenate([np.full_like(light.camera_modes, 40), light.camera_modes], axis=2)
    lit = replace(light, camera_modes=both, camera_sizes=np.array([0.5], np.float32))
    shadow = np.zeros_like(both)
    shadow[:, :, 7], shadow[:, :, n:] = -60, 9
    new = lit.with_hair(replace(wig.lights[0], camera_modes=shadow, camera_sizes=np.array([0.25], np.float32)))
    assert new.camera_modes.shape == both.shape
    assert (new.camera_modes[:, :, :7] == 80).all()  # 20 of 255, in its steps
    assert (new.camera_modes[:, :, 7] == 20).all()
    assert (new.camera_modes[:, :, n:] == 9).all()


def test_a_haircut_of_another_face_is_refused(face: Face, wig: LitHair) -> None:
    for one in (replace(wig, n_face_triangles=wig.n_face_triangles - 1), replace(wig, n_face_vertices=7)):
        with pytest.raises(DataError, match="the haircut wig is one of the face tiny; choose that face"):
            wear_hair(face, one)
    with pytest.raises(DataError, match="one of the face tiny"):
        wear_hair(tiny_face(textured=True), wig)
    other = replace(wig, lights=(replace(wig.lights[0], base=wig.lights[0].base[1:]),))
    with pytest.raises(DataError, match="the haircut wig is of another build of tiny"):
        _ = wear_hair(face, other).light.baked


def shown(face: Face) -> np.ndarray:
    """(3,) colour, 0..1, of the hair on the second page."""
    return face.light.baked.pages[1, 3, 3] / 255


@pytest.mark.parametrize("colour", [BLACK, LIGHT])
def test_hair_in_a_known_colour_is_as_it_was_baked(colour, face: Face) -> None:
    name = "#" + "".join(f"{round(255 * share):02x}" for share in colour)
    tinted = tint_hair(face, name)
    assert shown(tinted) == pytest.approx(np.array(colour), abs=0.012)
    assert tinted.colours[-1] / 255 == pytest.approx(np.array(colour), abs=0.003)
    assert np.array_equal(tinted.colours[:-N_OWN], face.colours[:-N_OWN])
    assert tinted.hairdo == Hairdo("fringe", name)
    rest = face.light.baked.pages.shape[1] // 2
    assert np.array_equal(tinted.light.baked.pages[1, rest:], face.light.baked.pages[1, rest:])
    assert np.array_equal(tinted.light.baked.pages[0], face.light.baked.pages[0])


def test_hair_between_known_colours_lies_between_them_in_each_channel(face: Face) -> None:
    tinted = tint_hair(face, "#801e0f")  # redder than its own, but as dark
    red, green, blue = shown(tinted)
    assert OWN[0] < red < LIGHT[0]
    assert BLACK[1] < green < OWN[1]
    assert BLACK[2] - 0.01 <= blue < OWN[2]
    mixed = tint_hair(face, "red")
    assert np.abs(mixed.colours[-1] / 255 - parse_hair_colour("red")).max() < 0.01


def test_what_the_camera_changes_shows_less_on_lighter_hair(face: Face) -> None:
    light = face.light.baked
    strong = light.camera_modes.copy()
    strong[:, 0] = 60
    face = replace(face, light=Baked(replace(light, camera_modes=strong)))
    side = light.turn_side
    means = {name: tint_hair(face, name).light.baked.camera_modes.reshape(3, side, side) for name in ("black", "white")}
    top = [means[name][0, : side // 4].mean() for name in ("black", "white")]
    assert 0 < top[1] < 0.4 * top[0]
    for changed in means.values():
        assert np.array_equal(changed[:, side // 2 :], strong[0].reshape(3, side, side)[:, side // 2 :])


def test_hair_in_one_colour_is_not_tinted(face: Face) -> None:
    plain = replace(face, light=Baked(replace(face.light.baked, tint=None)))
    with pytest.raises(DataError, match="has one colour only; remove the colour of the hair"):
        tint_hair(plain, "red")
    with pytest.raises(InputError, match="there is no hair colour 'plaid'"):
        tint_hair(face, "plaid")


def test_faces_and_haircuts_round_trip(face: Face, wig: LitHair, tmp_path: Path) -> None:
    write_face(tmp_path / "tiny.face", face)
    read = read_face(tmp_path / "tiny.face")
    before, after = face.light.baked.tint, read.light.baked.tint
    assert np.array_equal(after.colours, before.colours)
    assert np.array_equal(after.vertices, before.vertices)
    assert np.abs(after.pages.astype(int) - before.pages).max() <= 3
    assert np.array_equal(read.light.baked.triangles, face.light.baked.triangles)
    write_lit_hair(tmp_path / "wig.hair", wig)
    hair = read_hair(tmp_path / "wig.hair")
    for name in ("vertices", "triangles", "colours", "loose", "middle"):
        assert np.array_equal(getattr(hair, name), getattr(wig, name)), name
    assert np.abs(next(iter(hair.shapes.values())) - 2).max() < 0.01
    for name in ("triangles", "is_inside", "base", "turn_modes", "camera_modes"):
        assert np.array_equal(getattr(hair.lights[0], name), getattr(wig.lights[0], name)), name
    assert np.abs(hair.lights[0].pages.astype(int) - wig.lights[0].pages).max() <= 4
    loaded = load_face(str(tmp_path / "tiny.face"), hair=str(tmp_path / "wig.hair"), hair_color="blond")
    assert loaded.hairdo == Hairdo("wig", "blond")
    assert len(loaded.vertices) == wig.n_face_vertices + 4
    assert not isinstance(read_face(tmp_path / "tiny.face", checks_pictures=False).light._light, BakedLight)


def test_earlier_light_whose_arrays_have_no_steps_is_the_same(face: Face, wig: LitHair, tmp_path: Path) -> None:
    write_face(tmp_path / "tiny.face", face)
    write_lit_hair(tmp_path / "wig.hair", wig)
    lights = []
    for path, read in ((tmp_path / "tiny.face", read_face), (tmp_path / "wig.hair", read_hair)):
        kind = path.suffix[1:]
        arrays, header = read_tensors(path, kind, 1)
        parts = unpack_arrays(arrays["light"], header["light"]["arrays"], "light", path)
        assert any(len(entry) > 3 for entry in header["light"]["arrays"])
        arrays["light"] = deflate(b"".join(array.tobytes() for array in parts.values()))
        header["light"]["arrays"] = [[name, array.dtype.name, [*array.shape]] for name, array in parts.items()]
        write_tensors(tmp_path / f"before.{kind}", kind, 1, arrays, header)
        for one in (path, tmp_path / f"before.{kind}"):
            found = read(one)
            lights.append(found.light.baked if isinstance(found, Face) else found.lights[0])
    for packed, before in (lights[:2], lights[2:]):
        for field in fields(packed):
            if isinstance(array := getattr(packed, field.name), np.ndarray):
                assert np.array_equal(array, getattr(before, field.name)), field.name


def test_haircuts_of_the_other_kind_are_refused(face: Face, wig: LitHair, tmp_path: Path) -> None:
    head = tiny_face(textured=True)
    write_hair(tmp_path / "cap.hair", cap(head))
    write_lit_hair(tmp_path / "wig.hair", wig)
    write_face(tmp_path / "tiny.face", face)
    write_face(tmp_path / "head.face", replace(head, hairdo=Hairdo("bald", "black")))
    with pytest.raises(DataError, match="is one of the face tiny; choose that face"):
        load_face(str(tmp_path / "head.face"), hair=str(tmp_path / "wig.hair"))
    with pytest.raises(DataError, match="is for heads; choose another face or one of its haircuts"):
        load_face(str(tmp_path / "tiny.face"), hair=str(tmp_path / "cap.hair"))
    with pytest.raises(InputError, match=r"the face tiny has no haircut 'mop'; give fringe, or a \.hair file"):
        load_face(str(tmp_path / "tiny.face"), hair="mop")


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda arrays, header: header.update(shape_names=[]), "has 0 shape_names, but 1 shape_steps"),
        (lambda arrays, header: arrays.update(loose=arrays["loose"][1:]), "loose"),
        (lambda arrays, header: header.update(n_face_triangles=1), "light draws a triangle beyond"),
        (lambda arrays, header: header.update(n_face_vertices=0), "n_face_vertices"),
        (lambda arrays, header: header["light"].update(arrays=[]), "light"),
        (lambda arrays, header: arrays.update(light=arrays["light"][:-9]), "light"),
    ],
)
def test_damaged_haircuts_are_refused(change, complaint: str, wig: LitHair, tmp_path: Path) -> None:
    write_lit_hair(tmp_path / "wig.hair", wig)
    arrays, header = read_tensors(tmp_path / "wig.hair", "hair", 1)
    change(arrays, header)
    write_tensors(tmp_path / "bad.hair", "hair", 1, arrays, header)
    with pytest.raises(DataError, match=complaint):
        read_hair(tmp_path / "bad.hair")


def test_glossy_hair_is_seen_in_the_colour_that_is_asked(face: Face) -> None:
    """Known colours are seen brighter by a gloss."""
    levels = encode_srgb(np.minimum(table_levels(), 1.0))
    view = np.stack(np.meshgrid(*[levels] * 3, indexing="ij"), -1).astype(np.uint8)

    def displayed(colour) -> np.ndarray:
        return encode_srgb(SHINE + 0.7 * decode_srgb(np.array(colour))) / 255

    side = face.light.baked.pages.shape[1]
    pages = face.light.baked.pages.copy()
    pages[1, : side // 2] = page_of(displayed(OWN), side)
    known = replace(tint(N_OWN, side), pages=np.stack([page_of(displayed(one), side // 2) for one in (BLACK, LIGHT)]))
    glossy = replace(face, light=Baked(replace(face.light.baked, view=view, pages=pages, tint=known)))
    for name in ("black", "red", "dark-blond", "white"):
        assert shown(tint_hair(glossy, name)) == pytest.approx(parse_hair_colour(name), abs=0.02), name
