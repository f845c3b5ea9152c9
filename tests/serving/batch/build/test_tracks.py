"""Dubbing tracks: one recording of a whole subtitle file, spoken by a real voice at known times."""

import json
import wave
from collections.abc import Callable, Iterator
from pathlib import Path

import av
import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.sequence import SILENCE
from tests.serving.batch.conftest import SMALL
from tests.world import World
from tts2face.interchange.subtitles.cues import Cue
from tts2face.request import Request
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.output import Plan
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.run import run_batch
from tts2face.serving.batch.windows import cue_windows
from tts2face.session.named_models import Models
from tts2face.session.session import Session
from tts2face.types import Clip, exact_rate, first_sample

FPS = 25
RATE = 48_000
Sentence = tuple[float, np.ndarray, float, float, list[float]]
EARLY_S = 0.2  # by which the speech begins before its cue
SENTENCES = ((1.0, "Bob may move five big maps."), (3.6, "We were away a year ago."), (9.0, "Good morning to you all."))


@pytest.fixture(scope="module")
def spoken(world: World) -> list[Sentence]:
    """For each sentence: begin in the film, samples, seconds of its first phone, after its last, and of its words."""
    session, found = world.session(), []
    for begin, text in SENTENCES:
        speech = session.clip(text, voice="espeak").speech
        import soxr

        samples = soxr.resample(speech.waveform.samples, speech.waveform.rate, RATE)
        voiced = [at for at, phone in enumerate(speech.phones.phones) if phone != SILENCE]
        edges = speech.phones.edges
        words = [float(edges[word.first]) for word in speech.words]
        found.append((begin, samples, float(edges[voiced[0]]), float(edges[voiced[-1] + 1]), words))
    return found


@pytest.fixture
def dub(spoken: list[Sentence], tmp_path: Path) -> Path:
    """Folder with ``one.wav`` (12 s), and beside it ``one.srt``, whose cues begin and end within the speech."""
    samples, cues = np.zeros(12 * RATE, np.float32), []
    for number, ((begin, sound, first, last, _), (_, text)) in enumerate(zip(spoken, SENTENCES, strict=True), start=1):
        at = round(begin * RATE)
        samples[at : at + len(sound)] += sound
        times = [f"00:00:{seconds:06.3f}".replace(".", ",") for seconds in (begin + first + EARLY_S, begin + last)]
        cues.append(f"{number}\n{times[0]} --> {times[1]}\n{text}\n")
    folder = tmp_path / "dub"
    folder.mkdir()
    write_wav(folder / "one.wav", samples)
    (tmp_path / "one.srt").write_text("\n".join(cues), encoding="utf-8")
    return folder


def write_wav(path: Path, samples: np.ndarray) -> None:
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes(np.round(np.clip(samples, -1, 1) * 32767).astype("<i2").tobytes())


def read_wav(path: Path) -> np.ndarray:
    with wave.open(str(path)) as file:
        return np.frombuffer(file.readframes(-1), "<i2") / 32767.0


@pytest.fixture
def plan(dub: Path, world: World) -> Callable[..., Plan]:
    """Plan of the dubbed file with batch options by name, on the made models."""
    models = Models(str(world.talker_file), str(world.face_file), palette=str(world.palette_file))

    def make(**options: object) -> Plan:
        given = {"request": Request(fps=FPS, gestures="none"), "picture": SMALL, "models": models}
        return plan_batch([dub.parent / "one.srt"], BatchOptions(audio=dub, **options), **given)

    return make


def decoded_sound(path: Path) -> np.ndarray:
    with av.open(str(path)) as movie:
        return np.concatenate([frame.to_ndarray().reshape(-1) for frame in movie.decode(movie.streams.audio[0])])


def lag_of(sound: np.ndarray, reference: np.ndarray) -> float:
    """Seconds by which a sound is later than a reference, by their cross-correlation."""
    n = 1 << (len(sound) + len(reference)).bit_length()
    product = np.fft.irfft(np.fft.rfft(sound, n) * np.conj(np.fft.rfft(reference, n)), n)
    at = int(np.argmax(product))
    return (at - n if at > n // 2 else at) / RATE


@pytest.fixture
def clips(monkeypatch: pytest.MonkeyPatch) -> list[list[Clip]]:
    """Clips of each segment that is rendered, in order."""
    found: list[list[Clip]] = []
    stream = Session.stream_to_length

    def record(self: Session, *arguments: object, **options: object) -> Iterator[Clip]:
        found.append([])
        for clip in stream(self, *arguments, **options):
            found[-1].append(clip)
            yield clip

    monkeypatch.setattr(Session, "stream_to_length", record)
    return found


@pytest.mark.parametrize("per", ["scene", "file", pytest.param("film", marks=pytest.mark.smoke)])
def test_lips_and_sound_follow_the_track_within_a_frame(
    per: str, plan: Callable[..., Plan], dub: Path, spoken: list, clips: list[list[Clip]], tmp_path: Path
) -> None:
    planned = plan(per=per)
    result = run_batch(planned, tmp_path / "out")
    assert result.failed == ()
    entries = json.loads((tmp_path / "out" / "manifest.json").read_text())["outputs"]
    track = read_wav(dub / "one.wav")
    for entry in entries:
        assert entry["warnings"] == []
        sound = decoded_sound(tmp_path / "out" / entry["file"])
        begin = round(entry["begin_s"] * RATE)
        assert abs(lag_of(sound, track[begin : begin + len(sound)])) < 0.5 / FPS
    segments = [one for one in planned.segments.values() if "audio" in one.request]
    by_words = {one.request["text"]: one.audio_begin / RATE for one in segments}
    errors = []
    for parts in clips:
        words = [word for part in parts for word in part.speech.words]
        if words:
            (speech,) = (part.speech for part in parts if part.speech.words)
            at = next(k for k, (_, text) in enumerate(SENTENCES) if words[0].text.lower() in text.lower().split())
            begin, true = spoken[at][0], spoken[at][4]
            found = [float(speech.phones.edges[word.first]) for word in words]
            errors += [by_words[SENTENCES[at][1]] + one - begin - own for one, own in zip(found, true, strict=True)]
    assert len(errors) == sum(len(text.split()) for _, text in SENTENCES)
    assert abs(np.median(errors)) < 0.5 / FPS
    assert np.median(np.abs(errors)) < 0.5 / FPS  # single words have the aligner's own error


def test_a_clip_of_a_cue_includes_the_margins_of_its_speech(
    plan: Callable[..., Plan], tmp_path: Path, spoken: list
) -> None:
    result = run_batch(plan(), tmp_path / "out")
    assert (result.n_made, result.failed) == (3, ())
    entries = json.loads((tmp_path / "out" / "manifest.json").read_text())["outputs"]
    for entry, (begin, _, first, last, _) in zip(entries, spoken, strict=True):
        assert entry["begin_s"] < begin + first
        assert entry["begin_s"] + entry["duration_s"] > begin + last
        assert abs(entry["cues"][0]["begin_s"] - begin - first - EARLY_S) <= 0.5 / FPS + 1e-3


def test_only_cues_whose_sound_changed_are_rendered_again(plan: Callable[..., Plan], dub: Path, tmp_path: Path) -> None:
    assert run_batch(plan(per="file"), tmp_path / "out").n_rendered > 3
    track = read_wav(dub / "one.wav")
    track[round(1.5 * RATE) : round(1.6 * RATE)] *= 0.5
    write_wav(dub / "one.wav", track)
    again = run_batch(plan(per="file"), tmp_path / "out")
    assert (again.n_rendered, again.n_made) == (1, 1)


def test_other_words_and_silence_in_the_track_are_warnings(
    plan: Callable[..., Plan], dub: Path, tmp_path: Path
) -> None:
    text = (tmp_path / "one.srt").read_text()
    text = text.replace("We were away a year ago.", "Nobody expects such extraordinarily complicated vocabulary here.")
    (tmp_path / "one.srt").write_text(text + "\n4\n00:00:06,500 --> 00:00:08,000\nThis is not said.\n")
    result = run_batch(plan(), tmp_path / "out")
    assert result.failed == ()
    assert [("other words" in one, "no speech here (it is silent)" in one) for one in result.warnings] == [
        (True, False),
        (False, True),
    ]


@pytest.mark.smoke
def test_recordings_of_a_file_and_of_its_cues_are_not_mixed(plan: Callable[..., Plan], dub: Path) -> None:
    write_wav(dub / "one-0001.wav", np.zeros(RATE))
    with pytest.raises(InputError, match=r"one\.wav is a recording of the whole of .*one-0001\.wav one of a cue"):
        plan()


@pytest.mark.smoke
def test_two_recordings_of_a_file_are_refused(plan: Callable[..., Plan], dub: Path) -> None:
    (dub / "one.mp3").write_bytes(b"")
    with pytest.raises(InputError, match=r"are both recordings of"):
        plan()


@pytest.mark.smoke
def test_margins_share_gaps() -> None:
    cues = [
        Cue(number, begin, end, "abc", 1) for number, (begin, end) in enumerate([(0.2, 1), (1.5, 2), (2, 3), (9, 10)])
    ]
    found = [(one.begin, one.end, one.cue_begin, one.cue_end) for one in cue_windows(cues, exact_rate(10), (5, 5))]
    assert found == [(0, 12, 2, 10), (12, 20, 15, 20), (20, 35, 20, 30), (85, 105, 90, 100)]


@pytest.mark.smoke
def test_sample_positions_are_those_of_frames(plan: Callable[..., Plan]) -> None:
    for segment in plan(per="file").segments.values():
        if segment.audio_begin is not None:
            assert segment.audio_begin % (RATE // FPS) == 0
            assert segment.audio_end - segment.audio_begin == first_sample(segment.window_frames, RATE, exact_rate(FPS))
