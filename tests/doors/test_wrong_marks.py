"""Marks that are not understood cost the mark, with a note, at every door; wrong options stay refused."""

from collections import deque
from pathlib import Path

import pytest

from cli.main import run
from tests.serving.service.in_process import TableProcess, service_client
from tests.world import World
from tts2face.processes.message import MORE, Message
from tts2face.request import Request
from tts2face.serving.service.live import LiveTask
from tts2face.serving.service.messages import Event, Work
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.studio.tasks import preview
from tts2face.session.project import Project
from tts2face.session.project_file import project_json

PLAIN = "Bob may move."
# texts that are said and shown as PLAIN, and their notes
WRONG = {
    "[style:cross]Bob may move.[/style]": "there is no style 'cross' in the palette; its words keep the style around",
    "[style:ears=a]Bob may move.[/style]": "the style 'ears=a' of a mark is not followed: there is no feature 'ears'",
    "[style:a=]Bob may move.[/style]": "the style 'a=' of a mark is not followed: cannot read 'a='",
    "[nod x]Bob may move.": "the mark [nod x] is not followed: write [nod]",
    "[wink up]Bob may move.": "the mark [wink up] is not followed",
    "[smile 20%]Bob may move.": "the mark [smile 20%] is not followed",
    "[pause x]Bob may move.": "the mark [pause x] is not followed",
    "[emphasis]Bob may move.[/emphasis]": "the mark [emphasis] is not followed; its text is spoken",
    "[lang:xx]Bob may move.[/lang]": "the mark [lang:xx] is not followed",
    "[b]Bob may move.[/b]": "the mark [b] is not followed",
    "<speak><break time='x'/>Bob may move.</speak>": "SSML, line 1: <break> is not followed: cannot read the time 'x'",
    "<speak><lang>Bob may move.</lang></speak>": "SSML, line 1: <lang> is not followed: a <lang> needs xml:lang",
    "<speak><express-as style='cross'>Bob may move.</express-as></speak>": "there is no style 'cross' in the palette",
}
texts = pytest.mark.parametrize(("text", "note"), WRONG.items(), ids=list(WRONG))


@texts
def test_the_command_and_python_note_it(
    text: str, note: str, tones: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session, files = tones.session(), [tmp_path / f"{name}.track.json" for name in ("plain", "python", "command")]
    session.export(Request(text=PLAIN, fps=5), files[0])
    prepared = session.prepare(text, fps=5)
    assert any(one.startswith(note) for one in prepared.notes), prepared.notes
    session.export(prepared, files[1])
    assert run([text, "--export", str(files[2]), "--fps", "5", *tones.flags]) == 0
    shown = capsys.readouterr().err
    assert shown.count(f"note: {note}") == 1, shown
    plain, *others = (file.read_bytes() for file in files)
    assert others == [plain, plain]


@texts
def test_a_live_stream_notes_it(text: str, note: str, world: World) -> None:
    inputs = deque([Message(MORE, {"type": "say", "text": text}), Message(MORE, {"type": "end"})])
    work = Work(kind="live", request={"with_idle": False, "fps": 10})
    events = [step.content for step in LiveTask(world.session(), work, inputs).steps() if isinstance(step, Event)]
    assert not [event for event in events if event["type"] == "error"]
    notes = [event["message"] for event in events if event["type"] == "note"]
    assert sum(one.startswith(note) for one in notes) == 1, notes
    (said,) = (event["words"] for event in events if event["type"] == "speech")
    assert [word[0].strip(".").lower() for word in said] == ["bob", "may", "move"]


def test_the_service_names_it_in_the_header(tmp_path: Path) -> None:
    with service_client(ServiceSettings(data=tmp_path, workers=0), TableProcess()) as client:
        for text, note in WRONG.items():
            for path, body in (
                ("/v1/clips", {"text": text, "format": "wav"}),
                ("/v1/audio/speech", {"input": text, "voice": "heart", "response_format": "wav"}),
                ("/dev/captioned_speech", {"input": text, "voice": "heart", "response_format": "wav"}),
            ):
                answer = client.post(path, json=body)
                assert answer.status_code == 200, answer.text
                assert note.replace(";", ",") in answer.headers["X-Tts2face-Adjusted"], (path, text)


@texts
def test_the_studio_shows_it(text: str, note: str, world: World) -> None:
    project = project_json(Project(request=Request(text=text, fps=10)), Path())
    work = Work(kind="preview", request={"project": project, "folder": "."})
    events = [step.content for step in preview(world.session(), work, deque()) if isinstance(step, Event)]
    assert any(one.startswith(note) for event in events for one in event.get("notes", ())), events


@pytest.mark.parametrize("text", ["[listen to the radio] Bob", "[emphasis added] Bob", "[/tmp] Bob", "[12:30] Bob"])
def test_words_in_brackets_are_spoken_without_a_note(text: str, world: World) -> None:
    prepared = world.session().prepare(text)
    assert (prepared.text.text, prepared.notes) == (text, ())


def test_styles_of_options_stay_refused(tones: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--export", str(tmp_path / "a.track.json"), *tones.flags]
    assert run([PLAIN, "--style", "cross", *flags]) == 2
    assert "no style 'cross' in the palette" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
