"""Rate, pitch, questions and emphasis as they are heard: of the voice heart, and of one that has a single pitch."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import parselmouth
import pytest

from lexicon.pauses import PAUSES_S
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from lexicon.tones import EVEN, Tone
from tts2face.numeric.arrays import FloatArray
from tts2face.sound import heart, retuned
from tts2face.sound.delivery import DeliveringVoice, sound_with, speak_with
from tts2face.sound.heart import NeuralVoice, carried_steps
from tts2face.sound.pauses import sound_windows
from tts2face.sound.prosody import Prosody
from tts2face.sound.spacing import quiet_span, sound_levels
from tts2face.sound.voice import SpeechInput, pronounce_content
from tts2face.types import Speech, Waveform

SENTENCE = "Many silver spoons lay in the old drawer."
QUESTIONS = ("Have they arrived?", "Does the shop open early?", "Your sister paints?", "Would you tell him about it?")
OPEN_QUESTIONS = ("Where do they live?", "Why was it closed?", "Who told you that?")
AUDIBLE_DB = -50.0
Intoned = Callable[..., Speech]


@pytest.fixture(scope="module")
def voice() -> NeuralVoice:
    return NeuralVoice({})


def praat_f0(sound: Waveform) -> tuple[FloatArray, FloatArray]:
    """Times and F0 of voiced frames."""
    found = parselmouth.Sound(sound.samples.astype(np.float64), sound.rate).to_pitch_ac(0.005, 50.0, pitch_ceiling=600)
    hertz = found.selected_array["frequency"]
    return found.xs()[hertz > 0], hertz[hertz > 0]


def median_f0(sound: Waveform) -> float:
    return float(np.median(praat_f0(sound)[1]))


def spoken_s(sound: Waveform) -> float:
    """Seconds from the first to the last audible window."""
    power = np.square(sound_windows(sound, 0.005), dtype=np.float64).mean(axis=1)
    audible = np.flatnonzero(10 * np.log10(power / power.max() + 1e-12) > AUDIBLE_DB)
    return float(audible[-1] - audible[0] + 1) * 0.005


def rise_at(speech: Speech, word: int) -> float:
    """Semitones by which F0 rises over the last voiced 200 ms of a word."""
    times, hertz = praat_f0(speech.waveform)
    span = speech.words[word]
    start, end = speech.phones.edges[[span.first, span.last]]
    inside = np.flatnonzero((times > start - 0.05) & (times < end))
    inside = inside[times[inside] > times[inside[-1]] - 0.2]
    third = max(len(inside) // 3, 1)
    return float(12 * np.log2(np.median(hertz[inside[-third:]]) / np.median(hertz[inside[:third]])))


def with_tones(monkeypatch: pytest.MonkeyPatch, tones: dict[int, Tone]) -> None:
    """Give words of what is pronounced next their tones."""

    def pronounced(*given: object) -> object:
        words = pronounce_content(*given)  # type: ignore[arg-type]
        return tuple(replace(word, tone=tones.get(at, EVEN)) for at, word in enumerate(words))

    monkeypatch.setattr(heart, "pronounce_content", pronounced)
    monkeypatch.setattr(retuned, "pronounce_content", pronounced)


@pytest.mark.parametrize("rate", [0.5, 0.7, 1.1, 1.34, 2.0])
def test_heart_speaks_at_the_rate_that_is_asked(voice: NeuralVoice, rate: float) -> None:
    usual = spoken_s(voice.sound(SENTENCE))
    assert usual / spoken_s(voice.sound(SENTENCE, rate=rate)) == pytest.approx(rate, rel=0.03)


def test_remainders_of_durations_are_carried_on() -> None:
    durations = np.array([1.2, 2.7, 0.3, 4.4, 3.1])
    for total in (5, 9, 12, 30):
        steps = carried_steps(durations, total)
        assert steps.sum() == total
        assert steps.min() >= 1
    assert carried_steps(np.full(7, 1.5), 11).tolist() == [2, 1, 2, 1, 2, 1, 2]


@pytest.mark.parametrize("question", QUESTIONS)
def test_questions_of_heart_rise(voice: NeuralVoice, question: str) -> None:
    assert rise_at(voice.speak(question), -1) > 3.0


@pytest.mark.parametrize("question", OPEN_QUESTIONS)
def test_questions_with_a_question_word_do_not(voice: NeuralVoice, question: str) -> None:
    assert rise_at(voice.speak(question), -1) < 3.0


def test_alternatives_rise_and_fall(voice: NeuralVoice) -> None:
    speech = voice.speak("Would you like a lamp or a candle?")
    assert rise_at(speech, 4) > 2.0
    assert rise_at(speech, -1) < 0.0


def test_a_tag_falls(voice: NeuralVoice) -> None:
    assert rise_at(voice.speak("You like music, don't you?"), -1) < 0.0


@pytest.mark.parametrize("prosody", [Prosody(pitch=-4.0), Prosody(pitch=3.0, formants=1.1), Prosody(1.3, 2.0)])
def test_pitch_of_heart_moves_by_what_is_asked(voice: NeuralVoice, prosody: Prosody) -> None:
    usual, moved = voice.sound(SENTENCE), voice.deliver_sound(SENTENCE, prosody, 0)
    shift = 12 * np.log2(median_f0(moved) / median_f0(usual))
    assert shift == pytest.approx(prosody.pitch, abs=0.3)
    levels = [10 * np.log10(np.mean(np.square(sound.samples))) for sound in (usual, moved)]
    assert levels[1] == pytest.approx(levels[0], abs=1.5)


def test_range_of_heart(voice: NeuralVoice) -> None:
    def wide(sound: Waveform) -> float:
        return float(np.ptp(np.log2(np.quantile(praat_f0(sound)[1], [0.1, 0.9]))))

    usual = wide(voice.sound(SENTENCE))
    assert wide(voice.deliver_sound(SENTENCE, Prosody(range=1.4), 0)) == pytest.approx(1.4 * usual, rel=0.15)
    assert wide(voice.deliver_sound(SENTENCE, Prosody(range=0.6), 0)) == pytest.approx(0.6 * usual, rel=0.15)


def test_edges_of_heart_do_not_move_with_its_pitch(voice: NeuralVoice) -> None:
    usual, moved = voice.speak(SENTENCE), voice.deliver(SENTENCE, Prosody(pitch=3.0, range=1.3), 0)
    assert np.array_equal(usual.phones.edges, moved.phones.edges)
    faster = voice.speak(SENTENCE, rate=1.6)
    assert faster.phones.edges == pytest.approx(usual.phones.edges / 1.6, abs=1e-3)


def test_emphasis_of_heart(voice: NeuralVoice, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = voice.speak(SENTENCE)
    with_tones(monkeypatch, {2: Tone(emphasis=1.0)})
    strong = voice.speak(SENTENCE)
    spans = [speech.phones.edges[[speech.words[2].first, speech.words[2].last]] for speech in (usual, strong)]
    peaks = []
    for speech, (start, end) in zip((usual, strong), spans, strict=True):
        times, hertz = praat_f0(speech.waveform)
        peaks.append(np.quantile(hertz[(times > start) & (times < end)], 0.95))
    assert 12 * np.log2(peaks[1] / peaks[0]) > 2.0
    assert 1.1 < np.diff(spans[1]) / np.diff(spans[0]) < 1.4


@pytest.mark.parametrize("mark", [",", ";", "—", "…"])
@pytest.mark.parametrize("rate", [1.0, 1.5])
def test_heart_is_silent_at_marks_by_the_table(voice: NeuralVoice, mark: str, rate: float) -> None:
    pauses = []
    for text in ("The lamp is broken{} we need another one", "He came home{} she was gone", "We waited{} nobody came"):
        speech = voice.speak(text.format(f" {mark}" if mark == "—" else mark) + ".", rate=rate)
        at = {4: 3, 3: 2, 2: 1}[len(text.split("{")[0].split(" "))]
        silence = speech.phones.edges[[speech.words[at].last, speech.words[at + 1].first]].tolist()
        pauses.append(float(np.diff(quiet_span(sound_levels(speech.waveform), (silence[0], silence[1])))[0]))
    assert np.median(pauses) == pytest.approx(PAUSES_S[mark] / rate, rel=0.2)


class OneTone:
    """A voice of pulses at 110 Hz: a vowel of 0.3 s for each word, with silence around."""

    sample_rate = 16_000

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        texts = content.split() if isinstance(content, str) else [word.text for word in content]
        edges = np.concatenate([[0.0], 0.2 + 0.3 / rate * np.arange(len(texts) + 1)])
        samples = np.zeros(round(float(edges[-1] + 0.2) * self.sample_rate))
        samples[round(0.2 * self.sample_rate) : round(edges[-1] * self.sample_rate) : self.sample_rate // 110] = 0.5
        samples = np.convolve(samples, np.hanning(40), "same")
        phones = PhoneSequence([SILENCE, *["ɑ"] * len(texts), SILENCE], [*edges, len(samples) / self.sample_rate])
        words = tuple(WordSpan(text.strip(".?!,"), at, at + 1) for at, text in enumerate(texts, start=1))
        return Speech(Waveform(samples / np.abs(samples).max(), self.sample_rate), phones, words)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        return self.speak(content, rate=rate, seed=seed).waveform


@cache
def one_tone() -> OneTone:
    return OneTone()


def test_who_changes_the_pitch(voice: NeuralVoice) -> None:
    assert isinstance(voice, DeliveringVoice)
    assert not isinstance(one_tone(), DeliveringVoice)


def test_a_voice_of_one_pitch_is_left_alone_where_nothing_is_asked() -> None:
    plain = one_tone().speak("Paul saw Ann.")
    spoken = speak_with(one_tone(), "Paul saw Ann.", language="en-us")
    assert np.array_equal(spoken.waveform.samples, plain.waveform.samples)


@pytest.mark.parametrize("prosody", [Prosody(pitch=5.0), Prosody(pitch=-3.0, formants=0.9), Prosody(1.4, -2.0)])
def test_a_voice_of_one_pitch_gets_another(prosody: Prosody) -> None:
    spoken = speak_with(one_tone(), "Paul saw Ann.", prosody, language="de")
    assert median_f0(spoken.waveform) == pytest.approx(110 * 2 ** (prosody.pitch / 12), rel=0.03)
    assert spoken.phones.edges == pytest.approx(one_tone().speak("a b c").phones.edges / prosody.rate, abs=1e-3)
    sound = sound_with(one_tone(), "Paul saw Ann.", prosody, language="de")
    assert np.array_equal(sound.samples, spoken.waveform.samples)


def test_its_questions_rise_in_english() -> None:
    assert rise_at(speak_with(one_tone(), "Was Ann there?", language="en-gb"), -1) > 3.0
    assert rise_at(speak_with(one_tone(), "Why was Ann there?", language="en-gb"), -1) == pytest.approx(0.0, abs=0.5)
    plain = speak_with(one_tone(), "Was Ann da?", language="de")
    assert np.array_equal(plain.waveform.samples, one_tone().speak("Was Ann da?").waveform.samples)


def test_its_words_get_their_tones_and_edges_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    with_tones(monkeypatch, {1: Tone(emphasis=1.0), 3: Tone(pitch=3.0)})
    plain = one_tone().speak("Paul saw Ann there.")
    spoken = speak_with(one_tone(), "Paul saw Ann there.", language="en-us")
    longer = spoken.phones.durations / plain.phones.durations
    assert longer == pytest.approx([1.0, 1.0, 1.28, 1.0, 1.0, 1.0], abs=0.04)
    times, hertz = praat_f0(spoken.waveform)
    tops = [hertz[(times > span[0] + 0.05) & (times < span[1] - 0.05)].max() for span in zip(
        spoken.phones.edges[1:-2], spoken.phones.edges[2:-1], strict=True
    )]  # fmt: skip
    assert 12 * np.log2(np.array(tops) / 110) == pytest.approx([0, 4, 0.3, 3], abs=0.6)
