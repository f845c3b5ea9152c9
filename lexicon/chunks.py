"""Split a long text into sentences, in bounded memory."""

import re
from collections.abc import Iterator

from lexicon.errors import InputError
from lexicon.function_words import is_function_word
from lexicon.sentence_ends import ends_sentence

# A sentence ends at ., !, ? or … (with closing quotes) before a space that no lower-case letter follows, at an end mark
# of East Asian or Indic writing, at a blank line or a line separator, or where a line ends on purpose. A run of marks
# is tried once, from its first mark, and as a whole.
_END = re.compile(r"""(?<![.!?…])[.!?…]++["'”’)\]]*+(?=\s++[^a-z=×÷])|[。！？｡।॥؟۔]+["'”’」』）]*|\n\s*\n|\u2028|\n""")
_CLAUSE = re.compile(r"[,;:—–、，；：،؛](?=\s)|[、，；：]")
# Words before which an English phrase may end where a sentence has no clause mark, the better places first.
_PHRASE_STARTS = (
    "and but or so because which who whose where when while until unless if though although since that",
    "about after against around at before behind between by during for from in into near on over through to under with",
)
_PHRASE_PLACES = tuple(re.compile(rf"(?<!\d)\s(?=(?:{words.replace(' ', '|')})\s(?!\d))") for words in _PHRASE_STARTS)
_BETWEEN_WORDS = re.compile(r"(?<=[^\W\d_A-Z])\s(?=[^\W\d_A-Z])")
_MIN_PHRASE_CHARACTERS = 20  # of either part; shorter ones sound like words of their own
_MAX_UNDIVIDED_CHARACTERS = 600  # a longer word, as of digits, is divided; addresses are shorter
_CONTEXT_BEFORE, _CONTEXT_AFTER = 24, 40  # characters around a full stop by which an abbreviation is recognised
_SHORT_LINE = 50  # characters at most of a line of a poem, a list or a title; text that is wrapped has longer ones
_LAST_WORD = re.compile(r"([^\W\d_]*)[^\w.]*\Z|\.\s*\Z")
_ITEM = re.compile(r"\s*(?:[-–—*•]|\(?(?:[0-9]{1,3}|[a-z])[.)])\s")  # of a list: - milk, 2. eggs, (b) bread
_PRONOUN = re.compile(r"I\b")


def split_chunks(text: str, limit: int, language: str = "en-us") -> Iterator[str]:
    """Sentences of a text, none longer than `limit` characters unless a single word is, of up to 600 characters.

    A longer sentence is split after the last clause mark within the limit, else at the last space, and in text without
    either (Chinese, Japanese, a longer word) after `limit` characters. Only white space is dropped. Abbreviations are
    those of the language (`lexicon.sentence_ends`).

    Raises
    ------
    InputError
        `limit` is below 1.
    """
    if limit < 1:
        raise InputError(f"the limit of a chunk must be at least 1 character, not {limit}; increase it")
    start = 0
    for match in _END.finditer(text):
        if _is_abbreviated(text, start, match, language) or (match.group() == "\n" and _is_wrapped(text, start, match)):
            continue
        yield from _split_sentence(text[start : match.end()], limit)
        start = match.end()
    yield from _split_sentence(text[start:], limit)


def split_phrase(sentence: str, limit: int) -> tuple[str, str]:
    """First phrase of a sentence that is longer than `limit` characters, and the rest; the rest may be empty.

    The phrase ends at the last clause mark within the limit, else before an English conjunction, else before a
    preposition, else between two words; never beside a number, whose reading depends on its neighbours.
    """
    if len(sentence) <= limit:
        return sentence, ""
    last = min(limit, len(sentence) - _MIN_PHRASE_CHARACTERS)
    clauses = (
        at.end() for at in _CLAUSE.finditer(sentence, 0, last + 1) if not sentence[at.end() :].lstrip()[:1].isdigit()
    )
    others = ((at.start() for at in kind.finditer(sentence, 0, last + 1)) for kind in (*_PHRASE_PLACES, _BETWEEN_WORDS))
    for places in (clauses, *others):
        at = max((place for place in places if _MIN_PHRASE_CHARACTERS <= place <= last), default=0)
        if at:
            return sentence[:at].rstrip(), sentence[at:].lstrip()
    return sentence, ""


def middle_place(text: str) -> int:
    """Index of the space that is nearest to the middle of a text; of the middle in a text without spaces."""
    middle = len(text) // 2
    places = [place for place in (text.rfind(" ", 0, middle), text.find(" ", middle)) if place >= 0]
    return min(places, key=lambda place: abs(place - middle), default=middle)


def _is_abbreviated(text: str, start: int, end: "re.Match[str]", language: str) -> bool:
    """Whether the full stop of a possible sentence end belongs to an abbreviation."""
    if end.group().rstrip("\"'”’)]") != ".":
        return False
    before = text[max(start, end.start() - _CONTEXT_BEFORE) : end.start()]
    return not ends_sentence(before, text[end.end() : end.end() + _CONTEXT_AFTER].lstrip(), language)


def _is_wrapped(text: str, start: int, end: "re.Match[str]") -> bool:
    """Whether a sentence goes on behind the end of a line, as in text that is wrapped at a width."""
    first = max(text.rfind("\n", start, end.start()) + 1, start)
    line, following = text[first : end.start()].rstrip(), text[end.end() : end.end() + _CONTEXT_AFTER].lstrip()
    line_start = text.rfind("\n", 0, end.start()) + 1  # an item may be a number and sentences
    is_list = line.endswith(":") or _ITEM.match(text, line_start) or _ITEM.match(text, start)
    if is_list and _ITEM.match(following):
        return False
    last = _LAST_WORD.search(line[-_CONTEXT_BEFORE:])
    # no line of a poem or a list ends behind a function word, or with the full stop of an abbreviation
    if last is None or last[1] is None or len(line) > _SHORT_LINE or is_function_word(last[1]):
        return True
    return following[:1].islower() or _PRONOUN.match(following) is not None


def _split_sentence(sentence: str, limit: int) -> Iterator[str]:
    text, start = " ".join(sentence.split()), 0
    while len(text) - start > limit:
        end = _cut_position(text, start, limit)
        yield text[start:end].rstrip()
        start = end + text.startswith(" ", end)
    if start < len(text):
        yield text[start:]


def _cut_position(text: str, start: int, limit: int) -> int:
    """Index at which a text whose rest from `start` is longer than the limit is split."""
    end = start + limit
    clauses = [match.end() for match in _CLAUSE.finditer(text, start + limit // 3, end)]
    if clauses:
        return clauses[-1]
    space = text.rfind(" ", start + 1, end + 1)
    if space > 0:
        return space
    # scripts without spaces may be cut between any two characters
    if not (text[end - 1].isascii() and text[end].isascii()):
        return end
    longest = start + max(limit, _MAX_UNDIVIDED_CHARACTERS)
    word_end = text.find(" ", end, longest + 1)
    if word_end > 0:
        return word_end
    return len(text) if len(text) <= longest else end
