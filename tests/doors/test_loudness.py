"""Clips of every voice are equally loud; motion does not depend on it."""

from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest

from tests.oracles.loudness_meter import measure_loudness, true_peak
from tests.world import World
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.session import Session
from tts2face.session.speech_stream import Piece
from tts2face.sound import level
from tts2face.sound.loudness import integrated_loudness
from tts2face.sound.spacing import FADE_S
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import Waveform, concatenate_clips

TEXTS = (
    ("heart", "en-us", "Hi."),
    ("heart", "en-us", "Ah!"),
    (
        "heart",
        "en-us",
        "Wait. What? No way! That is the most ridiculous thing that I have ever heard in my whole life.",
    ),
    ("heart", "en-us", "Well, [pause 0.4] hello there. Chapter one. It was the best of times."),
    ("espeak", "en-us", "Hi. How are you today? I am fine. Thanks."),
    ("espeak", "de", "Guten Morgen. Ja. Wie geht es Ihnen? Das Wetter ist heute sehr schön."),
    ("espeak", "fr-fr", "Oui."),
    ("espeak", "es", "Buenos días. ¿Cómo está usted? Muy bien, gracias."),
    ("espeak", "ru", "Да."),
)


@pytest.fixture(scope="module")
def ready(world: World, voices: VoicePool) -> Session:
    """The voices are those that are shipped."""
    return world.session(voices=voices)


def pieces_of(ready: Session, text: str, **options: object) -> list[Piece]:
    return list(ready.stream(Request(text=text, gestures="none", **options)))


@pytest.mark.parametrize(("voice", "language", "text"), TEXTS)
def test_clips_are_equally_loud(voice: str, language: str, text: str, ready: Session) -> None:
    pieces = pieces_of(ready, text, voice=voice, language=language)
    loudness, peak = measure_loudness(concatenate_clips([piece.clip for piece in pieces]).speech.waveform)
    assert loudness == pytest.approx(-16.0, abs=1.0)  # LUFS
    assert peak < -1.0  # dB of full scale
    levels = [integrated_loudness([piece.clip.speech.waveform]) for piece in pieces]
    assert max((abs(b - a) for a, b in pairwise(levels)), default=0.0) < 1.0  # LU; 3.8 in the voice's own output


def test_the_first_sentence_sounds_the_same_whatever_follows(ready: Session) -> None:
    alone, first = (pieces_of(ready, text)[0].clip.speech.waveform for text in ("Stop!", "Stop! Hello there."))
    same = len(alone.samples) - round(FADE_S * alone.rate)  # the pause behind it is longer than the end of a text
    assert len(first.samples) > same
    assert alone.samples[:same].tobytes() == first.samples[:same].tobytes()


def test_volume_and_marks_are_relative(ready: Session) -> None:
    """The middle word of three at half the loudness: 6 dB lower, and --volume on top of it."""
    text = '<speak>wonderful <prosody volume="-6dB">wonderful</prosody> wonderful</speak>'
    plain, marked, half = (
        pieces_of(ready, spoken, volume=volume, voice="espeak")[0].clip.speech
        for spoken, volume in (("wonderful wonderful wonderful", 1.0), (text, 1.0), (text, 0.5))
    )
    sound = plain.waveform
    np.testing.assert_allclose(half.waveform.samples, 0.5 * marked.waveform.samples, atol=1e-6)
    edges = plain.phones.edges
    for word, expected in zip(plain.words, (0.0, -6.0, 0.0), strict=True):
        begin, end = (round((edges[at] + shift) * sound.rate) for at, shift in ((word.first, 0.05), (word.last, -0.05)))
        change = np.sqrt(np.mean(np.square(marked.waveform.samples[begin:end] / np.abs(sound.samples).max())))
        base = np.sqrt(np.mean(np.square(sound.samples[begin:end] / np.abs(sound.samples).max())))
        assert 20 * np.log10(change / base) == pytest.approx(expected, abs=0.1)


def test_motion_does_not_depend_on_the_loudness_of_the_clip(ready: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    request = Request(text="Bob may move. Stop!", pitch=True)
    usual = concatenate_clips([piece.clip for piece in ready.stream(request)])
    monkeypatch.setattr(level, "LOUDNESS_LUFS", -40.0)
    quiet = concatenate_clips([piece.clip for piece in ready.stream(request)])
    assert quiet.motion.values.tobytes() == usual.motion.values.tobytes()
    assert quiet.head.values.tobytes() == usual.head.values.tobytes()
    assert integrated_loudness([quiet.speech.waveform]) == pytest.approx(-40.0, abs=1.0)


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_the_sound_of_a_file_has_the_loudness_too(suffix: str, ready: Session, tmp_path: Path) -> None:
    out = tmp_path / f"clip{suffix}"
    request = Request(text="Buenos días. ¿Cómo está usted?", voice="espeak", language="es", fps=10.0, gestures="none")
    ready.write(request, out, picture=Picture(size="64x64"))
    with av.open(str(out)) as container:
        reader = av.AudioResampler("flt", "mono", 48_000)
        frames = [part for frame in container.decode(audio=0) for part in reader.resample(frame)]
    samples = np.concatenate([frame.to_ndarray()[0] for frame in frames])
    loudness, peak = measure_loudness(Waveform(samples, 48_000))
    assert loudness == pytest.approx(-16.0, abs=1.0)
    assert peak < -1.0
    assert true_peak(Waveform(samples, 48_000)) < -1.0
