"""Reduced forms of function words in connected speech (to, the, of), by the sound that follows.

The forms of ``function_words.tsv`` are those of misaki's American dictionary, with which the neural voice was trained;
those of ``weak_forms.tsv`` people may say in their place (Roach 2009, ch. 12; Wells 2008): a recording has one or the
other.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

from lexicon.dictionary import word_key, word_set
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.phones import PHONES
from lexicon.written_forms import read_table

_DEMONSTRATIVE_BEFORE = word_set("of for with at like about after before in on by from than")
_DEMONSTRATIVE_AFTER = word_set("is was will would could may might must one sounds looks means makes")
# Last phones that a word does not have before a consonant, and before a vowel (Roach 2009, ch. 12; Wells 2008): a sound
# decides badly between them, as both are short and take the place of the next sound (decision 235).
_NOT_BEFORE_CONSONANT = {"the": frozenset({"i"})}
_NOT_BEFORE_VOWEL = {"to": frozenset({"ə", "ɪ"})}
_ALWAYS_REDUCED = frozenset({"a", "an", "am", "the", "to", "in"})  # also where they begin a sentence


@dataclass(frozen=True, slots=True)
class _Forms:
    before_consonant: tuple[IpaPhone, ...]
    before_vowel: tuple[IpaPhone, ...]
    before_pause: tuple[IpaPhone, ...]


@functools.cache
def _forms() -> dict[str, _Forms]:
    found = {}
    for word, written in read_table("function_words.tsv").items():
        plain, vowel, pause = (parse_ipa(cell) if cell else () for cell in written)
        found[word] = _Forms(plain, vowel or plain, pause or plain)
    return found


@functools.cache
def _weak_forms() -> dict[str, tuple[tuple[str, ...], ...]]:
    return {
        word: tuple(tuple(segment.phone for segment in parse_ipa(form)) for form in forms.split())
        for word, (forms,) in read_table("weak_forms.tsv").items()
    }


def weak_forms(word: str) -> tuple[tuple[str, ...], ...]:
    """Phones of each weak form of a function word; none of other words."""
    return _weak_forms().get(word_key(word), ())


def is_function_word(word: str) -> bool:
    """Whether a word is one of the tables of this module."""
    key = word_key(word)
    return key in _forms() or key in _weak_forms()


def fitting_forms(
    words: Sequence[tuple[str, Sequence[tuple[str, ...]]]],
) -> tuple[tuple[str, tuple[tuple[str, ...], ...]], ...]:
    """English words with those of their pronunciations that the sound after them allows: /ðə/ cat, /ði/ apple.

    Parameters
    ----------
    words
        Words in order with their alternative pronunciations in phones; words that may begin with a vowel or with a
        consonant, and ends, allow all.
    """
    found = []
    for at, (word, forms) in enumerate(words):
        following = words[at + 1][1] if at + 1 < len(words) else ()
        first_is_vowel = {PHONES[phones[0]].is_vowel for phones in following if phones}
        barred: frozenset[str] = frozenset()
        if len(first_is_vowel) == 1:
            table = _NOT_BEFORE_VOWEL if True in first_is_vowel else _NOT_BEFORE_CONSONANT
            barred = table.get(word_key(word), barred)
        # what a user's dictionary says stays, whatever follows
        fitting = tuple(form for form in forms if form[-1] not in barred)
        found.append((word, fitting or tuple(forms)))
    return tuple(found)


def reduced_segments(
    word: str, before: str, after: str, following: tuple[IpaPhone, ...]
) -> tuple[IpaPhone, ...] | None:
    """Phones of a function word in its context; None for any other word.

    A capitalised one, as at the beginning of a sentence, has secondary stress.

    Parameters
    ----------
    before, after
        The words beside it; empty after and before a pause.
    following
        Phones of the word after it; empty before a pause.
    """
    key = word_key(word)
    forms = _forms().get(key)
    if forms is None:
        return None
    if not following or (key == "that" and _is_demonstrative(word_key(before), word_key(after))):
        segments = forms.before_pause
    else:
        segments = forms.before_vowel if following[0].is_syllabic else forms.before_consonant
    if word[:1].isupper() and key not in _ALWAYS_REDUCED and not any(segment.stress for segment in segments):
        return tuple(IpaPhone(s.phone, 2 if s.is_syllabic else 0, s.is_long, s.is_syllabic) for s in segments)
    return segments


def _is_demonstrative(before: str, after: str) -> bool:
    return not before or before in _DEMONSTRATIVE_BEFORE or after in _DEMONSTRATIVE_AFTER
