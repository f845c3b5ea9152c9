"""Stored occlusion: files, haircuts, the cache folder; looks of eyes and strands that depend on the kind of a part."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.face.test_hair import cap
from tests.made_face import made_face
from tests.picture.tiny_face import tiny_face
from tts2face.face.shape_transfer import append_shapes
from tts2face.models.face import WIDE_OPEN, Face
from tts2face.models.face_file import FORMAT_VERSION, KIND, read_face, write_face
from tts2face.models.face_schema import LIT_POSES, OPENED_BY
from tts2face.models.hair import attach_hair
from tts2face.models.hair_file import read_hair, write_hair
from tts2face.models.mesh_coding import decode_occlusion, encode_occlusion
from tts2face.picture import occlusion
from tts2face.picture.occlusion import bake_hair, bake_occlusion, occlusion_of, occlusion_poses
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.picture.surface import build_surface
from tts2face.storage.tensors import read_tensors, write_tensors

SMALL = Picture(size="96x80")
REST = np.zeros(4)


def test_a_face_with_its_occlusion_is_drawn_as_one_without(tmp_path: Path) -> None:
    face = tiny_face()
    write_face(tmp_path / "a.face", bake_occlusion(face))
    kept = read_face(tmp_path / "a.face")
    assert kept.occlusion is not None
    np.testing.assert_array_equal(kept.occlusion, bake_occlusion(face).occlusion)
    np.testing.assert_array_equal(
        draw(face, REST, picture=SMALL), draw(replace(face, occlusion=kept.occlusion), REST, picture=SMALL)
    )


def test_occlusion_of_another_size_is_refused() -> None:
    bits = np.arange(64, dtype=np.uint8).reshape(2, 4, 8)
    content = encode_occlusion(bits)
    np.testing.assert_array_equal(decode_occlusion(content, (2, 4, 8), Path("a.face")), bits)
    with pytest.raises(DataError, match="is not of 80 bytes"):
        decode_occlusion(content, (2, 5, 8), Path("a.face"))
    with pytest.raises(DataError, match="cannot be inflated"):
        decode_occlusion(content[2:], (2, 4, 8), Path("a.face"))


def test_a_haircut_adds_its_shadow_to_the_skin(tmp_path: Path) -> None:
    face = bake_occlusion(tiny_face(textured=True))
    solid = replace(cap(face), pictures=(cap(face).relief, np.full((8, 8), 255, np.uint8)))
    write_hair(tmp_path / "cap.hair", bake_hair(face, solid))
    hair = read_hair(tmp_path / "cap.hair")
    haired = attach_hair(face, hair, "brown")
    assert haired.occlusion is not None
    assert face.occlusion is not None
    crown = int(np.argmax(face.vertices[:, 1]))
    own, shaded = (np.unpackbits(bits[0, crown]).sum() for bits in (face.occlusion, haired.occlusion))
    assert shaded > own + 4
    with pytest.raises(InputError, match="has no occlusion"):
        bake_hair(tiny_face(textured=True), solid)


def test_a_face_is_traced_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(occlusion, "MIN_CACHED_VERTICES", 0)
    face = tiny_face()
    first = draw(face, REST, picture=SMALL)
    assert len(list(tmp_path.rglob("occlusion/*"))) == 1
    monkeypatch.setattr(occlusion, "_trace", lambda *_: pytest.fail("traced again"))
    np.testing.assert_array_equal(draw(face, REST, picture=SMALL), first)


def test_eyes_of_their_kind_mirror_the_key_light() -> None:
    face = tiny_face()
    eyes = tuple(replace(part, kind="eye") if part.name.startswith("eye") else part for part in face.parts)
    picture = Picture(size="160x160", background="#000000")
    plain, lit = (draw(f, REST, picture=picture).astype(int) for f in (face, replace(face, parts=eyes)))
    brighter = np.argwhere((lit - plain).min(axis=2) > 40)
    assert len(brighter) >= 2  # a reflection on each eye, up and to the left, where the key light is
    assert np.abs(lit - plain).max(axis=2).sum() > 1000


def test_light_spreads_under_skin_only_where_the_quality_has_it() -> None:
    face = tiny_face(n_rings=60)
    skin = replace(face, parts=(replace(face.parts[0], kind="skin"), *face.parts[1:]))
    standard, draft = (
        draw(skin, REST, picture=Picture(size="96x96", supersampling=1, quality=quality)).astype(int)
        for quality in ("standard", "draft")
    )
    assert np.abs(standard - draft).max() > 0  # the light of a ball is smooth already


def _renamed(names: dict[str, str], **changes: object) -> Face:
    face = made_face()
    return replace(
        face, shape_names=tuple(names.get(name, name) for name in face.shape_names), occlusion=None, **changes
    )


@pytest.mark.parametrize(
    ("names", "opened_by", "n_poses"),
    [
        ({"jawOpen": "mouthViseme_aa"}, "mouthViseme_aa", 2),  # visemes alone, as Oculus and VRM have
        ({"jawOpen": "mouthSmile"}, WIDE_OPEN, 1),  # nothing opens the mouth
        ({}, WIDE_OPEN, 2),
        ({}, "mouthFunnel", 2),
    ],
)
def test_a_stored_occlusion_holds_when_shapes_are_added(names, opened_by, n_poses, tmp_path: Path) -> None:
    face = bake_occlusion(_renamed(names, opened_by=opened_by), n_directions=8)
    write_face(tmp_path / "a.face", face)
    kept = read_face(tmp_path / "a.face")
    assert (kept.n_lit_poses, kept.opening) == (n_poses, face.opening)
    added = ("jawOpen", "mouthViseme_aa") if n_poses == 1 else ("mouthViseme_oh",)
    moved = np.ones((len(added), *face.vertices.shape), np.float32)
    more = append_shapes(kept, added, moved, np.zeros((len(added), 2)))
    assert len(occlusion_poses(more)) == len(occlusion_of(more, build_surface(more), 1)) == n_poses
    shown = draw(more, np.zeros(len(more.shape_names)), picture=SMALL)
    np.testing.assert_array_equal(shown, draw(kept, np.zeros(len(kept.shape_names)), picture=SMALL))
    write_face(tmp_path / "b.face", more)
    again = read_face(tmp_path / "b.face")
    np.testing.assert_array_equal(again.occlusion, face.occlusion)


def test_a_face_without_the_shape_of_its_occlusion_is_refused() -> None:
    face = bake_occlusion(_renamed({}), n_directions=8)
    names = tuple("breath" if name == WIDE_OPEN else name for name in face.shape_names)
    with pytest.raises(DataError, match="occlusion is for the shape 'jawOpen', which it lacks"):
        replace(face, shape_names=names)


def test_a_file_from_before_opened_by_is_read(tmp_path: Path) -> None:
    write_face(tmp_path / "a.face", bake_occlusion(_renamed({}), n_directions=8))
    _, header = read_tensors(tmp_path / "a.face", KIND, FORMAT_VERSION)
    assert not {OPENED_BY, LIT_POSES} & header.keys()
    assert read_face(tmp_path / "a.face").n_lit_poses == 2


@pytest.mark.parametrize("stated", [{OPENED_BY: "mouthViseme_aa"}, {OPENED_BY: "", LIT_POSES: 2}])
def test_an_occlusion_for_a_shape_that_is_left_out_is_refused(stated, tmp_path: Path) -> None:
    write_face(tmp_path / "a.face", bake_occlusion(_renamed({}), n_directions=8))
    arrays, header = read_tensors(tmp_path / "a.face", KIND, FORMAT_VERSION)
    write_tensors(tmp_path / "a.face", KIND, FORMAT_VERSION, arrays, header | stated)
    with pytest.raises(DataError, match="states its occlusion for the shape"):
        read_face(tmp_path / "a.face")
