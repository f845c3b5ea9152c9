"""The studio over HTTP: projects, previews and files of a running service."""

import io
import json
import time
import wave
import zipfile
from pathlib import Path
from typing import Any

import av
import httpx
import numpy as np
import pytest
from PIL import Image

from tests.packages import package
from tests.running import eventually, serve_process
from tts2face.serving.studio.pages.lip_strips import opening_mm
from tts2face.serving.studio.preview_bundle import read_bundle
from tts2face.session.project_file import load_project
from tts2face.session.session import Session

TEXT = "Bob may move. Five maps were there."
FORMS = ("webm", "srt", "glb", "wav", "flac")
Bundle = tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray]


def create(studio: httpx.Client, text: str = TEXT, **options: Any) -> str:
    number: str = studio.post("/api/projects", json={"text": text, "name": "One"}).json()["id"]
    edit(studio, number, {"kind": "request", "options": {"voice": "espeak", **options}})
    return number


def edit(studio: httpx.Client, number: str, change: dict[str, Any], tab: str = "") -> httpx.Response:
    return studio.post(f"/api/projects/{number}/edits", json={"edit": change, "tab": tab})


def preview(studio: httpx.Client, number: str, have: int | None = None) -> Bundle:
    query = {"wait": 60} | ({} if have is None else {"have": have})
    answer = studio.get(f"/api/projects/{number}/preview", params=query)
    assert answer.status_code == 200, answer.text
    return read_bundle(answer.content)


def project_file(data: Path, number: str) -> Path:
    return data / "studio" / "projects" / number / "project.json"


def wait_until_saved(studio: httpx.Client, number: str, data: Path, name: str) -> None:
    eventually(lambda: json.loads(project_file(data, number).read_text())["name"] == name, 10.0)


@pytest.fixture
def number(studio: httpx.Client) -> str:
    return create(studio)


def test_a_moved_edge_sends_the_frames_of_its_sentence(studio: httpx.Client, number: str) -> None:
    header, *_ = preview(studio, number)
    text, occurrence, begin, end = header["sentences"][1]
    index = next(one[4] for one in header["phones"] if one[3] == 1 and one[4] > 1)
    time_of = next(one[1] for one in header["phones"] if one[3] == 1 and one[4] == index) - begin
    change = {"kind": "edge", "text": text, "occurrence": occurrence, "index": index}
    assert edit(studio, number, change | {"time": time_of + 0.004}).status_code == 200
    after, motion, _, sound = preview(studio, number, header["revision"])
    first, last = after["first_frame"], after["first_frame"] + after["n"]
    assert begin * 30 - 2 < first <= begin * 30 + 0.5  # the sentence begins and ends within frames
    assert end * 30 - 0.5 <= last < end * 30 + 2
    assert (len(motion), len(sound), after["n_samples"]) == (after["n"], 0, header["n_samples"])


def test_stale_edges_are_dropped_with_a_note_and_undo_brings_them_back(
    studio: httpx.Client, number: str, data: Path
) -> None:
    header, *_ = preview(studio, number)
    moved = {"text": header["sentences"][0][0], "occurrence": 0, "index": 3, "time": header["phones"][3][1] + 0.01}
    edit(studio, number, {"kind": "edge", **moved})
    edit(studio, number, {"kind": "request", "options": {"rate": 1.3}})
    after, *_ = preview(studio, number)
    assert after["error"] == ""
    assert any("the moved phone edges of 'Bob may move.' were removed" in note for note in after["notes"])
    content = studio.get(f"/api/projects/{number}/project.json").json()
    assert "edges" not in content
    studio.post(f"/api/projects/{number}/undo")
    assert len(studio.get(f"/api/projects/{number}/project.json").json()["edges"]) == 1
    assert preview(studio, number)[0]["error"] == ""


def test_a_shorter_text_cuts_the_timeline(studio: httpx.Client, number: str) -> None:
    edit(studio, number, {"kind": "paint", "feature": "head", "style": "delighted", "start": 0.5, "end": 3.0})
    edit(studio, number, {"kind": "gesture", "name": "nod", "time": 2.8, "size": 1})
    preview(studio, number)
    edit(studio, number, {"kind": "request", "options": {"text": "Bob may move."}})
    header, *_ = preview(studio, number)
    assert header["error"] == ""
    assert any("what the timeline had behind was cut" in note for note in header["notes"])
    timeline = studio.get(f"/api/projects/{number}/project.json").json()["timeline"]
    assert 0.0 <= timeline["spans"][0]["end"] - header["duration"] < 1 / header["fps"]  # the end of its last frame
    assert "gestures" not in timeline


def test_what_is_wrong_is_said_and_the_last_clip_stays(studio: httpx.Client, number: str) -> None:
    before, *_ = preview(studio, number)
    edit(studio, number, {"kind": "request", "options": {"text": "<speak>Hello"}})
    header, *_ = preview(studio, number)
    assert "the SSML is not well-formed" in header["error"]
    assert header["n_frames"] == before["n_frames"]


def test_a_face_is_gltf_with_a_target_for_each_channel(studio: httpx.Client, number: str, tmp_path: Path) -> None:
    answer = studio.get(f"/api/projects/{number}/face.glb")
    path = tmp_path / "face.glb"
    path.write_bytes(answer.content)
    gltf = package("pygltflib").GLTF2().load(str(path))
    header, *_ = preview(studio, number)
    assert gltf.meshes[0].extras["targetNames"] == header["channels"]
    assert {"skin", "teeth_upper", "iris", "hair"} <= {material.name for material in gltf.materials}
    assert not gltf.animations
    assert answer.headers["content-type"] == "model/gltf-binary"


def test_the_final_picture_is_that_of_the_renderer(studio: httpx.Client, number: str, data: Path) -> None:
    edit(studio, number, {"kind": "picture", "options": {"size": "128x128", "quality": "draft"}})
    edit(studio, number, {"kind": "name", "name": "Picture"})
    wait_until_saved(studio, number, data, "Picture")
    content = studio.get(f"/api/projects/{number}/picture.png", params={"time": 1.0}).content
    shown = np.asarray(Image.open(io.BytesIO(content)))
    project = load_project(project_file(data, number))
    session = Session()
    clip = session.clip(project.prepare())
    np.testing.assert_array_equal(shown, session.renderer(project.picture).frame(clip, 30))


def test_a_phone_is_explained_and_its_example_excluded(studio: httpx.Client, number: str) -> None:
    header, *_ = preview(studio, number)
    label, begin, end, *_ = next(one for one in header["phones"] if one[0] == "m")
    address = f"/api/projects/{number}/explanation"
    middle = {"time": (begin + end) / 2}
    phone = studio.get(address, params=middle).json()["phone"]
    assert phone["phone"] == label
    best = phone["tokens"][0]
    openings = [[opening_mm(lips) for lips in one["outlines"]] for one in phone["tokens"]]
    assert np.median([one[2] for one in openings]) < 2.0  # mm: recorded lips of an m are closed in its middle
    assert len(phone["made"]) == len(openings[0]) == 5
    assert opening_mm(phone["made"][2]) < 1.0
    edit(studio, number, {"kind": "exclude", "utterance": best["utterance"], "start": best["start"], "on": True})
    again = studio.get(address, params=middle).json()["phone"]["tokens"]
    assert (best["utterance"], best["start"]) not in {(one["utterance"], one["start"]) for one in again}


def test_files_are_queued_made_downloaded_and_deleted(studio: httpx.Client, number: str) -> None:
    edit(studio, number, {"kind": "picture", "options": {"size": "64x64", "quality": "draft"}})
    preview(studio, number)
    address = f"/api/projects/{number}/renders"
    started = {form: studio.post(address, json={"format": form}).json()["id"] for form in FORMS}
    eventually(lambda: not {one["state"] for one in studio.get(address).json()} & {"waiting", "running"}, 120.0)
    assert {one["state"] for one in studio.get(address).json()} == {"done"}
    files = {form: studio.get(f"{address}/{one}/file") for form, one in started.items()}
    assert files["webm"].content[:4] == b"\x1a\x45\xdf\xa3"
    for form in ("webm", "flac"):  # complete files, with their length
        with av.open(io.BytesIO(files[form].content), "r") as file:
            assert 1.0 < (file.duration or 0) / av.time_base < 6.0
    assert "Bob may move." in files["srt"].text
    assert set(zipfile.ZipFile(io.BytesIO(files["glb"].content)).namelist()) == {"One.glb", "One.wav"}
    with wave.open(io.BytesIO(files["wav"].content)) as sound:
        assert sound.getnframes() == preview(studio, number)[0]["n_samples"]
    assert 'filename="One.webm"' in files["webm"].headers["content-disposition"]
    assert studio.delete(f"{address}/{started['webm']}").status_code == 204
    assert len(studio.get(address).json()) == len(FORMS) - 1


def test_a_render_is_cancelled(studio: httpx.Client) -> None:
    number = create(studio, text=TEXT * 20)
    address = f"/api/projects/{number}/renders"
    one = studio.post(address, json={"format": "mp4"}).json()["id"]
    assert studio.delete(f"{address}/{one}").status_code == 204
    assert studio.get(address).json()[0]["state"] == "cancelled"
    refused = studio.get(f"{address}/{one}/file")
    assert (refused.status_code, "is cancelled" in refused.json()["error"]["message"]) == (400, True)
    assert studio.post(address, json={"format": "exe"}).status_code == 400


def test_recordings_subtitles_texts_and_projects_are_imported(studio: httpx.Client, number: str) -> None:
    header, *_, sound = preview(studio, number)
    content = io.BytesIO()
    with wave.open(content, "wb") as file:
        file.setparams((1, 2, header["rate"], 0, "NONE", ""))
        file.writeframes(sound.tobytes())
    subtitles = (
        b"1\n00:00:01,000 --> 00:00:02,000\nHello there.\n\n2\n00:00:03,000 --> 00:00:04,000\n<i>Good bye.</i>\n"
    )
    upload = {
        "recording.wav": content.getvalue(), "cues.srt": subtitles, "words.txt": b"Hello there.",
        "project.json": studio.get(f"/api/projects/{number}/project.json").content,
    }  # fmt: skip
    found = {}
    for name, given in upload.items():
        words = {"transcript": TEXT} if name.endswith(".wav") else {}
        answer = studio.post("/api/imports", files={"file": (name, given)}, data=words)
        assert answer.status_code == 201, answer.text
        found[name] = answer.json()["id"]
    projects = {name: studio.get(f"/api/projects/{one}/project.json").json() for name, one in found.items()}
    assert projects["cues.srt"]["request"]["text"] == "Hello there.\nGood bye."
    assert projects["words.txt"] == projects["words.txt"] | {"name": "words", "request": {"text": "Hello there."}}
    assert projects["project.json"]["request"]["text"] == TEXT
    assert projects["recording.wav"]["request"] == {"text": TEXT, "audio": "assets/recording.wav"}
    heard, *_ = preview(studio, found["recording.wav"])
    assert heard["sentences"][0][:2] == ["", 0]
    assert [one[0] for one in heard["words"]] == [one[0] for one in header["words"]]
    assert heard["duration"] == pytest.approx(header["duration"], abs=0.05)


def test_a_deleted_project_is_gone_from_disk(studio: httpx.Client, number: str, data: Path) -> None:
    preview(studio, number)
    assert studio.delete(f"/api/projects/{number}").status_code == 204
    assert not project_file(data, number).parent.exists()
    assert studio.get(f"/api/projects/{number}/preview").status_code == 404
    time.sleep(0.7)  # no save that was due brings it back
    assert not project_file(data, number).parent.exists()


def test_kept_words_come_into_new_projects(studio: httpx.Client, number: str) -> None:
    change = {"kind": "pronounce", "word": "maps", "phones": "/mɑps/"}
    edit(studio, number, change | {"keep": True})
    other = studio.get(f"/api/projects/{create(studio)}/project.json").json()
    assert other["pronunciations"] == {"maps": "/mɑps/"}
    edit(studio, number, change | {"phones": "", "keep": True})
    assert "pronunciations" not in studio.get(f"/api/projects/{create(studio)}/project.json").json()


def test_a_killed_server_loses_nothing_older_than_a_second_and_makes_its_files_later() -> None:
    with serve_process(is_ready=False) as running:
        with httpx.Client(base_url=f"{running.url}/studio", timeout=60.0) as client:
            number = client.post("/api/projects", json={"text": TEXT}).json()["id"]
            for at in range(12):
                assert (
                    edit(client, number, {"kind": "gesture", "name": "nod", "time": 0.2 * at, "size": 1.0}).status_code
                    == 200
                )
                time.sleep(0.1)
            picture = {"kind": "picture", "options": {"size": "64x64", "quality": "draft"}}
            assert edit(client, number, picture).status_code == 200
            time.sleep(1.0)
            address = f"/api/projects/{number}/renders"
            wanted = [client.post(address, json={"format": "mp4"}).json()["id"] for _ in range(3)]
            assert client.delete(f"{address}/{wanted.pop()}").status_code == 204
            done = {one["id"] for one in client.get(address).json() if one["state"] == "done"}
        running.process.kill()
        running.process.wait(timeout=30)
        kept = load_project(project_file(Path(running.data.name), number))
        again = serve_process(environment={"TTS2FACE_SERVE_DATA": running.data.name}, is_ready=False)
        with again as restarted, httpx.Client(base_url=f"{restarted.url}/studio", timeout=60.0) as client:
            back = client.get(f"/api/projects/{number}/project.json").json()
            undone = client.post(f"/api/projects/{number}/undo").json()
            eventually(lambda: {one["state"] for one in client.get(address).json()} == {"done"}, 120.0)
            made = {one["id"] for one in client.get(address).json()}
        folder = project_file(Path(running.data.name), number).parent / "renders"
        assert {path.suffix for path in folder.iterdir()} == {".mp4"}
    assert len(kept.timeline.gestures) == len(back["timeline"]["gestures"]) == 12
    assert (undone["n_undo"], undone["n_redo"]) == (12, 1)
    assert made == set(wanted)
    assert len(done) < len(wanted)  # otherwise the second server had nothing to make
