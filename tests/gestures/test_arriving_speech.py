"""Plans of sound that arrives: sentences open and close, accents stay, nothing that was planned moves."""

import numpy as np
import pytest

from tts2face.gestures.arriving_speech import END_PAUSE_S, PEAK_KNOWN_S, ArrivingSpeech
from tts2face.gestures.phrase_motion import PhraseMotion
from tts2face.gestures.speech_plan import SpeechPlan, SpokenSentence

RATE, AHEAD_S = 16_000, 0.24
ONSETS = (0.5, 2.5)  # of two sentences of a second
SYLLABLES = (0.15, 0.55, 0.9)  # loud places in each


def two_sentences() -> np.ndarray:
    """Pulses at 120 Hz, louder at the syllables, with silence around two sentences."""
    times = np.arange(round(4.5 * RATE)) / RATE
    level = np.zeros(len(times))
    for onset in ONSETS:
        inside = (times >= onset) & (times < onset + 1.0)
        bells = sum(np.exp(-0.5 * np.square((times - onset - at) / 0.05)) for at in SYLLABLES)
        level += inside * (0.1 + 0.4 * bells)
    return (level * np.sign(np.sin(2 * np.pi * 120 * times))).astype(np.float32)


def plans(block_s: float) -> list[tuple[float, SpeechPlan]]:
    """Plans of blocks, in seconds of the sound, of which `AHEAD_S` behind each is known."""
    speech, sound, found, given = ArrivingSpeech(RATE), two_sentences(), [], 0
    for start in np.arange(0.0, len(sound) / RATE, block_s).tolist():
        until = min(round((start + block_s + AHEAD_S) * RATE), len(sound))
        speech.add(sound[given:until])
        given = until
        found.append((start, speech.plan(start, is_ended=given == len(sound)).shift(start)))
    return found


def sentences(found: list[tuple[float, SpeechPlan]]) -> list[tuple[float, SpokenSentence]]:
    return [(start, sentence) for start, plan in found for sentence in plan.sentences]


@pytest.mark.parametrize("block_s", [0.033, 0.1, 0.4])
def test_sentences_begin_and_end_once_when_that_is_known(block_s: float) -> None:
    found = sentences(plans(block_s))
    closed = [(start, sentence) for start, sentence in found if not sentence.is_open]
    assert [sentence.span.start for _, sentence in closed] == pytest.approx(ONSETS, abs=0.08)
    assert [sentence.span.end for _, sentence in closed] == pytest.approx([onset + 1.0 for onset in ONSETS], abs=0.12)
    opened = [next(start for start, sentence in found if sentence.span.start > onset - 0.2) for onset in ONSETS]
    delays = [start - onset for start, onset in zip(opened, ONSETS, strict=True)]
    assert min(delays) >= -(block_s + AHEAD_S)
    assert max(delays) < 0.2
    late = [start - sentence.span.end for start, sentence in closed]
    assert max(late) < END_PAUSE_S + block_s + 0.1


def test_accents_are_the_loud_places_and_stay() -> None:
    """Each is known soon behind its peak, and is part of all later plans of its sentence."""
    before: tuple[float, ...] = ()
    known: dict[float, float] = {}
    for start, sentence in sentences(plans(0.1)):
        times = tuple(accent.time for accent in sentence.accents)
        if sentence.span.start < 2.0:
            assert times[: len(before)] == before
            before = times
        for time in times:
            known.setdefault(time, start + 0.1 + AHEAD_S)
    expected = [onset + at for onset in ONSETS for at in SYLLABLES]
    assert all(min(abs(time - at) for at in expected) < 0.08 for time in known)
    assert len(known) >= 4
    assert max(end - time for time, end in known.items()) < PEAK_KNOWN_S + 0.5


def test_silence_has_no_plan() -> None:
    speech = ArrivingSpeech(RATE)
    assert speech.plan(0.0).sentences == ()
    speech.add(np.zeros(RATE, np.float32))
    assert speech.plan(0.5).sentences == ()


@pytest.mark.parametrize("block_s", [0.033, 0.2])
def test_head_and_brows_follow_without_a_jump_and_come_back(block_s: float) -> None:
    motion, found = PhraseMotion([3]), []
    for start, plan in plans(block_s):
        motion.add(plan, start)
        found.append(motion.at(np.arange(start, start + block_s - 1e-9, 1 / 120)))
    for extra in np.arange(4.5, 6.5, 0.1).tolist():
        motion.add(SpeechPlan(), extra)
        found.append(motion.at(np.arange(extra, extra + 0.1 - 1e-9, 1 / 120)))
    moved = np.concatenate(found)
    assert np.abs(np.diff(moved, axis=0)).max() < 0.5  # degrees and mm in 8 ms
    assert np.ptp(moved[:, 0]) > 1.0
    assert moved[:, 3].max() > 0.3
    assert np.abs(moved[-1]).max() < 0.05


def test_a_sentence_that_breaks_off_is_left() -> None:
    """After an interruption another sentence begins, and the head comes back from the first one."""
    motion = PhraseMotion([3])
    for start, plan in plans(0.1)[:9]:
        motion.add(plan, start)
    assert motion._open is not None
    motion.add(SpeechPlan(), 1.0)
    for start, plan in plans(0.1):
        motion.add(plan.shift(10.0), start + 10.0)
    assert motion._open is None
    assert np.abs(motion.at(np.array([18.0]))).max() < 0.05
