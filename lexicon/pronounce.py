"""Pronounce text: words with phones, stress and syllables, in English by the words around them."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

from lexicon.british import LANGUAGE as BRITISH
from lexicon.british import british_segments, has_british
from lexicon.dictionary import Dictionary
from lexicon.english import CAPITALISED_WORDS, fold_to_arpabet, is_initialism, look_up_word
from lexicon.errors import InputError, SilentTextError
from lexicon.espeak_words import words_by_espeak
from lexicon.function_words import reduced_segments
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.homographs import homograph_segments, is_homograph
from lexicon.ipa import IpaPhone
from lexicon.languages import language_code
from lexicon.normalize import split_tokens, spoken_form, spoken_forms
from lexicon.pauses import MARKS, PAUSES_S
from lexicon.phones import PHONES, ipa_to_arpabet
from lexicon.scripts import check_script
from lexicon.sources import sources_of
from lexicon.tones import EVEN, Tone
from lexicon.unlisted_words import read_unlisted_words
from lexicon.vowels import without_vowels

NOTHING = "there is nothing to say in the text; add at least one word or number"
_MARKS_BY_STRENGTH = tuple(PAUSES_S)  # of two adjacent marks the later one of this order is kept
_PIECE = re.compile(r"[^\s.,;:!?—…]+|[.,;:!?—…]")
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
_SENTENCE_MARKS = frozenset(".!?")


@dataclass(frozen=True, slots=True)
class Word:
    """One spoken word.

    Parameters
    ----------
    text
        Spoken word (five).
    source
        Written form of the word ($5); several words may share one.
    phones : N symbols of the phone table
    stress : N digits
        1 primary, 2 secondary, 0 none; 0 for consonants.
    syllables : pairs
        Half-open ranges of phones, without gap from 0 to N.
    mark
        Punctuation after the word, or empty.
    arpabet : N names, English only
        ARPABET with stress digits; empty for other languages.
    tone
        How it is said.
    """

    text: str
    source: str
    phones: tuple[str, ...]
    stress: tuple[int, ...]
    syllables: tuple[tuple[int, int], ...]
    mark: str = ""
    arpabet: tuple[str, ...] = ()
    tone: Tone = EVEN

    @property
    def pause_s(self) -> float:
        """Nominal seconds of silence after the word."""
        return PAUSES_S[self.mark]

    @property
    def ipa(self) -> str:
        """The word in IPA with stress marks before stressed syllables and dots between the others."""
        pieces = []
        for at, (first, last) in enumerate(self.syllables):
            stress = max(self.stress[first:last])
            pieces += [("", "ˈ", "ˌ")[stress] or ("." if at else ""), *self.phones[first:last]]
        return "".join(pieces)


@dataclass(frozen=True, slots=True)
class Pronunciation:
    """Words of a text in order, in the language of their pronunciation."""

    text: str
    language: str
    words: tuple[Word, ...]

    @property
    def phones(self) -> tuple[str, ...]:
        """All phones in order, without pauses."""
        return tuple(phone for word in self.words for phone in word.phones)


@dataclass(slots=True)
class _WordDraft:
    text: str
    source: str
    mark: str = ""
    segments: tuple[IpaPhone, ...] | None = None


def _split_words(forms: Iterator[tuple[str, str]]) -> list[_WordDraft]:
    """Words of (written, spoken) pairs, each with the punctuation after it."""
    words: list[_WordDraft] = []
    for written, spoken in forms:
        for piece in _PIECE.findall(spoken):
            if piece not in MARKS:
                words.append(_WordDraft(piece, written.strip(" .,;:!?—…") or piece))
            elif words:
                words[-1].mark = max(words[-1].mark, piece, key=_MARKS_BY_STRENGTH.index)
    return words


def _words_by_espeak(text: str, language: str) -> list[_WordDraft]:
    """Words of a text, as far as it is no English, as they are written, with the phones that espeak-ng speaks."""
    spoken = spoken_form(text, language)
    found = [
        (without_vowels(word.text, language), word.mark, own) for word, own in words_by_espeak(spoken, language)
    ]  # as they are written
    words = [_WordDraft(written, written, mark, own) for written, mark, own in found]
    if not language.startswith("en"):
        sources = sources_of([word.text for word in words], spoken_forms(text, language))
        for word, (_, source) in zip(words, sources or (), strict=False):
            word.source = source
    if language.partition("-")[0] == "en":
        normalised = _split_words((token.source, token.spoken) for token in split_tokens(text))
        if len(normalised) == len(words):
            words = [replace(word, source=own.source) for word, own in zip(words, normalised, strict=True)]
    return words


def _is_english_onset(onset: tuple[str, ...]) -> bool:
    # no English syllable starts with ŋ
    return (len(onset) == 1 and onset[0] != "ŋ") or onset in ENGLISH_ONSETS


def _is_sonority_rising(onset: tuple[str, ...]) -> bool:
    """Whether sonority rises towards the vowel: the rule for languages without a table of onsets."""
    steps = [_SONORITY[PHONES[phone].kind] for phone in onset]
    return all(low < high for low, high in pairwise(steps))


def split_syllables(segments: Sequence[IpaPhone], *, is_english: bool) -> tuple[tuple[int, int], ...]:
    """Half-open phone ranges of the syllables of a word; a word without vowel is one syllable.

    A vowel takes the longest legal onset; consonants before the first and after the last vowel belong to the first and
    the last syllable.
    """
    is_legal = _is_english_onset if is_english else _is_sonority_rising
    nuclei = [at for at, segment in enumerate(segments) if segment.is_syllabic]
    starts = [0]
    for before, nucleus in pairwise(nuclei):
        start = nucleus
        while start - 1 > before and is_legal(tuple(s.phone for s in segments[start - 1 : nucleus])):
            start -= 1
        starts.append(start)
    return tuple(zip(starts, [*starts[1:], len(segments)], strict=True)) if segments else ()


def _build_word(word: _WordDraft, language: str) -> Word:
    segments = word.segments or ()
    if not segments:
        raise InputError(
            f"language {language!r} has no pronunciation of {word.text!r}; write it in another way or remove it"
        )
    is_english = language.partition("-")[0] == "en"
    names = (
        [ipa_to_arpabet(s.phone, s.stress if s.is_syllabic else None) for s in fold_to_arpabet(segments)]
        if is_english
        else []
    )
    return Word(
        text=word.text,
        source=word.source,
        phones=tuple(segment.phone for segment in segments),
        stress=tuple(segment.stress for segment in segments),
        syllables=split_syllables(segments, is_english=is_english),
        mark=word.mark,
        arpabet=tuple(names),
    )


def has_dictionary(language: str) -> bool:
    """Whether a language is pronounced by dictionaries, and espeak-ng gets phones; else its phones are espeak-ng's."""
    return language == DEFAULT_LANGUAGE or (language == BRITISH and has_british())


def pronounce(text: str, language: str = DEFAULT_LANGUAGE, dictionary: Dictionary | None = None) -> Pronunciation:
    """Spoken words of a text with their phones, stress and syllables.

    Parameters
    ----------
    language
        An espeak-ng code; ``en-us`` and ``en-gb`` are pronounced by dictionaries and context, and where they fail by
        espeak-ng.
    dictionary
        The user's entries, which take precedence.

    Raises
    ------
    InputError
        The text contains no word, the language does not exist or cannot read the letters of the text.
    BackendError
        A word needs espeak-ng, which is not installed.
    """
    language = language_code(language)
    check_script(text, language)
    own = dictionary or Dictionary(MappingProxyType({}))
    if has_dictionary(language):
        words = _split_words((token.source, token.spoken) for token in split_tokens(text))
        texts = [word.text for word in words]
        marks = [word.mark for word in words]
        spoken_segments = english_segments(texts, marks, own)
        if language == BRITISH:
            spoken_segments = british_segments(texts, marks, spoken_segments, own)
        for word, segments in zip(words, spoken_segments, strict=True):
            word.segments = segments
    else:
        words = _words_by_espeak(text, language)
        for word in words:
            word.segments = own.lookup(word.text) or word.segments
        words = [word for word in words if word.segments]  # espeak-ng is silent about the others
    words = [word for word in words if word.segments or any(map(str.isalpha, word.text))]  # no signs without words
    if not words:
        raise SilentTextError(NOTHING)
    return Pronunciation(text, language, tuple(_build_word(word, language) for word in words))


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
    for at, segments in zip(missing, read_unlisted_words([texts[at] for at in missing]), strict=True):
        spoken[at] = segments
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
    # backwards: a reduced form depends on the first sound of the next word, which may be reduced itself
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
