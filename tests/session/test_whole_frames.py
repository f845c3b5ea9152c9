"""Sentences end where their sound ends, and frames follow: the sound of a text is the same at any frame rate."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from lexicon.sequence import SILENCE
from tests.tones import LetterVoice
from tts2face.gestures.elements import Gesture
from tts2face.gestures.timeline import Timeline
from tts2face.request import Idle, Listening, Request
from tts2face.session.joining import END_S
from tts2face.session.prepared import prepare
from tts2face.session.speech_stream import Piece, SpeechModels, measure_speech, spoken_pieces
from tts2face.sound.voice import SpeechInput
from tts2face.types import Speech, exact_rate, first_sample

RATES = (20.0, 23.976, 24.0, 25.0, 29.97, 30.0, 50.0, 60.0, 120.0)
TEXTS = (
    "One.",
    "One two. Three! Four five six? Seven.",
    "[pause 8] . [pause 8] . One. . [pause 9.5] . [pause 9.5] . Two. [pause 9] . [pause 9] .",
    "<speak>One. <break time='333ms'/> Two <break time='1s'/> three. Four.</speak>",
)


class AbruptVoice(LetterVoice):
    """A voice that ends with its last phone."""

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        speech = super().speak(content, rate=rate, seed=seed)
        phones = speech.phones
        end = float(phones.edges[-2])
        sound = speech.waveform.part(0, round(end * speech.waveform.rate))
        kept = type(phones)(phones.phones[:-1], [*phones.edges[:-2], sound.duration])
        return Speech(sound, kept, speech.words)


def pieces_of(text: str, fps: float, voice: LetterVoice, **options: bool) -> list[Piece]:
    prepared = prepare(Request(text=text, fps=fps))
    return list(spoken_pieces(prepared, SpeechModels(lambda *_: voice), **options))


def sound_of(pieces: list[Piece]) -> np.ndarray:
    return np.concatenate([piece.speech.waveform.samples for piece in pieces])


def word_times(pieces: list[Piece]) -> list[tuple[str, float, float]]:
    found = []
    for piece in pieces:
        edges = piece.begin + piece.speech.phones.edges
        found += [(word.text, edges[word.first], edges[word.last]) for word in piece.speech.words]
    return found


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("voice", [LetterVoice(), AbruptVoice(), LetterVoice(rate=22_050)])
@pytest.mark.parametrize("has_phones", [True, False])
def test_the_sound_of_a_text_is_the_same_at_any_rate(text: str, voice: LetterVoice, has_phones: bool) -> None:
    made = {fps: pieces_of(text, fps, voice, has_phones=has_phones) for fps in RATES}
    for fps, pieces in made.items():
        assert np.array_equal(sound_of(pieces), sound_of(made[30.0])), fps
        for found, expected in zip(word_times(pieces), word_times(made[30.0]), strict=True):
            assert found[0] == expected[0]
            assert found[1:] == pytest.approx(expected[1:], abs=2 / voice.sample_rate)


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("fps", [5.0, 23.976, 30.0])
@pytest.mark.parametrize("voice", [LetterVoice(), AbruptVoice()])
def test_pieces_begin_on_frames_with_the_sound_of_these(text: str, fps: float, voice: LetterVoice) -> None:
    exact, frame, n_samples = exact_rate(fps), 0, 0
    for piece in pieces_of(text, fps, voice):
        assert piece.begin == pytest.approx(float(frame / exact), abs=1e-9)
        assert n_samples == first_sample(frame, voice.sample_rate, exact)
        frame += len(piece.clip.motion)
        n_samples += len(piece.speech.waveform.samples)
    left = Fraction(frame) / exact - Fraction(n_samples, voice.sample_rate)
    assert -0.01 / fps <= left < 1 / fps  # the last frame may be longer than its sound


def test_a_part_of_a_longer_clip_ends_on_a_frame() -> None:
    voice = LetterVoice()
    for piece in pieces_of(TEXTS[1], 23.976, voice, ends_on_frame=True):
        n_samples = len(piece.clip.motion) / exact_rate(23.976) * voice.sample_rate
        assert len(piece.speech.waveform.samples) == pytest.approx(float(n_samples), abs=1)


def test_frames_longer_than_the_silence_after_a_sentence_lose_no_sound() -> None:
    expected = np.count_nonzero(sound_of(pieces_of(TEXTS[1], 30.0, AbruptVoice())))
    for fps in (1.0, 2.0, 5.0, 12.0):
        assert np.count_nonzero(sound_of(pieces_of(TEXTS[1], fps, AbruptVoice()))) == expected


def test_a_sentence_ends_in_silence() -> None:
    *others, last = pieces_of(TEXTS[1], 120.0, AbruptVoice())
    assert others
    assert last.speech.phones.phones[-1] == SILENCE
    assert float(np.diff(last.speech.phones.edges)[-1]) == pytest.approx(END_S, abs=0.001)


def test_what_is_left_before_silent_sentences_is_kept() -> None:
    pieces = pieces_of("One. Two. ...", 23.976, LetterVoice())
    assert np.array_equal(sound_of(pieces)[: len(sound_of(pieces_of("One. Two.", 30.0, LetterVoice())))],
                          sound_of(pieces_of("One. Two.", 30.0, LetterVoice())))  # fmt: skip


def test_a_style_that_reaches_the_end_of_a_sentence_goes_on_at_the_next_frame() -> None:
    pieces = pieces_of("[style:delighted]One two. Three four.[/style] Five.", 23.976, LetterVoice())
    first, second = (piece.timeline.spans for piece in pieces[:2])
    assert {span.feature for span in first} == {span.feature for span in second}
    assert {span.start for span in second} == {pieces[1].begin}


def test_measured_speech_is_that_of_the_clip() -> None:
    for fps in (1.0, 2.0, 5.0, 12.0, 23.976, 30.0):
        for voice in (LetterVoice(), AbruptVoice()):
            pieces = pieces_of(TEXTS[1], fps, voice)
            span = measure_speech(prepare(Request(text=TEXTS[1], fps=fps)), SpeechModels(lambda *_, voice=voice: voice))
            times = word_times(pieces)
            assert (span.begin, span.end) == pytest.approx((times[0][1], times[-1][2]), abs=1e-4)
            assert span.total == pytest.approx(len(sound_of(pieces)) / voice.sample_rate, abs=1e-3)


def test_the_phones_of_a_sentence_are_those_that_were_spoken() -> None:
    """So edges that are corrected by hand at one frame rate fit at another one."""
    expected = [piece.sentence for piece in pieces_of(TEXTS[1], 30.0, AbruptVoice())]
    for fps in RATES:
        pieces = pieces_of(TEXTS[1], fps, AbruptVoice())
        for piece, phones in zip(pieces, expected, strict=True):
            assert piece.sentence is not None
            assert phones is not None
            assert piece.sentence.phones == phones.phones
            np.testing.assert_allclose(
                piece.sentence.edges - piece.sentence.start, phones.edges - phones.start, atol=1e-9
            )


@pytest.mark.parametrize("fps", [23.976, 27.3, 29.97, 30.0, 59.94])
@pytest.mark.parametrize("n_frames", [8, 9, 13])
def test_parts_without_an_end_do_not_drift(fps: float, n_frames: int) -> None:
    """Hundreds of waits in a live clip last as long as was asked for."""
    exact, frame = exact_rate(fps), 0
    prepared = prepare(Request(source=Idle(float(n_frames / exact)), fps=fps))
    for _ in range(100):
        pieces = list(spoken_pieces(prepared, SpeechModels(lambda *_: LetterVoice()), frame, ends_on_frame=True))
        frame += sum(len(piece.clip.motion) for piece in pieces)
    assert frame == 100 * n_frames


@pytest.mark.parametrize("fps", [20.0, 23.976, 24.0, 25.0, 30.0, 60.0])
def test_a_nod_in_the_last_part_of_a_frame_comes_with_the_next_piece(fps: float) -> None:
    nods = [Gesture(at / 100) for at in range(5, 2500, 3)]
    prepared = replace(prepare(Request(source=Listening(25.0), fps=fps)), listening=Timeline(gestures=tuple(nods)))
    pieces = list(spoken_pieces(prepared, SpeechModels(lambda *_: LetterVoice())))
    assert len(pieces) > 2
    found = [nod.time for piece in pieces for nod in piece.timeline.gestures]
    assert found == pytest.approx([nod.time for nod in nods], abs=1e-9)
