"""Where syllables begin: the longest onset that the language allows goes to the following vowel."""

from collections.abc import Sequence
from itertools import pairwise
from types import MappingProxyType

from lexicon.ipa import Segment
from lexicon.phones import PHONES

# English onsets of two and three consonants (Cruttenden, Gimson's Pronunciation of English, chapter on clusters).
_ONSET_PAIRS = MappingProxyType({
    "ɹ": "p b t d k ɡ f θ ʃ", "l": "p b k ɡ f s", "w": "t d k ɡ θ s h", "j": "p b k ɡ f v m n h s l t d θ",
    "p": "s", "t": "s", "k": "s", "m": "s", "n": "s", "f": "s",
})  # fmt: skip
ENGLISH_ONSETS = frozenset(
    {(first, second) for second, firsts in _ONSET_PAIRS.items() for first in firsts.split()}
    | {("s", "p", "ɹ"), ("s", "p", "l"), ("s", "p", "j"), ("s", "t", "ɹ"), ("s", "t", "j"), ("s", "k", "ɹ")}
    | {("s", "k", "l"), ("s", "k", "w"), ("s", "k", "j")}
)
_SONORITY = MappingProxyType({
    "stop": 0, "click": 0, "affricate": 0, "fricative": 1, "nasal": 2, "lateral": 3, "tap": 3, "trill": 3,
    "approximant": 4,
})  # fmt: skip


def _is_english_onset(onset: tuple[str, ...]) -> bool:
    return (len(onset) == 1 and onset[0] != "ŋ") or onset in ENGLISH_ONSETS


def _is_sonority_rising(onset: tuple[str, ...]) -> bool:
    """Sonority rises towards the vowel: the rule for languages without a table of their own."""
    steps = [_SONORITY[PHONES[phone].kind] for phone in onset]
    return all(low < high for low, high in pairwise(steps))


def split_syllables(segments: Sequence[Segment], *, is_english: bool) -> tuple[tuple[int, int], ...]:
    """Half-open ranges of the phones of each syllable; a word without vowel is one syllable.

    Consonants before the first vowel and behind the last one belong to the first and the last syllable.
    """
    is_legal = _is_english_onset if is_english else _is_sonority_rising
    middles = [at for at, segment in enumerate(segments) if segment.is_syllabic]
    starts = [0]
    for before, middle in pairwise(middles):
        start = middle
        while start - 1 > before and is_legal(tuple(s.phone for s in segments[start - 1 : middle])):
            start -= 1
        starts.append(start)
    return tuple(zip(starts, [*starts[1:], len(segments)], strict=True)) if segments else ()
