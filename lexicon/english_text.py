"""Phones of the words of an English text in context: homographs, initialisms, reduced function words."""

from collections.abc import Sequence
from itertools import pairwise

from lexicon.dictionary import Dictionary
from lexicon.english import CAPITALISED_WORDS, fold_to_arpabet, is_initialism, look_up_word
from lexicon.function_words import reduced_segments
from lexicon.g2p import DEFAULT_LANGUAGE, segments_by_rules
from lexicon.homographs import homograph_segments, is_homograph
from lexicon.ipa import IpaPhone

_SENTENCE_MARKS = frozenset(".!?")


def english_segments(texts: Sequence[str], marks: Sequence[str], own: Dictionary) -> list[tuple[IpaPhone, ...]]:
    """Phones of each word of a normalised text; empty for a word that cannot be read.

    Parameters
    ----------
    texts, marks
        Words, and the punctuation after each.
    own
        The user's entries, which take precedence.
    """
    spoken: list[tuple[IpaPhone, ...] | None] = []
    forms = _lookup_forms(texts)
    ends = [at + 1 for at, mark in enumerate(marks) if mark in _SENTENCE_MARKS]
    for start, end in pairwise(sorted({0, *ends, len(texts)})):
        spoken += _sentence_segments(forms[start:end], marks[start:end], own)
    missing = [at for at, segments in enumerate(spoken) if segments is None]
    by_rules = segments_by_rules([texts[at] for at in missing], DEFAULT_LANGUAGE)
    for at, segments in zip(missing, by_rules, strict=True):
        spoken[at] = fold_to_arpabet(segments)
    return _reduce_function_words(texts, forms, marks, [segments or () for segments in spoken], own)


def _sentence_segments(
    forms: Sequence[str], marks: Sequence[str], own: Dictionary
) -> list[tuple[IpaPhone, ...] | None]:
    """Phones of the words of one sentence; None where spelling rules are needed."""
    tokens: list[str] = []
    places: list[int] = []
    for form, mark in zip(forms, marks, strict=True):
        places.append(len(tokens))
        tokens += [form, mark] if mark else [form]
    several = {
        places[at]
        for at, form in enumerate(forms)
        if own.lookup(form) is None and is_homograph(form) and not is_initialism(form)
    }
    by_context = homograph_segments(tokens, several)
    return [
        by_context[place]
        if place in several
        else look_up_word(form, is_letter=_is_letter(forms, marks, at), own=own.lookup)
        for at, (form, place) in enumerate(zip(forms, places, strict=True))
    ]


def _is_letter(forms: Sequence[str], marks: Sequence[str], at: int) -> bool:
    """Whether a single capital is the name of a letter (plan A) rather than the article."""
    following = forms[at + 1] if at + 1 < len(forms) else ""
    is_before_word = following[:1].islower() or (len(following) > 1 and is_initialism(following))  # a UFO
    return forms[at].isupper() and not (forms[at] == "A" and not marks[at] and is_before_word)


def _reduce_function_words(
    texts: Sequence[str],
    forms: Sequence[str],
    marks: Sequence[str],
    spoken: list[tuple[IpaPhone, ...]],
    own: Dictionary,
) -> list[tuple[IpaPhone, ...]]:
    """Replace the citation forms of function words, from the last word to the first."""
    for at in reversed(range(len(texts))):
        is_letter = forms[at] == "A" and _is_letter(forms, marks, at)
        is_spelled = is_letter or (len(forms[at]) > 1 and is_initialism(forms[at]))
        if is_spelled or own.lookup(texts[at]) is not None:
            continue
        following = () if marks[at] or at + 1 == len(texts) else spoken[at + 1]
        before = "" if at == 0 or marks[at - 1] else texts[at - 1]
        reduced = reduced_segments(texts[at], before, texts[at + 1] if following else "", following)
        spoken[at] = reduced or spoken[at]
    return spoken


def _lookup_forms(texts: Sequence[str]) -> list[str]:
    """Lookup forms of words: words in capitals that are not initialisms become lower case."""
    padded = ["", *texts, ""]
    return [
        text.lower() if len(text) > 1 and CAPITALISED_WORDS & {before, text, after} and text.isupper() else text
        for before, text, after in zip(padded, padded[1:], padded[2:], strict=False)
    ]
