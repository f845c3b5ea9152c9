"""Sound and motion of a first sentence that is spoken in two pieces."""

import numpy as np
import pytest

from lexicon.pauses import PAUSES_S
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.session.joining import CUT_SILENCE_S, END_S, JOIN_LEAD_S, end_after
from tts2face.session.session import Session
from tts2face.sound.spacing import FADE_S
from tts2face.types import Speech, Waveform

LONG = "We came home and nobody knew that it was late in the evening because the garden behind the house was green."
RATE = 24_000


@pytest.fixture(scope="module")
def session(shipped: Session) -> Session:
    return shipped


def test_little_silence_follows_a_phrase_within_a_sentence(session: Session) -> None:
    first, second = session.stream(LONG)
    assert f"{first.text} {second.text}" == LONG
    silence = first.clip.speech.phones.end - first.clip.speech.phones.edges[-2]
    assert silence < PAUSES_S[","] - JOIN_LEAD_S + 1 / 30 + 0.05  # with the rest of a frame, and the error of edges
    assert second.clip.speech.phones.end - second.clip.speech.phones.edges[-2] == pytest.approx(END_S, abs=0.06)


def test_the_sound_alone_is_that_of_the_clip(session: Session) -> None:
    sound = b"".join(chunk.content for chunk in session.stream_file(LONG, "pcm"))
    whole = session.clip(LONG).speech.waveform.samples
    assert np.abs(np.frombuffer(sound, "<i2") / 32767 - whole).max() < 1e-4


def test_the_end_of_a_sound_does_not_depend_on_its_phones() -> None:
    samples = np.zeros(RATE, np.float32)
    samples[: RATE // 2] = 0.5
    for edges in ([0.0, 1.0], [0.0, 0.98]):
        phones = PhoneSequence([SILENCE], edges) if edges[-1] == 1.0 else PhoneSequence(["a", SILENCE], [*edges, 1.0])
        short = end_after(Speech(Waveform(samples, RATE), phones, ()), CUT_SILENCE_S)
        assert short.waveform.duration == pytest.approx(0.5 + CUT_SILENCE_S)
        assert short.phones.end == short.waveform.duration
        assert not short.waveform.samples[-1]
        assert np.array_equal(short.waveform.samples[: RATE // 2], samples[: RATE // 2])
    assert FADE_S < CUT_SILENCE_S


def test_silence_follows_a_sound_that_ends_with_speech() -> None:
    speech = Speech(Waveform(np.full(RATE, 0.5, np.float32), RATE), PhoneSequence(["a"], [0.0, 1.0]), ())
    longer = end_after(speech, 0.25)
    assert longer.phones.phones == ("a", SILENCE)
    assert longer.phones.edges == pytest.approx([0.0, 1.0, 1.25])
