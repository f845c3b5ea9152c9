"""What a text says is found in its speech: sentences, phrases, accents, questions, lists and contrasts."""

import numpy as np
import pytest

from lexicon.given_phones import TextWord
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.tones import Tone
from tts2face.gestures.phrase_motion import PhraseMotion
from tts2face.gestures.speech_plan import SpeechPlan, plan_speech
from tts2face.sound.praat import pitch
from tts2face.sound.quick_pitch import semitones
from tts2face.types import Speech, Waveform

RATE = 16_000


def spoken(text: str, *, said: tuple[TextWord, ...] | None = None) -> SpeechPlan:
    """Plan of a text whose words last .3 s, with a pause of .3 s behind commas and .6 s behind sentences."""
    words = said or tuple(map(TextWord, text.split()))
    phones, edges, spans = ["sil"], [0.0, 0.3], list[WordSpan]()
    for word in words:
        spans.append(WordSpan(word.text.strip(".,?!"), len(phones), len(phones) + 3))
        phones += ["b", "ɑ", "d"]
        edges += [edges[-1] + 0.08, edges[-1] + 0.24, edges[-1] + 0.3]
        if word.text[-1] in ".,?!":
            phones.append("sil")
            edges.append(edges[-1] + (0.3 if word.text[-1] == "," else 0.6))
    times = np.arange(round(edges[-1] * RATE)) / RATE
    inside = np.array([label != "sil" for label in phones])[np.searchsorted(edges, times, side="right") - 1]
    sound = Waveform(0.3 * inside * np.sin(2 * np.pi * 120 * times) * (1 + 0.3 * np.sin(7 * times)) / 1.3, RATE)
    return plan_speech(Speech(sound, PhoneSequence(phones, edges), tuple(spans)), words, "en-us")


def test_sentences_and_phrases_end_at_marks_and_before_clauses() -> None:
    plan = spoken("Nobody was there, but somebody had made tea. The man was cold and the woman laughed about it.")
    first, second = plan.sentences
    assert [len(sentence.phrases) for sentence in plan.sentences] == [2, 2]
    assert first.span.start == pytest.approx(0.3)
    assert second.span.start - first.span.end == pytest.approx(0.6)
    assert second.phrases[0].end == second.phrases[1].start  # without a pause
    assert first.question is None


def test_accents_are_those_of_content_words() -> None:
    (sentence,) = spoken("Nobody was in the kitchen.").sentences
    middles = [0.3 + 0.3 * at + 0.16 for at in (0, 4)]
    assert {round(accent.time, 3) for accent in sentence.accents} <= {round(middle, 3) for middle in middles}


@pytest.mark.parametrize(
    ("text", "asks", "rises"),
    [("Is it true?", True, True), ("Who has told you that?", True, False), ("It is true.", False, False)],
)
def test_questions_are_shown_at_their_end(text: str, asks: bool, rises: bool) -> None:
    (sentence,) = spoken(text).sentences
    assert (sentence.question is not None, sentence.rises) == (asks, rises)
    if sentence.question is not None:
        assert sentence.question.end == sentence.span.end


def test_lists_are_counted_and_contrasts_have_two_sides() -> None:
    (listed,) = spoken("We bought apples, pears, plums and cherries.").sentences
    assert len(listed.items) == 4
    ((denied, said),) = spoken("It is not the red car, but the blue car.").sentences[0].sides
    assert denied.end <= said.start
    assert len(spoken("Do you want tea or coffee?").sentences[0].sides) == 1
    assert len(spoken("It is not his car, it is hers.").sentences[0].sides) == 1
    assert spoken("I do not know, she said.").sentences[0].sides == ()


def test_emphasis_has_the_greatest_weight() -> None:
    said = (TextWord("I"), TextWord("want", tone=Tone(1.0)), TextWord("tea."))
    (sentence,) = spoken("", said=said).sentences
    strong = max(sentence.accents, key=lambda accent: accent.prominence)
    assert strong.emphasis == 1.0


def test_sound_alone_has_phrases_and_accents() -> None:
    times = np.arange(5 * RATE) / RATE
    loud = (times % 2.5 < 1.8) * (0.4 + 0.6 * (np.abs(times % 2.5 - 0.9) < 0.12))
    plan = plan_speech(Speech.without_phones(Waveform(0.4 * loud * np.sin(2 * np.pi * 150 * times), RATE)), (), "en-us")
    assert [round(sentence.span.start, 1) for sentence in plan.sentences] == [0.0, 2.5]
    for sentence, peak in zip(plan.sentences, (0.9, 3.4), strict=True):
        assert min(abs(accent.time - peak) for accent in sentence.accents) < 0.15


def test_sound_that_rises_at_its_end_asks() -> None:
    times = np.arange(2 * RATE) / RATE
    for height, asks in ((9.0, True), (0.0, False)):
        hertz = 150 * 2 ** (height * np.clip((times - 1.5) / 0.3, 0.0, 1.0) / 12)
        phase = 2 * np.pi * np.cumsum(hertz) / RATE
        voice = 0.2 * sum(np.sin(k * phase) / k for k in range(1, 6)) * (times < 1.8)
        (sentence,) = plan_speech(Speech.without_phones(Waveform(voice, RATE)), (), "en-us").sentences
        assert (sentence.question is not None) == asks


def test_silence_says_nothing() -> None:
    assert plan_speech(Speech.without_phones(Waveform(np.zeros(RATE), RATE)), (), "en-us").sentences == ()


def test_the_head_rises_as_a_sentence_begins_and_falls_on_its_last_accent() -> None:
    text = "The birch canoe slid on the smooth planks beside the parked truck."
    plan = spoken(text)
    (sentence,) = plan.sentences
    span = sentence.span
    moved = []
    times = np.array([0.0, *(span.start + np.array([0.25, 1.0]) * (span.end - span.start))])
    for seed in range(40):
        motion = PhraseMotion([seed])
        motion.add(plan, 0.0)
        moved.append(motion.at(times))
    before, early, late = np.mean(moved, axis=0)
    np.testing.assert_allclose(before, 0.0, atol=1e-9)
    assert early[0] < -0.9 < 0.9 < late[0]  # chin up, chin down
    assert early[3] > 0.4 > -0.4 > late[3]  # brows up, brows down
    assert early[3] == pytest.approx(early[4], abs=0.2)


def test_movements_begin_smoothly_and_end_at_rest_whatever_the_pieces() -> None:
    plan = spoken("Nobody was there, but somebody had made tea. It is not the red car, but the blue car.")
    motion = PhraseMotion([3])
    motion.add(plan, 0.0)
    times = np.arange(0.0, 12.0, 1 / 60)
    found = motion.at(times)
    np.testing.assert_allclose(found[-1], 0.0, atol=1e-6)
    assert np.abs(np.diff(found, axis=0))[:, :3].max() < 1.2  # degrees in a sixtieth of a second
    motion.add(SpeechPlan(), 30.0)
    np.testing.assert_allclose(motion.at(times + 30.0), 0.0, atol=1e-6)
    copied = motion.copy()
    copied.add(plan.shift(30.0), 30.0)
    np.testing.assert_allclose(motion.at(times + 30.0), 0.0, atol=1e-6)


def test_quick_pitch_is_that_of_praat() -> None:
    times = np.arange(2 * RATE) / RATE
    hertz = 180 + 50 * np.sin(3 * times)
    phase = 2 * np.pi * np.cumsum(hertz) / RATE
    sound = Waveform(0.2 * sum(np.sin(k * phase) / k for k in range(1, 6)), RATE)
    at = np.arange(0.1, 1.9, 0.03)
    np.testing.assert_allclose(semitones(sound, at), pitch(sound, at), atol=0.4)
    assert np.isnan(semitones(Waveform(np.zeros(RATE), RATE), at)).all()
