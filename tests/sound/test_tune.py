"""F0 of sentences, shaped by prosody, tones and movements: curves of which all is known."""

import numpy as np
import pytest

from lexicon.intonation import Movement
from lexicon.tones import EVEN, Tone
from tts2face.numeric.arrays import FloatArray
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.tune import HEIGHTS, PlacedWord, ShapedPitch, Tune, shape_pitch

TIMES = np.arange(0.0, 1.2, 0.0125)
F0 = 200.0 * 2 ** (np.sin(2 * np.pi * TIMES / 0.3) / 12)  # one semitone around 200 Hz
STARTS = (0.0, 0.3, 0.6, 0.9)


def words(*tones: Tone) -> list[PlacedWord]:
    """Four words of 0.3 s, whose vowels are their middle thirds."""
    return [
        PlacedWord(start, start + 0.3, (start + 0.1, start + 0.2), tone)
        for start, tone in zip(STARTS, [*tones, *[EVEN] * (4 - len(tones))], strict=True)
    ]


def shaped(prosody: Prosody = PLAIN_PROSODY, *tones: Tone, moves: tuple[Movement, ...] = ()) -> ShapedPitch:
    return shape_pitch(F0, TIMES, Tune(prosody, words(*tones), moves))


def semitones(found: ShapedPitch) -> FloatArray:
    """Semitones that were added at each time."""
    return np.asarray(12 * np.log2(found.f0 / F0), np.float64)


def at(second: float) -> int:
    return int(np.argmin(np.abs(TIMES - second)))


def test_nothing_asked_changes_nothing() -> None:
    assert Tune(Prosody(rate=1.5, formants=1.2), words()).is_plain
    assert np.array_equal(shaped(Prosody(1.3)).f0, F0)


def test_pitch_and_range_of_a_sentence() -> None:
    assert semitones(shaped(Prosody(pitch=-3.0))) == pytest.approx(np.full(len(TIMES), -3.0))
    wide = 12 * np.log2(shaped(Prosody(range=2.0)).f0 / 200)
    assert np.ptp(wide) == pytest.approx(2 * np.ptp(12 * np.log2(F0 / 200)), rel=1e-6)
    assert np.ptp(shaped(Prosody(range=0.0)).f0) < 1e-6


def test_pitch_range_and_contour_of_words() -> None:
    found = semitones(shaped(PLAIN_PROSODY, EVEN, Tone(pitch=4.0), Tone(pitch=4.0)))
    assert found[[at(0.1), at(0.45), at(0.6), at(0.8), at(1.1)]] == pytest.approx([0, 4, 4, 4, 0], abs=1e-6)
    line = Tone(contour=((0.0, 0.0), (0.5, 6.0), (1.0, 0.0)))
    found = semitones(shaped(PLAIN_PROSODY, EVEN, line, line))  # one contour over two words
    assert found[[at(0.45), at(0.6), at(0.75), at(1.1)]] == pytest.approx([3, 6, 3, 0], abs=0.3)
    flat = shaped(PLAIN_PROSODY, EVEN, Tone(range=0.0)).f0
    assert np.ptp(flat[at(0.35) : at(0.55)]) < 0.01 * np.ptp(F0)


def test_emphasis_is_a_peak_on_the_vowel_and_flatness_behind() -> None:
    found = semitones(shaped(PLAIN_PROSODY, EVEN, Tone(emphasis=1.0)))
    assert found.argmax() == pytest.approx(at(0.45), abs=1)
    assert found.max() == pytest.approx(4.0, abs=0.1)
    assert found[: at(0.2)] == pytest.approx(0.0)
    assert found[at(1.0) :].max() <= 1e-9
    lower = semitones(shaped(PLAIN_PROSODY, EVEN, Tone(emphasis=-1.0)))
    assert lower.min() == pytest.approx(-4.0, abs=0.1)


@pytest.mark.parametrize(("tune", "first"), [("rise", -1.5), ("item", -1.5), ("fall", 2.5)])
def test_movements_lead_to_their_height(tune: str, first: float) -> None:
    found = shaped(moves=(Movement(tune, 3, 3),))  # type: ignore[arg-type]
    ((start, end),) = found.moved
    above = 12 * np.log2(found.f0 / 200)
    assert above[start] == pytest.approx(first, abs=0.6)
    assert above[end - 1] == pytest.approx(HEIGHTS[tune], abs=0.3)
    assert semitones(found)[: at(0.8)] == pytest.approx(0.0)


def test_a_movement_within_a_sentence_comes_back_with_the_next_word() -> None:
    found = semitones(shaped(moves=(Movement("rise", 1, 1),)))
    assert found[at(0.58)] > 6
    assert found[at(0.75)] == pytest.approx(0.5 * found[at(0.6)], abs=2.5)
    assert found[at(0.95) :] == pytest.approx(0.0)


def test_unvoiced_frames_stay() -> None:
    voiced = np.where((TIMES > 0.5) & (TIMES < 0.6), 0.0, F0)
    found = shape_pitch(voiced, TIMES, Tune(Prosody(pitch=2.0), words()))
    assert (found.f0[voiced == 0] == 0).all()
    silent = np.zeros(len(TIMES))
    assert not shape_pitch(silent, TIMES, Tune(Prosody(pitch=2.0), words(), (Movement("rise", 3, 3),))).f0.any()
