"""Texts as people and language models write them, read alike at every door, and silence of those without words."""

from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from lexicon.growing_text import GrowingText
from lexicon.marked_text import GestureMark
from tests.lexicon.marked_rows import rows
from tests.serving.service.in_process import TableProcess, service_client
from tests.world import VOICE, World
from tts2face.interchange.exports.writer import ExportWriter, plan_exports
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.processes.message import MORE, Message
from tts2face.request import Request
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.recorded_segment import excerpt_of
from tts2face.serving.batch.render import SegmentRenderer, fit_segment
from tts2face.serving.batch.segment import TRACK
from tts2face.serving.service.live import LiveTask
from tts2face.serving.service.messages import Event, Work
from tts2face.serving.service.settings import ServiceSettings
from tts2face.session.named_models import Models
from tts2face.session.prepared import prepare
from tts2face.types import concatenate_clips

TEXTS = [row["text"] for row in rows()][::7]  # twenty of all kinds

# twenty texts of a line, whose brackets a subtitle file does not have as annotations, and its tags not as its own
CUES = [
    row["text"] for row in rows()
    if not any(sign in row["text"] for sign in ("\n", "<", "&")) and row["kind"] != "literal"
][:40:2]  # fmt: skip


def said(pieces: list) -> list[str]:
    speech = concatenate_clips([piece.clip for piece in pieces]).speech
    return [word.text.strip(".,!?:").lower() for word in speech.words]


@pytest.mark.parametrize("text", TEXTS, ids=lambda text: text[:25])
def test_a_live_stream_says_and_shows_what_a_clip_does(text: str, world: World) -> None:
    session = world.session()
    pieces = list(session.stream(Request(text=text, markup="llm", fps=10)))
    growing = GrowingText("en-us", "llm")
    sentences = [sentence for letter in text for sentence in growing.add(letter)] + growing.flush()
    inputs = deque([Message(MORE, {"type": "say", "text": sentence}) for sentence in sentences])
    inputs.append(Message(MORE, {"type": "end"}))
    work = Work(kind="live", request={"with_idle": False, "markup": "llm", "fps": 10})
    events = [step.content for step in LiveTask(session, work, inputs).steps() if isinstance(step, Event)]
    assert not [event for event in events if event["type"] == "error"]
    words = [word[0].strip(".,!?:").lower() for event in events if event["type"] == "speech" for word in event["words"]]
    assert words == said(pieces)


def test_the_command_writes_what_python_does(tones: World, tmp_path: Path) -> None:
    text = "[happy] **Bob** may move 😀.\n\n- *nods* We were [away](https://a.example)\n- `now` :)"
    session = tones.session()
    session.export(Request(text=text, markup="llm", fps=5), tmp_path / "python.track.json")
    flags = ["--export", str(tmp_path / "command.track.json"), "--fps", "5", *tones.flags]
    assert run([text, "--markup", "llm", *flags]) == 0
    assert (tmp_path / "python.track.json").read_bytes() == (tmp_path / "command.track.json").read_bytes()


def test_a_batch_renders_what_python_does(tones: World, tmp_path: Path) -> None:
    content = "".join(
        f"{number}\n00:{number:02}:00,000 --> 00:{number:02}:50,000\n{text}\n\n" for number, text in enumerate(CUES, 1)
    )
    (tmp_path / "a.srt").write_text(content, encoding="utf-8")
    models = Models(str(tones.talker_file), str(tones.face_file), palette=str(tones.palette_file))
    request = Request(fps=5, markup="llm", voice=VOICE)
    options = BatchOptions(format="none", exports=("track.json",))
    plan = plan_batch([tmp_path / "a.srt"], options, request=request, models=models)
    session, renderer = tones.session(), SegmentRenderer()
    segments = [replace(part, medium=TRACK) for output in plan.outputs for part in output.segments]
    assert len(segments) == len(CUES)
    for text, segment in zip(CUES, segments, strict=True):
        result = renderer.render(segment, tmp_path / "segment")
        own = replace(segment, request={**segment.request, "text": text})
        with excerpt_of(own, Request(**own.request)) as request:
            prepared, _ = fit_segment(session, request, own)
        clips = session.stream_to_length(prepared, result.n_frames)
        with ExportWriter(plan_exports([tmp_path / "python"], format=TRACK)) as writer:
            for clip in clips:
                writer.add(clip)
        assert (tmp_path / "segment").read_bytes() == (tmp_path / "python").read_bytes(), text


def test_the_service_passes_a_text_on_as_it_is(tmp_path: Path) -> None:
    table = TableProcess()
    with service_client(ServiceSettings(data=tmp_path, workers=0), table) as client:
        for text in TEXTS:
            answer = client.post("/v1/clips", json={"text": text, "markup": "llm", "format": "wav"})
            assert answer.status_code == 200, answer.text
            assert {name: table.works[-1].request[name] for name in ("text", "markup")} == {
                "text": text,
                "markup": "llm",
            }


def test_a_table_of_the_user_is_read_at_each_door(
    tones: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "marks.tsv"
    path.write_text("mark\tkind\tgesture\nboing\ttag\tshake\n")
    marks = prepare(Request(text="[boing] Bob may move.", text_marks=path)).text.marks
    assert [mark.name for mark in marks if isinstance(mark, GestureMark)] == ["shake"]
    speech = tones.session().live(text_marks=path, fps=10)
    assert said(list(speech.say("[boing] Bob may move."))) == ["bob", "may", "move"]
    flags = ["--export", str(tmp_path / "a.track.json"), "--fps", "5", *tones.flags]
    assert run(["[boing] Bob may move.", "--text-marks", str(path), *flags]) == 0
    assert run(["Bob may move.", "--text-marks", str(tmp_path / "none.tsv"), *flags]) == 3
    path.write_text("mark\tkind\tstyle\nboing\ttag\tpurple\n")
    capsys.readouterr()
    assert run(["[boing] Bob may move.", "--text-marks", str(path), *flags]) == 2
    assert f"{path}: there is no style 'purple' in the palette; it has" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["😀", "*nods*", "...", ":D", "```\nx\n```"])
def test_a_text_without_words_is_silent(text: str, world: World) -> None:
    clip = world.session().clip(Request(text=text, fps=10))
    assert clip.speech.waveform.duration == pytest.approx(0.85, abs=0.4)
    assert not np.any(clip.speech.waveform.samples)
    live = world.session().live(fps=10)
    assert list(live.say(text)) == []
    assert said(list(live.say("Bob may move."))) == ["bob", "may", "move"]


def test_cues_without_words_are_silent_and_ssml_reaches_them(tmp_path: Path) -> None:
    path = tmp_path / "a.srt"
    path.write_text(
        "1\n00:00:01,000 --> 00:00:02,000\n:D 😀\n\n"
        "2\n00:00:03,000 --> 00:00:04,000\n<sub alias='doctor'>Dr</sub> Bob\n"
    )
    assert [cue.text for cue in read_subtitles(path).cues if cue.text] == ["Dr Bob"]
    found = read_subtitles(path, None, SubtitleOptions(markup="ssml")).cues
    assert found[-1].text == "<sub alias='doctor'>Dr</sub> Bob"
    assert prepare(Request(text=found[-1].text, markup="ssml")).text.text.split() == ["doctor", "Bob"]
