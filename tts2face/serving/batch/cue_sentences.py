"""Sentences that run over several cues, which are spoken as one and cut back at their words."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lexicon.dictionary import word_set
from lexicon.errors import DataError, InputError
from lexicon.sentence_ends import ends_sentence
from lexicon.sentence_length import MAX_SENTENCE_CHARACTERS, n_letters
from lexicon.text_marks import is_ssml
from tts2face.request import Request
from tts2face.serving.batch.windows import Window
from tts2face.session.prepared import prepare, read_marks, read_text

MAX_GAP_S = 1.0  # between the cues of a sentence
PUNCTUATED_SHARE = 0.4  # of the cues of a file that end a sentence: then a missing end mark means something
_CLOSING = "\"'”’»)]"
_ENDS = re.compile(r"[.!?…。！？｡।:;]$")
_DOTS = re.compile(r"(?:\.{2,}|…)$")
_LEADING_DOTS = re.compile(r"^(?:\.{2,}|…)\s*")
# Words that end no sentence, after which one goes on with a name (to / London).
_OPEN_WORDS = word_set(
    "a an the and or but nor of to from with for at as by if than because into onto my your our their its every"
)
_LAST_WORD = re.compile(r"[^\W\d_]+(?:['’][^\W\d_]+)*$")


@dataclass(frozen=True, slots=True)
class CueSentence:
    """Windows of a sentence, in order, the letters of each without marks, and the words of all with their marks."""

    windows: tuple[Window, ...]
    n_letters: tuple[int, ...]
    text: str


def words_of_cue(text: str, settings: Mapping[str, Any]) -> str:
    """Words of a cue without its marks; an SSML document, or a text that cannot be read, as it is written.

    `settings` are those of the request of its speaker.
    """
    if is_ssml(text):
        return text
    try:
        return read_marks(Request(**settings, text=text)).text.strip()
    except (InputError, DataError):
        return text


def letters_of_cues(texts: Sequence[str], whole: str, settings: Mapping[str, Any]) -> tuple[int, ...] | None:
    """Numbers of the letters of each cue of a sentence without marks; None if a voice cannot speak them as one.

    It can if the cues have the marks that the whole sentence has, and each of them a letter or digit.
    """
    try:
        spoken = prepare(Request(**settings, text=whole)).text.text
        words = [read_text(Request(**settings, text=text))[1].text for text in texts]
    except (InputError, DataError):
        return None
    counts = tuple(map(n_letters, words))
    has_words = all(any(map(str.isalnum, text)) for text in words)
    return counts if has_words and sum(counts) == n_letters(spoken) else None


def continues(text: str, following: str, language: str = "en-us", *, is_in_capitals: bool = False) -> bool:
    """Whether a sentence goes on in the next cue.

    It has no end mark, and a comma at its end, a small letter after it, or a last word that ends no sentence
    (*of*, *the*); or dots at its end and a small letter after it; or the full stop of an abbreviation (*Mr.*), which
    the rules of the language do not take for an end. Dots in front of the next cue do not count. An SSML document is
    whole.

    Parameters
    ----------
    is_in_capitals
        Whether the file has no small letters; then a missing end mark decides.
    """
    end, begin = _end(text), _LEADING_DOTS.sub("", following.lstrip("\"'“‘«(["))
    if not end or not begin or is_ssml(text) or is_ssml(following):
        return False
    if _DOTS.search(end):
        return begin[:1].islower()
    if has_end_mark(end):
        after = begin.capitalize() if begin.isupper() else begin
        return end[-1] == "." and not ends_sentence(end[:-1], after, language)
    # in capitals a small letter cannot say that the sentence goes on
    if is_in_capitals or end[-1] in ",、，" or begin[:1].islower():
        return True
    word = _LAST_WORD.search(end)
    return word is not None and word.group().lower() in _OPEN_WORDS


def has_end_mark(text: str) -> bool:
    """Whether a cue ends with a mark of sentences' ends, if only with the full stop of an abbreviation."""
    return _ENDS.search(_end(text)) is not None


def is_punctuated(texts: Sequence[str]) -> bool:
    """Whether so many cues of a file have end marks that one without goes on in the next."""
    return sum(map(has_end_mark, texts)) >= PUNCTUATED_SHARE * len(texts)


def _end(text: str) -> str:
    return text.rstrip().rstrip(_CLOSING)


def spoken_part(text: str, *, is_first: bool, is_last: bool) -> str:
    """Words of a cue within a sentence, without the dots by which it goes on."""
    begin = text if is_first else _LEADING_DOTS.sub("", text)
    return begin if is_last else _DOTS.sub("", begin.rstrip()).rstrip()


def sentence_groups(
    windows: Sequence[Window],
    words: Sequence[str],
    keys: Sequence[object],
    max_gap: int,
    languages: Sequence[str],
    *,
    is_in_capitals: bool = False,
) -> list[list[int]]:
    """Indices of the windows of each sentence, in order.

    Parameters
    ----------
    words
        Words of each window, without marks.
    keys
        For each window what must be equal for its words to be spoken as one with the next ones; None: nothing is.
    max_gap
        Frames between two cues of a sentence.
    languages
        Language of each window, whose abbreviations count.
    """
    groups: list[list[int]] = []
    for at, window in enumerate(windows):
        if groups:
            before = groups[-1][-1]
            n_characters = sum(len(windows[number].cue.text) + 1 for number in groups[-1])
            is_one = keys[at] is not None and keys[at] == keys[before] and window.begin - windows[before].end <= max_gap
            is_short = n_characters + len(window.cue.text) <= MAX_SENTENCE_CHARACTERS
            if (
                is_one
                and is_short
                and continues(words[before], words[at], languages[at], is_in_capitals=is_in_capitals)
            ):
                groups[-1].append(at)
                continue
        groups.append([at])
    return groups
