"""Faces over HTTP: of photos, heads of photos and characters with mappings; no synthesis process runs."""

import asyncio
import hashlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from corpus_tools.dense.person_look import part_colour
from lexicon.errors import DataError
from tests.models.made import write_made_face
from tests.photo.pictures import still
from tests.serving.service.resource_requests import WORDS, Ask, form, refusal
from tts2face.interchange.characters import importing
from tts2face.models.consent import PHOTO_TOOL, consent_record
from tts2face.models.face_file import read_face
from tts2face.photo import face_from_photo
from tts2face.serving.service import decoders
from tts2face.serving.service.settings import ServiceSettings
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.video.networks import MissingModelError

pytestmark = pytest.mark.usefixtures("decoding")

GLB = b"glTF" + bytes(20)


def png(picture: np.ndarray) -> bytes:
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    return content.getvalue()


def photo(picture: np.ndarray, **parts: str) -> dict[str, Any]:
    return {"data": {"name": "tom"} | parts, "files": {"file": ("me.png", png(picture))}}


def test_photos_are_refused_where_the_operator_does_not_allow_them(ask: Ask) -> None:
    answer = ask("ann", "POST", "/v1/faces", **photo(np.zeros((100, 100, 3), np.uint8), consent="me: for a test"))
    assert refusal(answer) == (403, "forbidden")
    assert "its operator allows them with the setting photos" in answer.json()["error"]["message"]
    words = form("names")
    words["data"]["consent"] = "I agree to this."
    assert refusal(ask("ann", "POST", "/v1/dictionaries", **words)) == (422, "invalid_request")


def test_parts_that_belong_to_a_photo_are_checked(ask_with_photos: Ask) -> None:
    plain = np.full((100, 100, 3), 90, np.uint8)
    for parts, reason in (
        ({"makes": "video"}, "the part makes is picture or avatar"),
        ({"makes": "avatar", "fit": "{}"}, "a fit corrects a picture that speaks; leave out fit, or makes"),
        ({"makes": "avatar", "age_keep": "1"}, "the part age_keep is true or false"),
        ({"eye_color": "blue"}, "eye_color, age_keep and no_glasses are of a head; leave them out, or add makes"),
        ({"makes": "avatar", "no_glasses": "no"}, "the part no_glasses is true or false"),
        ({"consent": "x" * 1001}, "the part consent has up to 1000 characters of text"),
        ({"fit": " " * 100_001}, "the part fit has up to 100000 characters of text"),
    ):
        answer = ask_with_photos("ann", "POST", "/v1/faces", **photo(plain, **parts))
        assert refusal(answer) == (422, "invalid_request")
        assert answer.json()["error"]["message"] == reason
    pink = ask_with_photos("ann", "POST", "/v1/faces", **photo(plain, makes="avatar", eye_color="pink"))
    assert refusal(pink) == (400, "invalid_request")
    assert "there is no eye colour 'pink'; give #rrggbb or one of dark-brown, brown," in pink.text
    barred = ask_with_photos("eve", "POST", "/v1/faces", **photo(plain, consent="nobody"))
    assert refusal(barred) == (403, "forbidden")
    assert "the key eve may make no faces of photos" in barred.json()["error"]["message"]
    no_picture = form("tom") | {"data": {"name": "tom", "makes": "avatar"}}
    assert "a head is made of a picture" in ask_with_photos("ann", "POST", "/v1/faces", **no_picture).text


@pytest.mark.usefixtures("face_model")
def test_a_photo_becomes_a_head_and_is_not_kept(
    ask_with_photos: Ask, settings: ServiceSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    picture = still("tomas", 400)
    parts = {"consent": "me: for a test", "makes": "avatar", "eye_color": "green", "age_keep": "true"}
    made = ask_with_photos("ann", "POST", "/v1/faces", **photo(picture, **parts))
    assert made.status_code == 201, made.text
    assert made.json()["about"]["takes_haircuts"]
    parts = photo(still("tomas", 480), name="large", consent="nobody", makes="avatar")
    large = ask_with_photos("ann", "POST", "/v1/faces", **parts)
    assert refusal(large) == (422, "invalid_data")
    assert "the photo has 480 x 480 pixels, more than 200000" in large.json()["error"]["message"]
    assert not list(tmp_path.glob("tts2face-upload-*"))
    stored = [path for path in settings.data_folder.rglob("*") if path.is_file() and "store" in path.parts]
    assert len(stored) == 2  # the face, and a picture that is drawn of it
    assert made.json()["sha256"] in {path.name for path in stored}
    iris = part_colour(read_face(next(path for path in stored if path.name == made.json()["sha256"])), "iris")
    assert iris[1] == iris.max()
    assert {path.name for path in stored}.isdisjoint({hashlib.sha256(png(picture)).hexdigest()})


def test_heads_of_photos_are_refused_as_photos_are(ask: Ask, ask_with_photos: Ask, tmp_path: Path) -> None:
    """The file of a head that was made of pictures elsewhere, also one whose photograph is not in it."""
    write_made_face(tmp_path / "a.face")
    arrays, header = read_tensors(tmp_path / "a.face", "face", 1)
    header["metadata"] |= {"made_by": PHOTO_TOOL, "consent": dict(consent_record("Tom", "me: for a test"))}
    write_tensors(tmp_path / "a.face", "face", 1, arrays, header)
    content = (tmp_path / "a.face").read_bytes()
    refused = ask("ann", "POST", "/v1/faces", **form("tom", content))
    assert refusal(refused) == (403, "forbidden")
    assert "its operator allows them with the setting photos" in refused.text
    assert ask_with_photos("ann", "POST", "/v1/faces", **form("tom", content)).status_code == 201


@pytest.mark.parametrize("makes", ["picture", "avatar"])
def test_a_model_that_is_missing_here_is_no_fault_of_the_file(
    ask: Ask, ask_with_photos: Ask, monkeypatch: pytest.MonkeyPatch, makes: str
) -> None:
    """A character, a photo and a head need the face tracker: 503, as for all that is missing on the server."""

    async def run(*_: object, **__: object) -> None:
        raise MissingModelError("the models are not in /root/.cache/x: run `tts2face corpus setup`")

    def find(*_: object, **__: object) -> None:
        asyncio.run(run())

    monkeypatch.setattr(importing, "import_face", find)
    monkeypatch.setattr(face_from_photo, "face_from_photo", find)
    monkeypatch.setattr(decoders, "run_take_tool", run)
    parts = photo(np.zeros((100, 100, 3), np.uint8), consent="me: for a test", makes=makes)
    for answer in (
        ask("ann", "POST", "/v1/faces", **form("x", GLB)),
        ask_with_photos("ann", "POST", "/v1/faces", **parts),
    ):
        assert refusal(answer) == (503, "unavailable")
        assert answer.headers["retry-after"]
        assert answer.json()["error"]["message"] == "the models are not in x: run `tts2face corpus setup`"


def test_a_mapping_comes_with_a_character_alone(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a part of text or as a file, by its rows or its TOML; the check itself is tried in `test_resource_check`."""
    given: list[tuple[str, str]] = []

    def read(_: Path, *, mapping: Path | None, shapes: str | None) -> None:
        assert mapping is not None
        assert shapes is None
        given.append((mapping.suffix, mapping.read_text()))
        raise DataError("the character is damaged")

    monkeypatch.setattr(importing, "import_face", read)
    rows, toml = "jawOpen\tMouthWide\t0.8\n", '[shapes]\njawOpen = "MouthWide"\n'
    for mapping in (rows, toml):
        parts = {"data": {"name": "x", "mapping": mapping}, "files": {"file": ("a.glb", GLB)}}
        assert refusal(ask("ann", "POST", "/v1/faces", **parts)) == (422, "invalid_data")
        files = {"file": ("a.glb", GLB), "mapping": ("map", b"\xef\xbb\xbf" + mapping.encode())}
        assert refusal(ask("ann", "POST", "/v1/faces", data={"name": "x"}, files=files)) == (422, "invalid_data")
    assert given == [(".tsv", rows)] * 2 + [(".toml", toml)] * 2
    for content, mapping, reason in (
        (WORDS, rows, "a mapping names shapes of a character; send one, or leave it out"),
        (GLB, "x" * 100_001, "the part mapping has up to 100000 characters of text"),
    ):
        parts = {"data": {"name": "x", "mapping": mapping}, "files": {"file": ("a.glb", content)}}
        answer = ask("ann", "POST", "/v1/faces", **parts)
        assert (answer.status_code, answer.json()["error"]["message"]) == (422, reason)
    broken = {"file": ("a.glb", GLB), "mapping": ("map", b"\xff\xfe")}
    assert "the part mapping has up to" in ask("ann", "POST", "/v1/faces", data={"name": "x"}, files=broken).text
    other = {"data": {"name": "x", "mapping": rows}, "files": {"file": ("d", WORDS)}}
    assert "there is no part 'mapping'" in ask("ann", "POST", "/v1/dictionaries", **other).text


def test_shapes_are_carried_to_a_character_alone(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[str | None] = []

    def read(_: Path, *, mapping: Path | None, shapes: str | None) -> None:
        assert mapping is None
        given.append(shapes)
        raise DataError("the character has no shape; carry over those of a shipped head with --shapes transfer")

    monkeypatch.setattr(importing, "import_face", read)
    for shapes in ({}, {"shapes": "transfer"}):
        answer = ask("ann", "POST", "/v1/faces", data={"name": "x", **shapes}, files={"file": ("a.glb", GLB)})
        assert refusal(answer) == (422, "invalid_data")
        assert "carry over those of a shipped head with the part shapes, transfer" in answer.text
    assert given == [None, "transfer"]
    for content, shapes, reason in (
        (WORDS, "transfer", "shapes are those of a character; send one, or leave shapes out"),
        (GLB, "own", "the part shapes is transfer; leave it out for its own shapes"),
    ):
        answer = ask("ann", "POST", "/v1/faces", data={"name": "x", "shapes": shapes}, files={"file": ("a", content)})
        assert (answer.status_code, answer.json()["error"]["message"]) == (422, reason)
