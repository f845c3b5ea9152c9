"""Phones of the written words of a text as espeak-ng speaks them within it, in every language but American English.

espeak-ng reads a sentence as a whole, and joins and splits words: ``tout le monde`` is one, 1.000 are two. Its phones
are those of the sentence; which of them are a word's follows from the number of words that each has alone, or from its
phones alone, where words are joined.
"""

import functools
from collections.abc import Collection, Sequence
from difflib import SequenceMatcher
from itertools import accumulate, pairwise

from lexicon.chunks import split_chunks
from lexicon.g2p import parse_espeak_word, phonemize
from lexicon.ipa import IpaPhone
from lexicon.written_words import WrittenWord, espeak_text, is_unspaced, written_words

MAX_SENTENCE_CHARACTERS = 1000  # of text that is read as a whole
Segments = tuple[IpaPhone, ...]


def words_by_espeak(text: str, language: str) -> tuple[tuple[WrittenWord, Segments], ...]:
    """Written words of a text with their phones; signs without phones are left out, words without are kept empty."""
    found: list[tuple[WrittenWord, Segments]] = []
    for sentence in split_chunks(text, MAX_SENTENCE_CHARACTERS, language):
        found += _words_of_sentence(sentence, language)
    return tuple(found)


def _words_of_sentence(sentence: str, language: str) -> list[tuple[WrittenWord, Segments]]:
    words = written_words(sentence, language)
    (spoken,) = phonemize([espeak_text(sentence, language)], language)
    whole = [segments for segments in (parse_espeak_word(word, language) for word in spoken) if segments]
    alone = [_alone(word.piece, language) for word in words]
    kept = [at for at, parts in enumerate(alone) if parts or any(map(str.isalnum, words[at].text))]
    words, alone = tuple(words[at] for at in kept), [alone[at] for at in kept]
    flat = [segment for part in whole for segment in part]
    ends = {0, *accumulate(map(len, whole))}
    if sum(map(len, alone)) == len(whole):
        n_phones = [0, *accumulate(map(len, whole))]
        cuts = [n_phones[at] for at in [0, *accumulate(map(len, alone))]]
    else:
        cuts = _cuts(flat, ends, [sum(parts, ()) for parts in alone])
    parts = [tuple(flat[first:last]) for first, last in pairwise(cuts)]
    # characters that espeak-ng reads as a word are one: 你好
    is_joined = [is_unspaced(language) and cut not in ends for cut in cuts[:-1]]
    return _joined(words, parts, [bool(own) for own in alone], is_joined)


@functools.lru_cache(maxsize=10_000)
def _alone(piece: str, language: str) -> tuple[Segments, ...]:
    """Phones of each word that espeak-ng makes of a piece of text by itself."""
    (spoken,) = phonemize([piece], language)
    return tuple(segments for segments in (parse_espeak_word(word, language) for word in spoken) if segments)


def _cuts(sentence: Sequence[IpaPhone], ends: Collection[int], alone: Sequence[Segments]) -> list[int]:
    """Bounds of each word among the phones of a sentence, from its phones alone; near ends of words are preferred."""
    said = [segment.phone for segment in sentence]
    expected = [segment.phone for part in alone for segment in part]
    blocks = SequenceMatcher(None, expected, said, autojunk=False).get_matching_blocks()
    cuts = [0]
    for at in accumulate(map(len, alone)):
        # the gap between equal phones in which the cut lies; within equal phones there is none
        low = max((block.b + min(at - block.a, block.size) for block in blocks if block.a < at), default=0)
        high = min((block.b + max(at - block.a, 0) for block in blocks if block.a + block.size > at), default=len(said))
        places = [place for place in range(low, high + 1) if place in ends]
        cuts.append(max(places[-1] if places else low, cuts[-1]))
    return [*cuts[:-1], len(said)]


def _joined(
    words: Sequence[WrittenWord], parts: Sequence[Segments], has_phones: Sequence[bool], is_joined: Sequence[bool]
) -> list[tuple[WrittenWord, Segments]]:
    """Words with their phones; one that a neighbour absorbs, or that is joined to it, is written with it."""
    found: list[tuple[WrittenWord, Segments]] = []
    for word, segments, is_spoken, is_part in zip(words, parts, has_phones, is_joined, strict=True):
        if found and (is_part or (is_spoken and not segments)):
            before, own = found[-1]
            space = "" if is_part else " "
            text, piece = f"{before.text}{space}{word.text}", f"{before.piece}{space}{word.piece}"
            found[-1] = (WrittenWord(text, piece, word.mark), (*own, *segments))
        else:
            found.append((word, segments))
    return found
