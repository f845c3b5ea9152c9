"""Text to words with phones, stress and syllables."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

from lexicon.cleaning import canonical_text
from lexicon.dictionary import Dictionary
from lexicon.english import CAPITALISED_WORDS, fold_to_arpabet, look_up_word
from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE, parse_espeak_word, phonemize
from lexicon.ipa import Segment
from lexicon.languages import language_code
from lexicon.normalize import MARKS, split_tokens
from lexicon.phones import ipa_to_arpabet
from lexicon.said import as_said
from lexicon.syllables import split_syllables
from lexicon.writing_systems import check_script

PAUSES_S = MappingProxyType({"": 0.0, ",": 0.2, ";": 0.3, ":": 0.3, ".": 0.5, "!": 0.5, "?": 0.5})  # nominal
_MARKS_BY_STRENGTH = tuple(PAUSES_S)  # of two marks that meet, the later one here stays
_PIECE = re.compile(r"[^\s.,;:!?]+|[.,;:!?]")


@dataclass(frozen=True, slots=True)
class Word:
    """One spoken word.

    Parameters
    ----------
    text
        The word that is said (five).
    source
        The written form that it comes from ($5); several words may share one.
    phones : N symbols of the phone table
    stress : N digits
        1 primary, 2 secondary, 0 none; 0 for consonants.
    syllables : pairs
        Half-open ranges of phones, without gap from 0 to N.
    mark
        The punctuation behind the word, or nothing.
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
        """Nominal seconds of silence behind the word."""
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
    """A text's words in order, in the language that they are read in."""

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
    segments: tuple[Segment, ...] | None = None


def _split_words(forms: Iterator[tuple[str, str]]) -> list[_WordDraft]:
    """Words of (written, spoken) pairs, each with the punctuation behind it."""
    words: list[_WordDraft] = []
    for written, spoken in forms:
        for piece in _PIECE.findall(spoken):
            if piece not in MARKS:
                words.append(_WordDraft(piece, written.strip(" .,;:!?") or piece))
            elif words:
                words[-1].mark = max(words[-1].mark, piece, key=_MARKS_BY_STRENGTH.index)
    return words


def _are_all_capitals(words: Sequence[_WordDraft]) -> bool:
    """All words are capitals: a heading, not a row of initialisms."""
    long = [word.text for word in words if len(word.text) > 1]
    return len(long) > 1 and all(text.isupper() for text in long) and any(len(text) > 3 for text in long)


def _lookup_forms(words: Sequence[_WordDraft]) -> list[str]:
    """Words as they are looked up: capitals that only shout are small."""
    texts = ["", *(word.text for word in words), ""]
    if _are_all_capitals(words):
        return [text.lower() for text in texts[1:-1]]
    return [
        text.lower() if len(text) > 1 and CAPITALISED_WORDS & {before, text, after} and text.isupper() else text
        for before, text, after in zip(texts, texts[1:], texts[2:], strict=False)
    ]


def _pronounce_english(words: list[_WordDraft], own: Dictionary) -> None:
    """Give English words CMUdict's phones, and espeak-ng's to the rest, in one call."""
    for word, text, following in zip(words, _lookup_forms(words), [*words[1:], None], strict=True):
        is_article = text == "A" and not word.mark and following is not None and following.text[:1].islower()
        word.segments = look_up_word(text, is_letter=text.isupper() and not is_article, own=own.lookup)
    _pronounce_by_rules([word for word in words if word.segments is None], DEFAULT_LANGUAGE)
    for word, following in pairwise(words):
        first = (following.segments or ())[:1]
        if word.text.lower() == "the" and first and first[0].is_syllabic and own.lookup("the") is None:
            word.segments = (Segment("ð"), Segment("i", is_syllabic=True))


def _pronounce_by_rules(words: Sequence[_WordDraft], language: str) -> None:
    """Phones by espeak-ng, each word by itself."""
    for word, written in zip(words, phonemize([word.text for word in words], language), strict=True):
        segments = tuple(segment for part in written for segment in parse_espeak_word(part, language))
        word.segments = fold_to_arpabet(segments) if language == DEFAULT_LANGUAGE else segments


def _pronounce_in_context(words: list[_WordDraft], language: str) -> None:
    """Phones by espeak-ng clause by clause; word by word where it joins or splits the words of a clause."""
    clauses: list[list[_WordDraft]] = [[]]
    for word in words:
        clauses[-1].append(word)
        if word.mark:
            clauses.append([])
    spoken = phonemize([" ".join(word.text for word in clause) for clause in clauses], language)
    alone: list[_WordDraft] = []
    for clause, written in zip(clauses, spoken, strict=True):
        if len(clause) == len(written):
            for word, part in zip(clause, written, strict=True):
                word.segments = parse_espeak_word(part, language)
        else:
            alone += clause
    _pronounce_by_rules(alone, language)


def _build_word(word: _WordDraft, language: str) -> Word:
    segments = word.segments or ()
    if not segments:
        raise InputError(
            f"language {language!r} has no sound for {word.text!r}; write it in another way or leave it out"
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
    """The words that a text is said with, and the phones, stress and syllables of each.

    Parameters
    ----------
    language
        An espeak-ng code; ``en-us`` looks words up in CMUdict first.
    dictionary
        The user's entries, which win over all else.

    Raises
    ------
    InputError
        The text holds no word, the language does not exist or cannot read the text's letters.
    BackendError
        A word needs espeak-ng, which is not installed.
    """
    language = language_code(language)
    check_script(text, language)
    own = dictionary or Dictionary(MappingProxyType({}))
    if language.partition("-")[0] == "en":
        words = _split_words((token.source, token.spoken) for token in split_tokens(text))
    else:
        said = as_said(text, language)
        words = _split_words((piece, piece) for piece in canonical_text(said, keep_marks=True).split())
        words = [word for word in words if any(letter.isalnum() for letter in word.text)]
    if not words:
        raise InputError("there is no word to say in this text; give at least one word or number")
    if language == DEFAULT_LANGUAGE:
        _pronounce_english(words, own)
    else:
        _pronounce_in_context(words, language)
        for word in words:
            word.segments = own.lookup(word.text) or word.segments
    return Pronunciation(text, language, tuple(_build_word(word, language) for word in words))
