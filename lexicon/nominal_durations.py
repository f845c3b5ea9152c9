"""Nominal phone durations by class, for phones without sound.

Rounded values of read English that give tables and TextGrids a time axis; they are not predictions. With sound, the
durations of the voice or of an alignment are used instead.
"""

from types import MappingProxyType

from lexicon.phones import PHONES
from lexicon.pronounce import Pronunciation
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan

NOMINAL_S = MappingProxyType({
    "vowel": 0.09, "diphthong": 0.14, "stop": 0.07, "affricate": 0.11, "fricative": 0.09, "nasal": 0.07,
    "approximant": 0.06, "lateral": 0.06, "tap": 0.03, "trill": 0.07, "click": 0.08,
})  # fmt: skip
STRESS_FACTOR = 1.3  # stressed vowels are longer by this factor
LEADING_SILENCE_S = 0.1  # s of silence before the first word and, at least, after the last


def nominal_phones(pronunciation: Pronunciation) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones, with a silence at each punctuation mark, and words as ranges of phones."""
    phones, edges = [SILENCE], [0.0, LEADING_SILENCE_S]
    spans = []
    for word in pronunciation.words:
        first = len(phones)
        for phone, stress in zip(word.phones, word.stress, strict=True):
            phones.append(phone)
            # microseconds: sums of decimals have rests in their last bits
            edges.append(round(edges[-1] + NOMINAL_S[PHONES[phone].kind] * (STRESS_FACTOR if stress else 1.0), 6))
        spans.append(WordSpan(word.text, first, len(phones)))
        pause = max(word.pause_s, LEADING_SILENCE_S if word is pronunciation.words[-1] else 0.0)
        if pause:
            phones.append(SILENCE)
            edges.append(round(edges[-1] + pause, 6))
    return PhoneSequence(phones, edges), tuple(spans)
