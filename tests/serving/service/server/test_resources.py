"""Talkers, faces, palettes and dictionaries over HTTP: names, owners, scopes, quotas; no synthesis process runs."""

import asyncio
import hashlib
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from corpus_tools.dense.person_look import part_colour
from lexicon.errors import BackendError, DataError
from tests.models.made import write_made_face
from tests.photo.pictures import still
from tests.serving.service.in_process import decoding_here
from tests.serving.work.conftest import database, postgres  # noqa: F401 - fixtures
from tts2face.interchange.characters import importing
from tts2face.models.consent import PHOTO_TOOL, consent_record
from tts2face.models.face_file import read_face
from tts2face.photo import face_from_photo
from tts2face.serving.service import decoders
from tts2face.serving.service.application import create_app
from tts2face.serving.service.keys import add_key
from tts2face.serving.service.library import Library
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work.blobs import open_blobs
from tts2face.serving.work.database import database_url
from tts2face.serving.work.resources import ResourceTable, StoredResource
from tts2face.serving.work.run import RESOURCES
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.video.networks import MissingModelError

WORDS = b"Siobhan  SH IH0 V AO1 N\n"
OTHER_WORDS = b"Nguyen  N UW1 Y EH0 N\n"
Ask = Callable[..., httpx.Response]
GLB = b"glTF" + bytes(20)


@pytest.fixture(scope="module", autouse=True)
def decoding() -> Iterator[None]:
    """Uploads are checked in this process."""
    with decoding_here():
        yield


@pytest.fixture
def settings(tmp_path: Path) -> ServiceSettings:
    return ServiceSettings(processes=1, data=tmp_path / "data", keys=tmp_path / "keys.toml")


@pytest.fixture
def keys(tmp_path: Path) -> dict[str, str]:
    """Secrets of five keys."""
    path = tmp_path / "keys.toml"
    return {
        "ann": add_key(path, "ann", ["speak", "build"]),
        "bob": add_key(path, "bob", ["speak", "build"], resources=2, resources_mb=0.0001),
        "eve": add_key(path, "eve", ["speak", "build"], photos_per_day=0),
        "reader": add_key(path, "reader", ["speak"]),
        "boss": add_key(path, "boss", ["speak", "build", "admin"]),
    }


@pytest.fixture
def ask(settings: ServiceSettings, keys: dict[str, str]) -> Iterator[Ask]:
    """Function that sends one request as a key."""
    with asking(settings, keys) as ask_as:
        yield ask_as


@pytest.fixture
def ask_with_photos(settings: ServiceSettings, keys: dict[str, str]) -> Iterator[Ask]:
    """As `ask`, of a service that makes faces of photos."""
    with asking(replace(settings, photos=True, upload_pixels=200_000), keys) as ask_as:
        yield ask_as


@contextmanager
def asking(settings: ServiceSettings, keys: dict[str, str]) -> Iterator[Ask]:
    app = create_app(settings)

    def ask_as(key: str, method: str, path: str, **options: Any) -> httpx.Response:
        async def send() -> httpx.Response:
            headers = {"authorization": f"Bearer {keys[key]}"} | options.pop("headers", {})
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                return await client.request(method, path, headers=headers, **options)

        return asyncio.run(send())

    yield ask_as
    app.state.service.library.close()


def form(name: str, content: bytes = WORDS) -> dict[str, Any]:
    return {"data": {"name": name}, "files": {"file": ("../../evil.dict", content)}}


def refusal(answer: httpx.Response) -> tuple[int, str]:
    return answer.status_code, answer.json()["error"]["code"]


def names(answer: httpx.Response) -> list[tuple[str, str | None]]:
    return [(one["name"], one["owner"]) for one in answer.json()["data"]]


def test_photos_are_refused_where_the_operator_does_not_allow_them(ask: Ask) -> None:
    answer = ask("ann", "POST", "/v1/faces", **photo(np.zeros((100, 100, 3), np.uint8), consent="I agree to this."))
    assert refusal(answer) == (403, "forbidden")
    assert "its operator allows them with the setting photos" in answer.json()["error"]["message"]
    words = form("names")
    words["data"]["consent"] = "I agree."
    assert refusal(ask("ann", "POST", "/v1/dictionaries", **words)) == (422, "invalid_request")


def png(picture: np.ndarray) -> bytes:
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    return content.getvalue()


def photo(picture: np.ndarray, **parts: str) -> dict[str, Any]:
    return {"data": {"name": "tom"} | parts, "files": {"file": ("me.png", png(picture))}}


def test_parts_that_belong_to_a_photo_are_checked(ask_with_photos: Ask) -> None:
    plain = np.full((100, 100, 3), 90, np.uint8)
    for parts, reason in (
        ({"makes": "video"}, "the part makes is picture or avatar"),
        ({"makes": "avatar", "fit": "{}"}, "a fit corrects a picture that speaks; leave out fit, or makes"),
        ({"makes": "avatar", "age_keep": "1"}, "the part age_keep is true or false"),
        ({"eye_color": "blue"}, "eye_color and age_keep are of a head; leave them out, or add makes"),
        ({"consent": "x" * 1001}, "the part consent has up to 1000 characters of text"),
        ({"fit": " " * 100_001}, "the part fit has up to 100000 characters of text"),
    ):
        answer = ask_with_photos("ann", "POST", "/v1/faces", **photo(plain, **parts))
        assert refusal(answer) == (422, "invalid_request")
        assert answer.json()["error"]["message"] == reason
    pink = ask_with_photos("ann", "POST", "/v1/faces", **photo(plain, makes="avatar", eye_color="pink"))
    assert refusal(pink) == (400, "invalid_request")
    assert "there is no eye colour 'pink'; give #rrggbb or one of dark-brown, brown," in pink.text
    barred = ask_with_photos("eve", "POST", "/v1/faces", **photo(plain, consent="drawn"))
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
    parts = {"consent": "I agree to this.", "makes": "avatar", "eye_color": "green", "age_keep": "true"}
    made = ask_with_photos("ann", "POST", "/v1/faces", **photo(picture, **parts))
    assert made.status_code == 201, made.text
    assert made.json()["about"]["takes_haircuts"]
    parts = photo(still("tomas", 480), name="large", consent="drawn", makes="avatar")
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
    header["metadata"] |= {"made_by": PHOTO_TOOL, "consent": dict(consent_record("Tom", "I agree to this."))}
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
    parts = photo(np.zeros((100, 100, 3), np.uint8), consent="I agree to this.", makes=makes)
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

    def read(_: Path, *, mapping: Path | None) -> None:
        assert mapping is not None
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


def test_the_services_own_are_listed_and_shown(ask: Ask) -> None:
    assert names(ask("reader", "GET", "/v1/talkers")) == [("grid_s1", None)]
    shipped = ["ada", "ben", "head", "mara", "noor", "tomas", "zuri"]
    assert names(ask("reader", "GET", "/v1/faces")) == [(name, None) for name in shipped]
    assert names(ask("reader", "GET", "/v1/dictionaries")) == []
    palette = ask("reader", "GET", "/v1/palettes/starter").json()
    assert "delighted" in [style["name"] for style in palette["about"]["styles"]]
    head = ask("reader", "GET", "/v1/faces/head").json()
    assert "amara" in head["about"]["identities"]
    assert (head["owner"], head["bytes"]) == (None, None)


def test_a_dictionary_is_uploaded_shown_and_deleted(ask: Ask, settings: ServiceSettings) -> None:
    made = ask("ann", "POST", "/v1/dictionaries", **form("names"))
    assert made.status_code == 201, made.text
    assert made.headers["location"] == "/v1/dictionaries/names"
    shown = ask("ann", "GET", made.headers["location"]).json()
    assert shown == made.json()
    assert (shown["about"], shown["bytes"], shown["owner"]) == ({"n_words": 1}, len(WORDS), "ann")
    stored = [path for path in (settings.data_folder / "store").rglob("*") if path.is_file()]
    assert [path.name for path in stored] == [shown["sha256"]]  # nothing of the client is a file name
    assert ask("ann", "DELETE", "/v1/dictionaries/names").status_code == 204
    assert refusal(ask("ann", "GET", "/v1/dictionaries/names")) == (404, "not_found")
    assert refusal(ask("ann", "DELETE", "/v1/dictionaries/names")) == (404, "not_found")
    assert not stored[0].exists()


def test_a_face_has_a_picture(ask: Ask, tmp_path: Path) -> None:
    write_made_face(tmp_path / "a.face")
    made = ask("ann", "POST", "/v1/faces", **form("ball", (tmp_path / "a.face").read_bytes()))
    assert made.status_code == 201, made.text
    drawn = ask("ann", "GET", "/v1/faces/ball/picture")
    assert drawn.headers["content-type"] == "image/png"
    with Image.open(io.BytesIO(drawn.content)) as picture:
        assert picture.size == (384, 384)
    again = ask("ann", "GET", "/v1/faces/ball/picture", headers={"if-none-match": drawn.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert refusal(ask("bob", "GET", "/v1/faces/ball/picture")) == (404, "not_found")


@pytest.mark.parametrize("path", ["talkers/grid_s1", "palettes/starter"])
def test_the_services_own_have_pictures_that_are_drawn_once(ask: Ask, settings: ServiceSettings, path: str) -> None:
    first = ask("reader", "GET", f"/v1/{path}/picture")
    assert first.status_code == 200, first.text
    with Image.open(io.BytesIO(first.content)) as picture:
        assert picture.width >= 384
    (kept,) = (settings.data_folder / "pictures").iterdir()
    kept.write_bytes(b"another")
    assert ask("reader", "GET", f"/v1/{path}/picture").content == b"another"


def test_two_keys_may_use_one_name_for_one_content(ask: Ask) -> None:
    """Each sees its own; the content is stored once, and stays while one of them has it."""
    first = ask("ann", "POST", "/v1/dictionaries", **form("names")).json()
    second = ask("boss", "POST", "/v1/dictionaries", **form("names")).json()
    assert first["sha256"] == second["sha256"]
    assert names(ask("ann", "GET", "/v1/dictionaries")) == [("names", "ann")]
    assert names(ask("bob", "GET", "/v1/dictionaries")) == []
    assert names(ask("boss", "GET", "/v1/dictionaries")) == [("names", "ann"), ("names", "boss")]
    assert ask("ann", "DELETE", "/v1/dictionaries/names").status_code == 204
    assert names(ask("boss", "GET", "/v1/dictionaries")) == [("names", "boss")]
    assert ask("boss", "GET", "/v1/dictionaries/names").status_code == 200


def test_an_admin_names_the_owner(ask: Ask) -> None:
    ask("ann", "POST", "/v1/dictionaries", **form("names"))
    path = "/v1/dictionaries/names"
    assert refusal(ask("boss", "GET", path)) == (404, "not_found")
    assert ask("boss", "GET", path, params={"owner": "ann"}).json()["owner"] == "ann"
    assert refusal(ask("bob", "GET", path, params={"owner": "ann"})) == (403, "forbidden")
    assert refusal(ask("bob", "DELETE", path, params={"owner": "ann"})) == (403, "forbidden")
    assert ask("boss", "DELETE", path, params={"owner": "ann"}).status_code == 204
    assert names(ask("ann", "GET", "/v1/dictionaries")) == []


@pytest.mark.parametrize("kind", ["talkers", "faces", "palettes", "dictionaries"])
def test_changes_need_the_scope_build(ask: Ask, kind: str) -> None:
    upload = ask("reader", "POST", f"/v1/{kind}", **form("x"))
    assert refusal(upload) == (403, "forbidden")
    assert "need a key with the scope build" in upload.text
    assert refusal(ask("reader", "DELETE", f"/v1/{kind}/x")) == (403, "forbidden")
    assert ask("reader", "GET", f"/v1/{kind}").status_code == 200


@pytest.mark.parametrize(
    "name", ["", "../x", "a/b", "..", "A", "ä", "-a", "a b", "a\n", "x" * 41, "x" * 10_000, "a\x00", "CON."]
)
def test_wrong_names_are_refused(ask: Ask, name: str) -> None:
    answer = ask("ann", "POST", "/v1/dictionaries", **form(name))
    assert refusal(answer) == (422, "invalid_name")
    assert len(answer.content) < 500


@pytest.mark.parametrize("name", ["%2e%2e%2fx", "x" * 10_000, "A"])
def test_wrong_names_are_not_found(ask: Ask, name: str) -> None:
    assert ask("ann", "GET", f"/v1/faces/{name}").status_code in {404, 422}
    assert ask("ann", "GET", f"/v1/faces/{name}/picture").status_code in {404, 422}
    assert ask("ann", "DELETE", f"/v1/faces/{name}").status_code in {404, 422}


@pytest.mark.parametrize(("path", "name"), [("faces", "head"), ("faces", "self"), ("talkers", "tts-1")])
def test_names_of_the_service_cannot_be_taken_or_deleted(ask: Ask, path: str, name: str) -> None:
    assert refusal(ask("ann", "POST", f"/v1/{path}", **form(name))) == (409, "name_taken")
    if name == "head":
        assert refusal(ask("boss", "DELETE", f"/v1/{path}/{name}")) == (403, "forbidden")


def test_a_name_is_taken_until_it_is_deleted(ask: Ask) -> None:
    first = ask("ann", "POST", "/v1/dictionaries", **form("names")).json()
    assert refusal(ask("ann", "POST", "/v1/dictionaries", **form("names", OTHER_WORDS))) == (409, "name_taken")
    ask("ann", "DELETE", "/v1/dictionaries/names")
    second = ask("ann", "POST", "/v1/dictionaries", **form("names", OTHER_WORDS)).json()
    assert first["sha256"] != second["sha256"]  # and so the paths of sessions


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"json": {"name": "x"}}, "send a form"),
        ({"data": {"name": "x"}, "files": {"song": ("s", b"x")}}, "there is no part 'song'"),
        ({"data": {"name": "x", "file": "text"}, "files": {"other": ("s", b"x")}}, "there is no part 'other'"),
        ({"files": {"file": ("s", b"x")}}, "needs a part file, with a file name, and a part name"),
        (form("x", b"PK\x03\x04" + bytes(50)), "the talker cannot be used: it is a zip archive, not a .talker file"),
    ],
)
def test_wrong_uploads_are_refused(ask: Ask, options: dict[str, Any], reason: str) -> None:
    answer = ask("ann", "POST", "/v1/talkers", **options)
    assert (answer.status_code, reason in answer.text) == (422, True), answer.text
    assert names(ask("ann", "GET", "/v1/talkers")) == [("grid_s1", None)]


def test_a_key_has_a_quota(ask: Ask) -> None:
    assert ask("bob", "POST", "/v1/dictionaries", **form("a")).status_code == 201
    usage = ask("bob", "GET", "/v1/usage").json()
    assert usage["resources"] == {"used": 1, "limit": 2}
    assert usage["resource_bytes"] == {"used": len(WORDS), "limit": 100}
    large = ask("bob", "POST", "/v1/dictionaries", **form("b", 10 * WORDS))
    assert refusal(large) == (413, "quota")
    assert "0.0 MB more are beyond its 0.0001 MB; delete something first" in large.text
    assert ask("bob", "POST", "/v1/dictionaries", **form("b", OTHER_WORDS)).status_code == 201
    third = ask("bob", "POST", "/v1/dictionaries", **form("c"))
    assert refusal(third) == (413, "quota")
    assert "the key bob has 2 resources, its limit" in third.text
    ask("bob", "DELETE", "/v1/dictionaries/a")
    assert ask("bob", "POST", "/v1/dictionaries", **form("c")).status_code == 201
    assert ask("ann", "GET", "/v1/usage").json()["resources"] == {"used": 0, "limit": 100}


def resource(owner: str = "ann", name: str = "a", content: str = "c" * 64) -> StoredResource:
    return StoredResource(owner, "face", name, content, "", 10, {"identities": ["ä"]})


def test_the_table_holds_in_both_databases(database: str) -> None:  # noqa: F811
    table = ResourceTable(database_url(database))
    kept: list[str] = []
    sizes: list[int] = []

    def add(one: StoredResource) -> bool:
        return table.add(one, check=lambda usage: sizes.append(usage.n_bytes), keep=lambda: kept.append(one.name))

    assert [add(resource()), add(resource()), add(resource("bob")), add(resource(name="b"))] == [
        True,
        False,
        True,
        True,
    ]
    assert (kept, sizes) == (["a", "a", "b"], [0, 0, 10])
    assert [one.name for one in table.select("face", "ann")] == ["a", "b"]
    assert [one.owner for one in table.select("face", None)] == ["ann", "bob", "ann"]
    found = table.find("ann", "face", "a")
    assert found is not None
    assert (found.description, found.created > 1e9) == ({"identities": ["ä"]}, True)
    removed: list[str] = []
    for owner, name in (("ann", "a"), ("ann", "b"), ("ann", "b"), ("bob", "a")):
        table.remove(owner, "face", name, removed.append)
    table.close()
    assert removed == ["c" * 64]  # with the last that had it


def test_files_without_a_resource_are_removed_after_a_time(settings: ServiceSettings, tmp_path: Path) -> None:
    """As after a crash between the storage of a file and its row."""
    settings.data_folder.mkdir(parents=True)
    library = Library(settings)
    blobs = open_blobs(settings.store_place, RESOURCES, cache=tmp_path / "cache")
    lost, kept = blobs.put(b"lost"), blobs.put(b"kept")
    table = ResourceTable(database_url(settings.database_place))
    table.add(resource(content=kept), check=lambda usage: None, keep=lambda: None)
    table.close()
    assert library.remove_unused_files(older_than_s=3600.0) == 0
    assert library.remove_unused_files(older_than_s=-10.0) == 1
    assert (blobs.has(lost), blobs.has(kept)) == (False, True)
    library.close()


def test_a_refused_addition_leaves_nothing(tmp_path: Path) -> None:
    table = ResourceTable(database_url(tmp_path / "a.sqlite"))

    def refuse() -> None:
        raise BackendError("the disk is full")

    with pytest.raises(BackendError, match="the disk is full"):
        table.add(resource(), check=lambda usage: None, keep=refuse)
    assert table.find("ann", "face", "a") is None
    table.close()


def test_a_database_that_is_away_is_said_and_the_services_own_models_do_without(settings: ServiceSettings) -> None:
    from dataclasses import replace

    from tts2face.serving.service.keys import LOCAL_KEY

    away = replace(settings, keys=None, database="postgresql://nobody@127.0.0.1:9/none")
    library = Library(away)
    assert library.resolve(LOCAL_KEY, "face", "head") == ("head", {})
    with pytest.raises(BackendError, match="the database cannot be reached"):
        library.resolve(LOCAL_KEY, "face", "mine")
