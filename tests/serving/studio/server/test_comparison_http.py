"""Comparisons over HTTP: settings, the project as it was kept, recordings and takes."""

import io
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.serving.studio.server.test_projects_http import create, edit, preview
from tts2face.serving.studio.preview_bundle import read_bundle
from tts2face.serving.studio.studio import MAX_IDLE
from tts2face.session.session import Session
from tts2face.types import HEAD_CHANNELS

TEXT = "Bob may move. Five maps were there."


def compare(studio: httpx.Client, number: str, **reference: Any) -> httpx.Response:
    return studio.put(f"/api/projects/{number}/comparison", json={"reference": reference})


def compared(studio: httpx.Client, number: str) -> Any:
    """Header, motion, head pose and samples of A."""
    answer = studio.get(f"/api/projects/{number}/comparison/preview", params={"wait": 60})
    assert answer.status_code == 200, answer.text
    return read_bundle(answer.content)


def measures(studio: httpx.Client, number: str) -> dict[str, Any]:
    answer = studio.get(f"/api/projects/{number}/comparison/measures")
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def row(found: dict[str, Any], name: str) -> dict[str, Any]:
    return next(one for part in ("lips", "channels") for one in found[part] if one["name"] == name)


@pytest.fixture(scope="module")
def session() -> Session:
    return Session()


@pytest.fixture(scope="module")
def recorded(studio_service: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Sound of a clip, and its motion as a Live Link file."""
    folder = tmp_path_factory.mktemp("take")
    files = folder / "clip.wav", folder / "take.csv"
    Session().export(TEXT, files, voice="espeak", gestures="none")
    return files


def test_fields_are_compared_with_noise(studio: httpx.Client, session: Session) -> None:
    number = create(studio, TEXT)
    steps = studio.post(f"/api/projects/{number}/undo").json()["n_undo"]
    studio.post(f"/api/projects/{number}/redo")
    assert compare(studio, number, kind="settings", label="noise", request={"gestures": "noise"}).status_code == 200
    header, motion, head, sound = compared(studio, number)
    clip = session.clip(TEXT, voice="espeak", gestures="noise")
    np.testing.assert_array_equal(motion, clip.motion.values)
    np.testing.assert_array_equal(head, clip.head.values)
    assert len(sound) == header["n_samples"] > 0
    own, own_motion, own_head, _ = preview(studio, number)
    assert np.abs(own_head - head).max() > 0.01
    found = measures(studio, number)
    assert found["is_same_time"]
    for name, ours, theirs in zip(HEAD_CHANNELS[:2], own_head.T, head.T, strict=False):
        assert row(found, name)["r"] == pytest.approx(np.corrcoef(ours, theirs)[0, 1], abs=1e-4)
    jaw = own["channels"].index("jawOpen")
    expected = own_motion[:, jaw].std() / motion[:, jaw].std()
    assert row(found, "jawOpen")["ratio"] == pytest.approx(expected, rel=1e-4)
    assert row(found, "opening")["r"] > 0.9  # gestures change the lips little
    state = edit(studio, number, {"kind": "request", "options": {"seed": 3}}).json()
    assert state["n_undo"] == steps + 2  # a comparison is no edit
    studio.delete(f"/api/projects/{number}/comparison")
    assert studio.get(f"/api/projects/{number}/comparison").json()["kind"] is None


def test_a_kept_project_stays_as_it_was(studio: httpx.Client, data: Path) -> None:
    number = create(studio, TEXT)
    _, before, _, _ = preview(studio, number)
    assert compare(studio, number, kind="kept", label="first").json()["label"] == "first"
    edit(studio, number, {"kind": "request", "options": {"rate": 1.4}})
    _, after, _, _ = preview(studio, number)
    assert len(after) < len(before)
    np.testing.assert_array_equal(compared(studio, number)[1], before)
    assert (data / "studio" / "projects" / number / "compare" / "reference.json").is_file()
    found = measures(studio, number)
    assert not found["is_same_time"]
    assert row(found, "opening")["r"] is None  # other times
    assert 0 < found["dtw_cost"] < 1.5  # standard deviations: the same words
    for other in [studio.post("/api/projects", json={"text": "Hi."}).json()["id"] for _ in range(MAX_IDLE + 1)]:
        studio.get(f"/api/projects/{other}/project.json")
    again = studio.get(f"/api/projects/{number}/comparison").json()  # the project had been closed, and is read again
    assert (again["kind"], again["label"], again["is_ready"]) == ("kept", "first", False)
    np.testing.assert_array_equal(compared(studio, number)[1], before)


def test_a_recording_is_compared_with_lips_made_from_its_words(
    studio: httpx.Client, session: Session, recorded: tuple[Path, Path]
) -> None:
    sound, take = recorded
    files = {"file": ("clip.wav", io.BytesIO(sound.read_bytes()))}
    number = studio.post("/api/imports", files=files, data={"transcript": TEXT}).json()["id"]
    edit(studio, number, {"kind": "request", "options": {"gestures": "none"}})
    preview(studio, number)
    files = {"file": ("take.csv", io.BytesIO(take.read_bytes()))}
    assert studio.post(f"/api/projects/{number}/comparison/take", files=files).status_code == 201
    header, motion, _, _ = compared(studio, number)
    assert (header["fps"], header["n_samples"]) == (30.0, 0)
    clip = session.clip(TEXT, voice="espeak", gestures="none")
    jaw = header["channels"].index("jawOpen")
    n = min(len(motion), len(clip.motion))
    theirs = clip.motion.values[:n, clip.motion.channels.index("jawOpen")]
    np.testing.assert_allclose(motion[:n, jaw], theirs, atol=0.01)
    found = measures(studio, number)
    assert row(found, "opening")["r"] > 0.8  # the same talker, phones found in the sound
    assert found["dtw_cost"] < 1.0
    recordings = studio.get(f"/api/projects/{number}/recordings").json()
    name, words = recordings[0]
    assert len(words.split()) >= 4
    assert compare(studio, number, kind="recording", recording=name, label=name).status_code == 200
    assert len(compared(studio, number)[1]) == pytest.approx(len(session.talker.utterances[0].shape) / 25 * 30, abs=2)


def test_the_command_line_renders_a_compared_project_as_before(studio: httpx.Client) -> None:
    number = create(studio, TEXT)
    before = studio.get(f"/api/projects/{number}/project.json").json()
    compare(studio, number, kind="settings", request={"seed": 5})
    assert studio.get(f"/api/projects/{number}/project.json").json() == before
