"""How a text is read, at every door: markup, notes on what is not followed, and the prosody of a request."""

import json
from collections import deque
from pathlib import Path
from typing import Any, get_args

import pytest

from cli.main import run
from lexicon import text_marks
from lexicon.errors import InputError
from tests.serving.service.in_process import TableProcess, service_client
from tests.world import World
from tts2face.processes.message import MORE, Message
from tts2face.request import Request
from tts2face.serving.service.live import LiveTask
from tts2face.serving.service.messages import Event, Work
from tts2face.serving.service.routes.openai import Markup
from tts2face.serving.service.settings import ServiceSettings
from tts2face.session.project import Project
from tts2face.session.project_file import load_project, save_project
from tts2face.source_options import MARKUPS

FRAGMENT = 'Bob <bell xml:id="x">may</bell> move &amp; <break time="1s"/> be away.'
NOTE = "SSML, line 1: <bell> is not supported; its text is spoken"
ADJUSTED = "x-tts2face-adjusted"


def test_options_name_every_markup() -> None:
    assert tuple(text_marks.MARKUPS) == get_args(Markup) == MARKUPS


@pytest.mark.parametrize("markup", ["html", "SSML", ""])
def test_an_unknown_markup_is_refused(markup: str) -> None:
    with pytest.raises(InputError, match=f"there is no markup '{markup}'; choose auto, plain, ssml or llm"):
        Request(text="a", markup=markup)


def test_the_command_says_what_is_not_followed(
    tones: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    track = tmp_path / "a.track.json"
    flags = ["--export", str(track), "--fps", "5", *tones.flags]
    assert run([FRAGMENT, "--markup", "ssml", *flags]) == 0
    assert capsys.readouterr().err.count(f"tts2face: note: {NOTE}") == 1
    assert track.is_file()
    assert run(["Bob may move.", "--markup", "html", *flags]) == 2
    assert "auto, plain" in capsys.readouterr().err


def test_phones_are_those_of_the_markup(capsys: pytest.CaptureFixture[str]) -> None:
    written = {}
    for markup in MARKUPS:
        assert run(["phones", '<sub alias="doctor">Dr</sub>', "--format", "json", "--markup", markup]) == 0
        written[markup] = [word["text"] for word in json.loads(capsys.readouterr().out)["words"]]
    assert written["ssml"] == ["doctor"]
    assert len(written["plain"]) > 3


@pytest.fixture
def table() -> TableProcess:
    return TableProcess()


def test_the_service_says_in_a_header_what_is_not_followed(table: TableProcess, tmp_path: Path) -> None:
    prosody: dict[str, Any] = {"voice_pitch": -2.0, "voice_range": 1.5}
    with service_client(ServiceSettings(data=tmp_path, workers=0), table) as client:
        answer = client.post("/v1/clips", json={"text": FRAGMENT, "markup": "ssml", "format": "wav", **prosody})
        assert answer.status_code == 200, answer.text
        assert "SSML, line 1: <bell> is not supported, its text is spoken" in answer.headers[ADJUSTED]
        asked = table.works[-1].request
        assert {name: asked[name] for name in ("markup", *prosody)} == {"markup": "ssml", **prosody}
        spoken = client.post("/v1/audio/speech", json={"input": f"<speak>{FRAGMENT}</speak>", "response_format": "wav"})
        assert "<bell> is not supported" in spoken.headers[ADJUSTED]
        asked = {"input": FRAGMENT, "markup": "ssml", "response_format": "wav", **prosody}
        assert NOTE.replace(";", ",") in client.post("/v1/audio/speech", json=asked).headers[ADJUSTED]
        spoken_request = table.works[-1].request
        assert {name: spoken_request[name] for name in ("text", *prosody)} == {"text": FRAGMENT, **prosody}
        named = client.post("/v1/clips", json={"text": "<speak><ж>a</ж></speak>", "format": "wav"})
        assert "<?> is not supported" in named.headers[ADJUSTED]
        for name, value in (("markup", "html"), ("voice_pitch", 13), ("voice_range", -0.1)):
            assert client.post("/v1/clips", json={"text": "a", name: value}).status_code == 422


def test_a_live_stream_says_what_is_not_followed(world: World) -> None:
    inputs = deque([Message(MORE, {"type": "say", "text": FRAGMENT}), Message(MORE, {"type": "end"})])
    work = Work(kind="live", request={"with_idle": False, "markup": "ssml", "voice_pitch": 2.0, "fps": 10})
    events = [step.content for step in LiveTask(world.session(), work, inputs).steps() if isinstance(step, Event)]
    assert {"type": "note", "text": FRAGMENT, "message": NOTE} in events
    (speech,) = [event for event in events if event["type"] == "speech"]
    assert [word[0].strip(".") for word in speech["words"]] == ["Bob", "may", "move", "and", "be", "away"]


def test_a_project_keeps_the_options_of_the_voice(tmp_path: Path) -> None:
    request = Request(text=FRAGMENT, markup="ssml", voice_pitch=-3.0, voice_range=0.5)
    save_project(Project("a", request), tmp_path / "a.json")
    assert load_project(tmp_path / "a.json").request == request
