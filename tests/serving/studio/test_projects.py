"""Projects, comparisons, reports and styles of the studio in the process of the test: previews, and what is refused."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.interchange.transcripts.grids import PHONES, WORDS, textgrid
from tests.serving.service.in_process import another_client, decoding_here
from tests.serving.service.test_uploads import wav
from tests.serving.studio.server.test_comparison_http import compare
from tests.serving.studio.server.test_projects_http import TEXT, create, edit, preview, project_file, wait_until_saved
from tests.serving.studio.server.test_reports_http import REPORTS
from tests.serving.studio.server.test_styles_http import MIX
from tts2face.serving.service.page_addresses import COOKIE
from tts2face.session.project_file import load_project
from tts2face.session.session import Session


@pytest.fixture(scope="module")
def studio(closed: TestClient, keys: dict[str, str]) -> Iterator[TestClient]:
    with decoding_here():
        yield another_client(closed, "studio/", cookie=f"{COOKIE}={keys['eva']}")


@pytest.fixture
def number(studio: TestClient) -> str:
    return create(studio)


@pytest.fixture
def data(closed: TestClient) -> Path:
    """Data folder of the service."""
    return closed.app.state.service.settings.data_folder


def test_the_preview_is_the_clip_of_the_saved_project(studio: TestClient, number: str, data: Path) -> None:
    header, *_ = preview(studio, number)
    text, occurrence = header["sentences"][0][:2]
    edge = header["phones"][2][2] + 0.02
    for change in (
        {"kind": "paint", "feature": "all", "style": "delighted", "start": 0.2, "end": 1.5},
        {"kind": "edge", "text": text, "occurrence": occurrence, "index": 3, "time": edge},
        {"kind": "pronounce", "word": "maps", "phones": "/mɑps/", "keep": False},
        {"kind": "name", "name": "Edited"},
    ):
        assert edit(studio, number, change).status_code == 200
    wait_until_saved(studio, number, data, "Edited")
    header, motion, head, sound = preview(studio, number)
    clip = Session().clip(load_project(project_file(data, number)).prepare())
    assert tuple(header["channels"]) == clip.motion.channels
    np.testing.assert_array_equal(motion, clip.motion.values)
    np.testing.assert_array_equal(head, clip.head.values)
    np.testing.assert_array_equal(sound, np.rint(clip.speech.waveform.samples * 32767).astype(np.int16))
    assert header["rate"] == clip.speech.waveform.rate
    pause = [one[3] for one in header["phones"]].index(1)  # a clip has one pause where two sentences meet
    phones = header["phones"][:pause] + header["phones"][pause + 1 :]
    assert [one[0] for one in phones] == list(clip.speech.phones.phones)
    np.testing.assert_allclose([one[1] for one in phones], clip.speech.phones.edges[:-1], atol=1e-6)
    assert [one[0] for one in header["words"]] == [word.text for word in clip.speech.words]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"kind": "request", "options": {"audio": "/etc/passwd"}}, "has no file '/etc/passwd' for audio"),
        ({"kind": "request", "options": {"audio": "../../x/assets/recording.wav"}}, "has no file"),
        ({"kind": "request", "options": {"text_marks": "marks.tsv"}}, "remove text_marks, or add the table again"),
        ({"kind": "request", "options": {"dictionary": "/etc/passwd"}}, "for dictionary; remove dictionary, or give"),
        ({"kind": "request", "options": {"dictionary": "/etc/passwd"}}, "for dictionary"),
        ({"kind": "request", "options": {"timeline": "/etc/passwd"}}, "for timeline"),
        ({"kind": "request", "options": {"voice": "/tmp/x.onnx"}}, "there is no voice"),
        ({"kind": "models", "options": {"talker": "/tmp/x.talker"}}, "there is no talker"),
        ({"kind": "models", "options": {"face": "../head"}}, "there is no face"),
        ({"kind": "models", "options": {"hair": "../x.hair"}}, "there is no haircut"),
        ({"kind": "picture", "options": {"background": "/etc/x.png"}}, "there is no background"),
        ({"kind": "picture", "options": {"size": "4096x4096"}}, "more than 2100000 pixels"),
    ],
)
def test_paths_of_clients_reach_no_file(studio: TestClient, number: str, change: dict[str, Any], reason: str) -> None:
    answer = edit(studio, number, change)
    assert answer.status_code == 400
    assert reason in answer.json()["error"]["message"]
    content = studio.get(f"/api/projects/{number}/project.json").json()
    part = change["kind"]
    imported = studio.post("/api/imports", files={
        "file": ("p.json", json.dumps(content | {part: content.get(part, {}) | change["options"]}).encode()),
    })  # fmt: skip
    assert imported.status_code == 400
    assert reason in imported.json()["error"]["message"]


def test_two_tabs_do_not_edit_at_once(studio: TestClient, number: str) -> None:
    change = {"kind": "name", "name": "A"}
    assert edit(studio, number, change, tab="first").status_code == 200
    for other in ("second", ""):
        refused = edit(studio, number, change, tab=other)
        assert (refused.status_code, "another tab" in refused.json()["error"]["message"]) == (400, True)
    assert edit(studio, number, {"kind": "name", "name": "B"}, tab="first").status_code == 200


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("x.exe", b"MZ", "cannot be imported"), ("x.wav", b"no sound", "cannot be used"),
        ("x.srt", b"nothing", "cannot be used"), ("x.json", b"{", "JSON"), ("x.txt", b"\xff\xfe\xff", "UTF-8"),
    ],
)  # fmt: skip
def test_wrong_files_are_refused_and_leave_no_project(
    studio: TestClient, name: str, content: bytes, reason: str
) -> None:
    before = {one["id"] for one in studio.get("/api/projects").json()}
    answer = studio.post("/api/imports", files={"file": (name, content)})
    assert answer.status_code in {400, 422}
    assert reason in answer.json()["error"]["message"]
    assert {one["id"] for one in studio.get("/api/projects").json()} == before


def test_imported_subtitles_say_what_was_guessed_and_is_not_spoken(studio: TestClient) -> None:
    content = "1\n00:00:01,000 --> 00:00:03,000\n[bouchnutí] ANNA: Můžete přijít?\n".encode("cp1250")
    answer = studio.post("/api/imports", files={"file": ("x.srt", content)}).json()
    assert [note.partition(",")[0].partition(";")[0] for note in answer["notes"]] == [
        "line 1: the encoding is not stated and was guessed as cp1250",
        "line 2: 1 annotation",
        "line 2: speakers by names before a colon: ANNA (1)",
    ]
    choices = {"encoding": "cp1250", "keep": "annotations", "speakers": "false"}
    kept = studio.post("/api/imports", files={"file": ("x.srt", content)}, data=choices).json()
    assert kept["notes"] == []
    project = studio.get(f"/api/projects/{kept['id']}/project.json").json()
    assert project["request"]["text"] == "bouchnutí ANNA: Můžete přijít?"
    refused = studio.post("/api/imports", files={"file": ("x.srt", content)}, data={"keep": "noises"})
    assert "keep must be of annotations" in refused.json()["error"]["message"]


def test_imported_sounds_say_what_is_guessed(studio: TestClient) -> None:
    answer = studio.post("/api/imports", files={"file": ("x.wav", wav(gains=(1, -1)))}).json()
    assert [note.partition(":")[0] for note in answer["notes"]] == [
        "the 2 channels of the file cancel each other, as one is inverted"
    ]
    assert studio.post("/api/imports", files={"file": ("x.wav", wav())}).json()["notes"] == []


def test_words_of_other_programs_are_imported(studio: TestClient) -> None:
    grid = textgrid(phones=PHONES, Anna_words=WORDS, Ben_words=[(0, 1, "hello")])
    table = "0.5\t0.9\tbin\n0.9\t1.2\tred\n"
    found = {}
    for name, content, choices in (
        ("a.TextGrid", grid + "\n" * 2_000_000, {}), ("a.txt", grid, {"tier": "Ben words"}), ("b.txt", table, {}),
        ("c.txt", "bin red", {}), ("d.txt", "1\n00:00:01,000 --> 00:00:02,000\nbin red\n", {}),
        ("f.json", '{"segments": [{"start": 0, "end": 1, "text": " bin red"}]}', {}),
        ("e.tsv", "start\tend\ttext\n0\t1500\tbin red\n", {}),
    ):  # fmt: skip
        answer = studio.post("/api/imports", files={"file": (name, content.encode())}, data=choices).json()
        project = studio.get(f"/api/projects/{answer['id']}/project.json").json()
        found[name, *choices] = project["request"]["text"], len(answer["notes"])
    assert list(found.values()) == [
        ("bin red by k seven now", 1),
        ("hello", 0),
        ("bin red", 0),
        ("bin red", 0),
        ("bin red", 1),
        ("bin red", 1),
        ("bin red", 2),
    ]
    wrong = studio.post("/api/imports", files={"file": ("x.eaf", b"<html/>")})
    assert wrong.json()["error"]["message"].startswith("x.eaf is no file of ELAN")


@pytest.mark.server
def test_what_cannot_be_compared_is_refused(studio: TestClient) -> None:
    number = create(studio, TEXT)
    for reference, reason in (
        ({"kind": "settings", "request": {"text": "Other words."}}, "cannot change 'text'"),
        ({"kind": "settings"}, "at least one"),
        ({"kind": "settings", "models": {"talker": "nobody"}}, "nobody"),
        ({"kind": "take"}, "import a Live Link file first"),
        ({"kind": "guess"}, "is compared with kept, settings"),
    ):
        answer = compare(studio, number, **reference)
        assert answer.status_code == 400
        assert reason in answer.text
    preview(studio, number)
    assert compare(studio, number, kind="recording", recording="bbaf2n").status_code == 200
    answer = studio.get(f"/api/projects/{number}/comparison/preview", params={"wait": 60})
    assert answer.status_code == 409
    assert "import its sound with its words first" in answer.text
    assert studio.get(f"/api/projects/{number}/comparison/measures").status_code == 400


def test_what_cannot_be_reported_is_refused(studio: TestClient) -> None:
    for content, reason in (
        ({"kind": "beauty", "model": "grid_s1"}, "there is no report 'beauty'"),
        ({"kind": "similarity", "model": "nobody"}, "nobody"),
        ({"kind": "gestures", "model": "grid_s1"}, "grid_s1"),
    ):
        answer = studio.post(REPORTS, json=content)
        assert answer.status_code == 400
        assert reason in answer.text
    assert studio.get(f"{REPORTS}/0123456789ab/page").status_code == 404
    assert studio.delete(f"{REPORTS}/../reports").status_code in {404, 405}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"name": "mine", "mix": {"source": "nobody"}}, "there is no recorded style 'nobody'"),
        ({"name": "mine", "mix": {"source": "grid_s1", "speed": 2}}, "the mix: there is no 'speed' here; choose"),
        ({"name": "a=b", "mix": MIX}, "a style cannot be called 'a=b'"),
        ({"name": "mine"}, "there is no checked take; record or upload one"),
    ],
)
def test_wrong_styles(studio: TestClient, change: dict[str, Any], reason: str) -> None:
    answer = studio.post("/api/styles", json=change)
    assert answer.status_code == 400
    assert reason in answer.json()["error"]["message"]


def test_shipped_styles_stay(studio: TestClient) -> None:
    assert "is not one of your own styles" in studio.delete("/api/styles/delighted").json()["error"]["message"]
    answer = studio.put("/api/styles/take/0", content=b"x", headers={"Content-Type": "application/pdf"})
    assert "a take must be" in answer.json()["error"]["message"]
