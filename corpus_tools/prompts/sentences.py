"""Sentences of a text that are easy to read aloud."""

import re
from collections import Counter
from collections.abc import Iterator

from lexicon.chunks import split_chunks

# of a prompt
MIN_WORDS, MAX_WORDS = 5, 12
LONGEST_SENTENCE = 400  # characters; longer ones are cut, and have too many words anyway
_WORD = re.compile(r"[^\W\d_]+(?:['’-][^\W\d_]+)*")
_OTHER_SIGNS = re.compile(r"""[^\w\s',.?!¿¡’、。？！।؟،-]|[\d_]|--|[.?!][.?!\s]""")
_BLANK_LINES = re.compile(r"\n\s*\n")
_QUOTES = re.compile(r"""^["'“‘«„`\s]+|["'”’»“`\s]+$""")


def easy_sentences(text: str, language: str) -> Iterator[str]:
    """Sentences of `MIN_WORDS` to `MAX_WORDS` words, without numbers, brackets and quotations inside; each once.

    In texts without spaces between words, as in Japanese, every sentence that is not longer than its limit.
    """
    found: set[str] = set()
    for paragraph in _BLANK_LINES.split(text):
        for piece in split_chunks(paragraph, LONGEST_SENTENCE, language):
            sentence = _QUOTES.sub("", piece)
            key = sentence.casefold()
            if key not in found and _is_easy(sentence):
                found.add(key)
                yield sentence


def words_of(text: str) -> list[str]:
    """Words of a text in lower case."""
    return [word.casefold().replace("’", "'") for word in _WORD.findall(text)]


def count_words(text: str) -> Counter[str]:
    """How often each word occurs in lower case: names have a count of 0."""
    return Counter(word for word in _WORD.findall(text) if word == word.casefold())


def _is_easy(sentence: str) -> bool:
    if _OTHER_SIGNS.search(sentence) or not sentence[:1].isalpha() or sentence[0] != sentence[0].upper():
        return False
    return sentence[-1] in ".?!。？！।؟" and MIN_WORDS <= _n_words(sentence) <= MAX_WORDS


def _n_words(sentence: str) -> int:
    """Number of words; that of syllables by estimate where words are not separated."""
    words = _WORD.findall(sentence)
    is_separated = " " in sentence or not any(ord(letter) >= 0x2E80 for letter in sentence)
    return len(words) if is_separated else sum(map(len, words)) // 2
