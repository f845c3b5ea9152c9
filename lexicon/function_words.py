"""Reduced forms of function words in connected speech (to, the, of), by the sound that follows.

The forms of ``function_words.tsv`` are those of misaki's American dictionary, with which the neural voice was trained;
those of ``weak_forms.tsv`` people may say in their place (Roach 2009, ch. 12; Wells 2008): a recording has one or the
other.
"""

import functools
from dataclasses import dataclass

from lexicon.dictionary import word_key, word_set
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.written_forms import read_table

_DEMONSTRATIVE_BEFORE = word_set("of for with at like about after before in on by from than")
_DEMONSTRATIVE_AFTER = word_set("is was will would could may might must one sounds looks means makes")
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
