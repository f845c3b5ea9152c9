"""Times of the letters of a text, from the times of its spoken words."""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lexicon.cleaning import canonical_text
from lexicon.sentences import n_letters, text_prefix
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.spoken_form import spoken_form


class WordTimes:
    """Times of the letters of a text, from the onsets and ends of its spoken words.

    The words before a letter are counted in the normalised text. If a voice divides the text into another number of
    words, the letter is assigned to the word boundary whose share of preceding letters is most similar.

    Parameters
    ----------
    written
        The text as written.
    phones, words
        Spoken phones and words of the text.
    language
        espeak-ng code.
    first
        Index of the text's first letter.
    """

    def __init__(
        self, written: str, phones: PhoneSequence, words: Sequence[WordSpan], *, language: str, first: int = 0
    ) -> None:
        self._written, self._language, self._first = written, language, first
        self._n_letters = max(n_letters(written), 1)
        self._onsets = [float(phones.edges[word.first]) for word in words] or [phones.start]
        self._ends = [float(phones.edges[word.last]) for word in words] or [phones.end]
        self._counts_agree = self._count_words(written) == len(self._onsets)
        lengths = [max(n_letters(word.text), 1) for word in words] or [1]
        self._cache: dict[int, int] = {}
        self._shares = np.concatenate([[0.0], np.cumsum(lengths) / sum(lengths)])

    def onset(self, letter: int) -> float:
        """Start in seconds of the word at or after a letter; after the last word, the end of that word."""
        word = self._words_before(letter)
        return self._onsets[word] if word < len(self._onsets) else self._ends[-1]

    def end(self, letter: int) -> float:
        """End in seconds of the word before a letter; before the first word, the onset of that word."""
        word = self._words_before(letter)
        return self._ends[word - 1] if word > 0 else self._onsets[0]

    def _words_before(self, letter: int) -> int:
        if letter not in self._cache:
            self._cache[letter] = self._search_word(min(max(letter - self._first, 0), self._n_letters))
        return self._cache[letter]

    def _search_word(self, at: int) -> int:
        if not self._counts_agree:
            return int(np.abs(self._shares - at / self._n_letters).argmin())
        before = text_prefix(self._written, at).rstrip()
        rest = self._written[len(before) :]
        is_inside = before[-1:].isalnum() and rest[:1].isalnum()
        return min(self._count_words(before) - is_inside, len(self._onsets))

    def _count_words(self, written: str) -> int:
        normalised = spoken_form(written, self._language)
        if not self._language.startswith("en"):
            normalised = canonical_text(normalised, keep_marks=True)
        return sum(any(letter.isalnum() for letter in word) for word in normalised.split())


class LetterTimes(Protocol):
    """Times in seconds of the words around a letter, which is given by its index."""

    def onset(self, letter: int) -> float:
        """Start of the word at or after a letter."""

    def end(self, letter: int) -> float:
        """End of the word before a letter."""


@dataclass(frozen=True, slots=True)
class SentenceTimes:
    """Times of the letters of several utterances: index of the first letter, word times and start of each."""

    firsts: tuple[int, ...]
    word_times: tuple[WordTimes, ...]
    begins: tuple[float, ...]

    def onset(self, letter: int) -> float:
        """Start in seconds of the word at or after a letter."""
        at = max(bisect_right(self.firsts, letter) - 1, 0)
        return self.begins[at] + self.word_times[at].onset(letter)

    def end(self, letter: int) -> float:
        """End in seconds of the word before a letter."""
        at = max(bisect_left(self.firsts, letter) - 1, 0)
        return self.begins[at] + self.word_times[at].end(letter)
