"""Pronounce text: words with phones, stress and syllables."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

from lexicon.canonical import canonical_text
from lexicon.dictionary import Dictionary
from lexicon.english import fold_to_arpabet
from lexicon.english_text import english_segments
from lexicon.errors import InputError, SilentTextError
from lexicon.g2p import DEFAULT_LANGUAGE, parse_espeak_word, phonemize, segments_by_rules
from lexicon.ipa import IpaPhone
from lexicon.languages import language_code
from lexicon.normalize import MARKS, split_tokens
from lexicon.phones import PHONES, ipa_to_arpabet
from lexicon.scripts import check_script
from lexicon.spoken_form import spoken_form

NOTHING = "there is nothing to say in the text; add at least one word or number"
PAUSES_S = MappingProxyType({"": 0.0, ",": 0.2, ";": 0.3, ":": 0.3, ".": 0.5, "!": 0.5, "?": 0.5})  # s, nominal
_MARKS_BY_STRENGTH = tuple(PAUSES_S)  # of two adjacent marks the later one of this order is kept
_PIECE = re.compile(r"[^\s.,;:!?]+|[.,;:!?]")
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
    """

    text: str
    source: str
    phones: tuple[str, ...]
    stress: tuple[int, ...]
    syllables: tuple[tuple[int, int], ...]
    mark: str = ""
    arpabet: tuple[str, ...] = ()

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
                words.append(_WordDraft(piece, written.strip(" .,;:!?") or piece))
            elif words:
                words[-1].mark = max(words[-1].mark, piece, key=_MARKS_BY_STRENGTH.index)
    return words


def _pronounce_by_rules(words: Sequence[_WordDraft], language: str) -> None:
    """Phones by espeak-ng, word by word."""
    for word, segments in zip(words, segments_by_rules([word.text for word in words], language), strict=True):
        word.segments = segments


def _pronounce_in_context(words: list[_WordDraft], language: str) -> None:
    """Phones by espeak-ng clause by clause, or word by word where it joins or splits the words of a clause."""
    clauses: list[list[_WordDraft]] = [[]]
    for word in words:
        clauses[-1].append(word)
        if word.mark:
            clauses.append([])
    spoken = phonemize([" ".join(word.text for word in clause) for clause in clauses], language)
    unmatched: list[_WordDraft] = []
    for clause, written in zip(clauses, spoken, strict=True):
        if len(clause) == len(written):
            for word, part in zip(clause, written, strict=True):
                word.segments = parse_espeak_word(part, language)
        else:
            unmatched += clause
    _pronounce_by_rules(unmatched, language)


def _is_english_onset(onset: tuple[str, ...]) -> bool:
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


def pronounce(text: str, language: str = DEFAULT_LANGUAGE, dictionary: Dictionary | None = None) -> Pronunciation:
    """Spoken words of a text with their phones, stress and syllables.

    Parameters
    ----------
    language
        An espeak-ng code; ``en-us`` is pronounced by dictionaries and context, and where they fail by espeak-ng.
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
    if language.partition("-")[0] == "en":
        words = _split_words((token.source, token.spoken) for token in split_tokens(text))
    else:
        spoken = spoken_form(text, language)
        words = _split_words((piece, piece) for piece in canonical_text(spoken, keep_marks=True).split())
        words = [word for word in words if any(letter.isalnum() for letter in word.text)]
    if not words:
        raise SilentTextError(NOTHING)
    if language == DEFAULT_LANGUAGE:
        spoken_segments = english_segments([word.text for word in words], [word.mark for word in words], own)
        for word, segments in zip(words, spoken_segments, strict=True):
            word.segments = segments
    else:
        _pronounce_in_context(words, language)
        for word in words:
            word.segments = own.lookup(word.text) or word.segments
    words = [word for word in words if word.segments or any(map(str.isalpha, word.text))]  # no signs without words
    if not words:
        raise SilentTextError(NOTHING)
    return Pronunciation(text, language, tuple(_build_word(word, language) for word in words))
