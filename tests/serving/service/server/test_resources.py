"""Talkers, faces, palettes and dictionaries over HTTP: names, owners, scopes, quotas; no synthesis process runs."""

import io
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from tests.models.made import write_made_face
from tests.serving.service.resource_requests import WORDS, Ask, form, names, refusal
from tts2face.serving.service.settings import ServiceSettings

pytestmark = pytest.mark.usefixtures("decoding")

OTHER_WORDS = b"Nguyen  N UW1 Y EH0 N\n"


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


def test_a_table_of_marks_is_uploaded_and_read(ask: Ask) -> None:
    made = ask("ann", "POST", "/v1/text_marks", **form("mine", b"mark\tkind\tgesture\nboing\ttag\tshake\n"))
    assert (made.status_code, made.json()["about"]) == (201, {"n_marks": 1}), made.text
    assert names(ask("ann", "GET", "/v1/text_marks")) == [("mine", "ann")]
    refused = ask("ann", "POST", "/v1/text_marks", **form("wrong", b"mark\tkind\nboing\tsound\n"))
    assert refused.status_code == 422
    assert "line 2: there is no kind 'sound' of marks" in refused.text


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
