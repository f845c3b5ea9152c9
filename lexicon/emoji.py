"""Emoji in a text: where they stand, with all that is joined to them, and the words for which they stand.

An emoji is silent, unless it stands for a word in the sentence: ``I ❤️ pizza``, ``a 🍕 tonight``, ``5 ⭐``, ``press 1️⃣``.
"""

import re
import unicodedata

from lexicon.mark_table import TextMark
from lexicon.number_words import number_words

# Characters that are pictures by themselves. Signs with words of their own (✓ ♯ →) are some only where their glyph is
# chosen (U+FE0F).
_PICTURES = (
    "\U0001f000-\U0001f1e5\U0001f200-\U0001f3fa\U0001f400-\U0001faff"
    "\u231a\u231b\u23e9-\u23f3\u23f8-\u23fa\u25fd\u25fe\u2600-\u2604\u2606-\u266c\u2670-\u2712\u2715\u2716\u2719-\u2775"
    "\u2795-\u2797\u27b0\u27bf\u2b1b\u2b1c\u2b50\u2b55"
)
_CHOSEN = "\u00a9\u00ae\u203c\u2049\u2122\u2139\u2190-\u21ff\u2300-\u2bff\u3030\u303d\u3297\u3299"
_ONE = rf"(?:[{_PICTURES}][\ufe0e\ufe0f]?|[{_CHOSEN}]\ufe0f)[\U0001f3fb-\U0001f3ff]?[\U000e0020-\U000e007f]{{0,12}}"
_KEYCAP = "[0-9#*]\ufe0f?\u20e3"
EMOJI = (
    rf"(?:{_KEYCAP}|[\U0001f1e6-\U0001f1ff]{{1,2}}|{_ONE}(?:\u200d{_ONE}){{0,9}}\u200d?"
    "|[\u200d\ufe0f\U0001f3fb-\U0001f3ff])"
)
LOVED = "love"
_LOVER = re.compile(
    r"(?:\b(?:i|we|they|people|don't|don’t|really|gotta|i'll|we'll)|(?:\A|[.!?]\s+)you)\s*\Z", re.IGNORECASE
)
_WORD_AHEAD = re.compile(r"\s*['\"“‘]?\w")
_ARTICLE = re.compile(r"\b(?:a|an|the|my|your|our|their|every|each|another)\s*\Z", re.IGNORECASE)
_NUMBER = re.compile(r"(?<![\w.])([0-9]{1,4})\s*\Z")
# Words before which something is named: for, some, want. What follows is no further noun.
_TAKES_NOUN = re.compile(
    r"\b(?:for|with|of|some|more|no|want|need|get|grab|have|had|eat|ate|drink|order|buy|love|like|and|or)\s*\Z",
    re.IGNORECASE,
)
_BEFORE_NAME = re.compile(r"[\w,]\s*\Z")


def emoji_word(written: str, mark: TextMark | None, before: str, after: str, language: str) -> str:
    """Word that an emoji says; empty where it is silent, as in all languages but English.

    Parameters
    ----------
    mark
        Its row of the table of marks.
    before, after
        Characters of the text around it.
    """
    if not language.startswith("en"):
        return ""
    word = mark.word if mark else ""
    if "\u20e3" in written:
        return number_words(written[0]) if written[0].isdigit() and _BEFORE_NAME.search(before) else ""
    is_ahead = _WORD_AHEAD.match(after) is not None
    if word == LOVED:
        return word if is_ahead and _LOVER.search(before) else ""
    if _ARTICLE.search(before):
        return word or _name(written)
    number = _NUMBER.search(before)
    if number and word:
        return word if int(number[1]) == 1 or is_ahead or word.endswith("s") else f"{word}s"
    return word if word and _TAKES_NOUN.search(before) and not is_ahead else ""


def _name(written: str) -> str:
    """Name of an emoji's first character (Unicode)."""
    return unicodedata.name(written[0], "").lower() if unicodedata.category(written[0]) == "So" else ""
