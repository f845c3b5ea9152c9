"""Batches from end to end: frames, sound, manifest, and what a second run renders."""

import csv
import json
import os
import signal
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar

import av
import numpy as np
import pytest

from cli.main import run
from lexicon.errors import BackendError, InputError
from tests.serving.batch.conftest import FPS, SRT, Planner
from tests.tones import PHONE_S, LetterVoice
from tests.world import World
from tts2face.processes.parent import ChildEndedError
from tts2face.serving.batch import engine as engines
from tts2face.serving.batch.engine import LocalEngine, Rendered
from tts2face.serving.batch.render import SegmentRenderer
from tts2face.serving.batch.render_process import RenderProcess
from tts2face.serving.batch.run import SEGMENT_FOLDER, run_batch
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import Store, open_store

HALF_FRAME_S = 0.5 / FPS
AAC_SMEAR_S = 0.025  # of an onset, by the transform's length of 1024 samples


def decoded(path: Path) -> tuple[np.ndarray, np.ndarray, int]:
    """Pictures (T, H, W, 3), samples and rate of a movie; the pictures must lie on their frames."""
    with av.open(str(path)) as movie:
        frames = list(movie.decode(movie.streams.video[0]))
        movie.seek(0)
        sound = [frame for frame in movie.decode(movie.streams.audio[0])]
    assert [round(frame.time * FPS, 6) for frame in frames] == list(range(len(frames)))
    assert sound[0].pts == 0
    pictures = np.stack([frame.to_ndarray(format="rgb24") for frame in frames])
    return pictures, np.concatenate([frame.to_ndarray().reshape(-1) for frame in sound]), sound[0].sample_rate


def spans(samples: np.ndarray, rate: int) -> list[tuple[float, float]]:
    """Begin and end in seconds of the loud parts of a sound, divided by silences above 50 ms."""
    loud = np.flatnonzero(np.abs(samples) > 0.05)
    cuts = np.flatnonzero(np.diff(loud) > 0.05 * rate)
    firsts, lasts = loud[np.r_[0, cuts + 1]], loud[np.r_[cuts, len(loud) - 1]]
    return [(first / rate, last / rate) for first, last in zip(firsts, lasts, strict=True)]


def manifest(folder: Path) -> dict:
    return json.loads((folder / "manifest.json").read_text())


@pytest.mark.parametrize("begin", ["100", "200"])
def test_a_silence_of_one_or_two_frames_is_joined(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path, begin: str
) -> None:
    """Its encoder reorders no frames, in contrast to that of the following segment."""
    text = f"1\n00:00:00,{begin} --> 00:00:02,000\nHello there.\n"
    result = run_batch(plan_of(text, per="file"), tmp_path / "out")
    assert (result.n_made, result.failed) == (1, ())
    decoded(tmp_path / "out" / "one.mp4")


def test_a_file_is_in_sync_at_every_cue(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    result = run_batch(plan_of(SRT.replace("Good", "A very good"), per="file"), tmp_path / "out")
    assert (result.n_made, result.failed) == (1, ())
    pictures, samples, rate = decoded(tmp_path / "out" / "one.mp4")
    assert len(pictures) == 125
    assert abs(len(samples) / rate - 12.5) < AAC_SMEAR_S
    entry = manifest(tmp_path / "out")["outputs"][0]
    heard = spans(samples, rate)
    assert len(heard) == 3
    for (begin, end), cue, letters in zip(heard, entry["cues"], (10, 24, 10), strict=True):
        assert abs(begin - cue["begin_s"]) < AAC_SMEAR_S
        assert abs(end - cue["begin_s"] - letters * PHONE_S / cue["rate"]) < AAC_SMEAR_S
        assert abs(end - cue["begin_s"] - cue["speech_s"]) < HALF_FRAME_S
    assert [cue["rate"] > 1.0 for cue in entry["cues"]] == [False, True, False]


def test_silence_shows_a_living_face(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    run_batch(plan_of(per="file"), tmp_path / "out")
    pictures = decoded(tmp_path / "out" / "one.mp4")[0].astype(int)
    silence = pictures[52:98]
    assert np.abs(np.diff(silence, axis=0)).mean() > 0.05


@pytest.mark.smoke
def test_cues_become_clips_of_their_length(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_batch(plan_of(max_rate=1.1, overflow="report"), out)
    rows = list(csv.DictReader((out / "manifest.csv").read_text().splitlines()))
    assert [row["file"] for row in rows] == ["one-0001.mp4", "one-0002.mp4", "one-0003.mp4"]
    assert [row["n_frames"] for row in rows] == [
        "16",
        "19",
        "16",
    ]  # one frame before the cue, and 1.9 / 1.1 s in a cue of 1.5 s
    assert [float(row["rate"]) for row in rows] == [1.0, 1.1, 1.0]
    assert "longer than its cue" in rows[1]["warnings"]
    for row in rows:
        assert len(decoded(out / row["file"])[0]) == int(row["n_frames"])
        assert len(row["sha256"]) == 64


@pytest.mark.smoke
def test_a_second_run_does_nothing_and_a_changed_cue_renders_one(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert run_batch(plan_of(), out).n_rendered == 3
    times = {path: path.stat().st_mtime_ns for path in out.glob("*.mp4")}
    again = run_batch(plan_of(), out)
    assert (again.n_rendered, again.n_made, again.n_current) == (0, 0, 3)
    changed = run_batch(plan_of(SRT.replace("Bob may", "Tom may")), out)
    assert (changed.n_rendered, changed.n_made, changed.n_current) == (1, 1, 2)
    assert [path.name for path, at in times.items() if path.stat().st_mtime_ns != at] == ["one-0003.mp4"]
    (out / "one-0001.mp4").unlink()
    restored = run_batch(plan_of(SRT.replace("Bob may", "Tom may")), out)
    assert (restored.n_rendered, restored.n_made) == (0, 1)


def test_one_changed_cue_of_a_film_renders_one_segment(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    assert run_batch(plan_of(per="film"), tmp_path / "out").n_rendered == 5
    assert run_batch(plan_of(SRT.replace("Hello", "Hallo"), per="film"), tmp_path / "out").n_rendered == 1


class FailingEngine:
    """Renders everything but the segments with some words."""

    def __init__(self, words: str) -> None:
        self.words = words

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        good = {address: one for address, one in segments.items() if self.words not in one.request.get("text", "")}
        for address in segments.keys() - good.keys():
            yield Rendered(address, None, "it is poison")
        yield from LocalEngine().render(good, store)


@pytest.mark.smoke
def test_a_failed_segment_is_named_and_the_rest_goes_on(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    result = run_batch(plan_of(), out, engine=FailingEngine("Hello"))
    assert (result.n_made, result.failed) == (2, (("one-0001.mp4", "it is poison"),))
    assert [one["status"] for one in manifest(out)["outputs"]] == ["failed", "done", "done"]
    assert run_batch(plan_of(), out).n_made == 1


@pytest.mark.smoke
@pytest.mark.parametrize("name", ["taken", "taken/clips"])
def test_a_folder_that_cannot_be_written_is_named_before_anything_is_rendered(
    name: str, plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(BackendError, match=rf"cannot write the folder .*{name}: .*; choose another --out"):
        run_batch(plan_of(), tmp_path / name, store=open_store(tmp_path / "store"))
    assert voices == []


class InterruptedEngine:
    """Renders one segment, then Ctrl-C is pressed."""

    def __init__(self, *_: object) -> None:
        pass

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        for rendered in LocalEngine().render(segments, store):
            yield rendered
            raise KeyboardInterrupt


@pytest.mark.smoke
def test_an_interrupted_batch_keeps_what_is_finished_and_says_how_to_continue(
    voices: list[LetterVoice],
    world: World,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "one.srt").write_text(SRT, encoding="utf-8")
    out = tmp_path / "clips"
    words = ["batch", str(tmp_path / "one.srt"), "--out", str(out), "--size", "64x64", "--fps", "10", *world.models]
    with monkeypatch.context() as patch:
        patch.setattr(engines, "LocalEngine", InterruptedEngine)
        assert run(words) == 130
    message = capsys.readouterr().err
    assert f"interrupted; what is finished is in {out}; the same command continues" in message
    assert [one["status"] for one in manifest(out)["outputs"]] == ["done"]
    assert run(words) == 0
    assert "made 2 clips" in capsys.readouterr().err


def test_a_recording_is_used_in_place_of_a_voice(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    recordings = tmp_path / "dub"
    recordings.mkdir()
    run_batch(plan_of(), tmp_path / "spoken")
    (tmp_path / "spoken" / "one-0001.mp4").rename(recordings / "one-0001.mp4")
    text = SRT.replace("ANN: Hello there.", "ANN: Hello there!")
    plan = plan_of(text, audio=recordings)
    assert [one.message for one in plan.warnings] == [f"cue {n} has no recording; it is silent" for n in (2, 3)]
    (segment,) = plan.segments.values()
    assert segment.request["audio"] == str(recordings / "one-0001.mp4")


@pytest.mark.smoke
def test_outputs_never_replace_recordings(plan_of: Planner, tmp_path: Path) -> None:
    for number in (1, 2, 3):
        (tmp_path / f"one-{number:04d}.mp4").write_bytes(b"recorded")
    with pytest.raises(InputError, match="would replace"):
        run_batch(plan_of(audio=tmp_path), tmp_path)
    assert (tmp_path / "one-0001.mp4").read_bytes() == b"recorded"


class DyingRenderer:
    """Its process ends a number of times."""

    def __init__(self, n_deaths: int) -> None:
        self.n_deaths, self.n_calls = n_deaths, 0

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        self.n_calls += 1
        if self.n_calls <= self.n_deaths:
            raise ChildEndedError("the rendering process ended: killed")
        out.write_bytes(b"movie")
        return SegmentResult(15, 10.0)


@pytest.mark.smoke
@pytest.mark.parametrize(("n_deaths", "n_calls", "is_stored"), [(0, 1, True), (2, 3, True), (9, 3, False)])
def test_a_segment_whose_process_ends_is_tried_three_times(
    n_deaths: int, n_calls: int, is_stored: bool, plan_of: Planner, tmp_path: Path
) -> None:
    store, renderer = open_store(tmp_path / "store"), DyingRenderer(n_deaths)
    segment = plan_of().outputs[0].segments[0]
    rendered = engines.render_into(store, segment, renderer, lambda _: None)
    assert renderer.n_calls == n_calls
    assert (rendered.result is not None) == is_stored
    assert is_stored or "killed (3 tries)" in rendered.reason
    assert (store.result(segment.address) is not None) == is_stored
    assert not list((tmp_path / "store" / "scratch").iterdir())


@pytest.mark.smoke
def test_a_full_disk_pauses_and_says_so(plan_of: Planner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    free = iter([0, 0, 1 << 40, 1 << 40, 1 << 40])
    monkeypatch.setattr(engines, "free_bytes", lambda _: next(free))
    monkeypatch.setattr(engines, "PAUSE_S", 0.01)
    messages: list[str] = []
    store = open_store(tmp_path / "store")
    rendered = engines.render_into(store, plan_of().outputs[0].segments[0], DyingRenderer(0), messages.append)
    assert rendered.result is not None
    assert [message.split(":")[0] for message in messages] == ["paused", "continued"]


@pytest.mark.smoke
def test_an_error_of_a_full_disk_is_tried_again(
    plan_of: Planner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    free = iter([1 << 40, 0, 1 << 40, 1 << 40])
    monkeypatch.setattr(engines, "free_bytes", lambda _: next(free))

    class Filling(DyingRenderer):
        def render(self, segment: Segment, out: Path) -> SegmentResult:
            if self.n_calls == 0:
                self.n_calls += 1
                raise BackendError("cannot write: No space left on device")
            return super().render(segment, out)

    rendered = engines.render_into(
        open_store(tmp_path / "store"), plan_of().outputs[0].segments[0], Filling(0), lambda _: None
    )
    assert rendered.result is not None


def test_a_damaged_result_is_rendered_again(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_batch(plan_of(), out)
    for path in (out / SEGMENT_FOLDER).glob("??/*.json"):
        path.write_bytes(path.read_bytes()[:5])
    for path in out.glob("*.mp4"):
        path.unlink()
    assert run_batch(plan_of(), out).n_rendered == 3


class SlowProcess:
    """A rendering process whose first segment is done at once, and whose further ones only end when it is closed."""

    made: ClassVar[list["SlowProcess"]] = []

    def __init__(self, core: int | None) -> None:
        self.closed, self.is_closed, self.ends = threading.Event(), False, []
        self.made.append(self)

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        if segment.request["text"] != "Hello there.":
            self.ends.append(self.closed.wait(3.0))
            raise ChildEndedError("the rendering process ended: killed")
        out.write_bytes(b"movie")
        return SegmentResult(15, 10.0)

    def close(self) -> None:
        self.is_closed = True
        self.closed.set()


def test_an_interrupted_batch_ends_its_processes_while_they_render(
    plan_of: Planner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SlowProcess, "made", [])
    monkeypatch.setattr(engines, "RenderProcess", SlowProcess)
    rendering = LocalEngine(2).render(plan_of().segments, open_store(tmp_path / "store"))
    assert next(rendering).result is not None
    rendering.close()  # as an exception of the loop over it does
    assert [process.is_closed for process in SlowProcess.made] == [True, True]
    assert all(end for process in SlowProcess.made for end in process.ends)  # not one was waited for


@pytest.mark.smoke
def test_a_closed_process_is_not_started_again(plan_of: Planner, tmp_path: Path) -> None:
    process = RenderProcess()
    process.close()
    with pytest.raises(BackendError, match="the child process was closed"):
        process.render(plan_of().outputs[0].segments[0], tmp_path / "x.mov")
    assert process.pid is None


def test_a_child_process_renders_the_same_bytes_and_dies_alone(plan_of: Planner, tmp_path: Path) -> None:
    segment = plan_of(SRT.replace("ANN", "ANNA")).outputs[0].segments[0]
    quiet = Segment(
        **{**segment.as_json(), "models": segment.models, "request": {**segment.request, "voice": "espeak"}}
    )
    process = RenderProcess()
    try:
        result = process.render(quiet, tmp_path / "child.mov")
        own = SegmentRenderer().render(quiet, tmp_path / "own.mov")
        assert (result.n_frames, result.speech_s) == (own.n_frames, own.speech_s)
        assert (tmp_path / "child.mov").read_bytes() == (tmp_path / "own.mov").read_bytes()
        wrong = Segment(
            **{**quiet.as_json(), "models": quiet.models, "request": {"text": "Hello.", "style": "gleeful"}}
        )
        with pytest.raises(InputError, match="no style 'gleeful'"):
            process.render(wrong, tmp_path / "wrong.mov")
        assert process.pid is not None
        os.kill(process.pid, signal.SIGKILL)
        with pytest.raises(ChildEndedError, match="the process that was to render ended"):
            process.render(quiet, tmp_path / "again.mov")
        assert process.render(quiet, tmp_path / "again.mov").n_frames == own.n_frames
    finally:
        process.close()


@pytest.mark.smoke
def test_the_command_plans_makes_and_reports(
    voices: list[LetterVoice],
    world: World,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("one.srt").write_text(SRT.replace("\n\n2", "\n2"), encoding="utf-8")
    small = ["--size", "64x64", "--fps", "10", "--supersampling", "1"]
    words = ["batch", "one.srt", "--out", "clips", *small, *world.models]
    assert run([*words, "--dry-run"]) == 0
    printed = capsys.readouterr()
    assert "3 cues, 0 of them silent; 3 clips, 3 to make" in printed.out
    assert "one.srt, line 5: there is no blank line before this cue" in printed.err
    assert not Path("clips").exists()
    assert run([*words, "--progress", "json"]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one for one in events if one["event"] == "progress"][-1] == {"event": "progress", "done": 3, "of": 3}
    assert {one["file"] for one in events if one["event"] == "output"} == {f"one-000{n}.mp4" for n in (1, 2, 3)}
    assert run(words) == 0
    assert "made 0 clips" in capsys.readouterr().err
    assert run([*words, "--jobs", "0"]) == 2
    assert run(["batch", "--out", "clips"]) == 2
    assert "there are no subtitles" in capsys.readouterr().err
    Path("two.srt").write_text("1\n00:00:00,500 --> 00:00:02,000\n♪\n", encoding="utf-8")
    assert run(["batch", "two.srt", "--out", "two"]) == 2
    printed = capsys.readouterr().err
    assert "two.srt, line 1: no cue has words that are spoken" in printed
    assert "no cue can be spoken, so there is nothing to make" in printed
    assert run(["batch", "one.srt", "--out", "s3://bucket/clips"]) == 2
    assert "--out must be a folder of this machine" in capsys.readouterr().err
    assert not Path("s3:").exists()
