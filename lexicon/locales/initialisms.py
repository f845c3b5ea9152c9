"""Reader of initialisms: letter by letter where a table says so, or where no syllables are made of their letters."""

import re

from lexicon.locales.place import Place
from lexicon.locales.roman import ROMAN_LETTERS, spelled

MAX_LETTERS = 5  # of an initialism that no table has
_VOWEL = "[AEIOUYÄÖÜÀ-ÅÈ-ÏÒ-ÕÙ-Û]"
_ONSET = (
    "(?:S?(?:[PTKCBDGFV]H?|TH)[LRJ]?|SCH[LRMNW]?|[SZTDKG]W|S[LMN]|[KGP]N|P[SF][LR]?|QU|[TD][SZ]|L?L|[HJMNÑRSÇWXZQ])?"
)
_CODA = "H?[RL]{0,2}[MN]{0,2}(?:SCH|CH|CK|PF|PH|TH|[BCDFGKPQSTVXZß])?(?:ST|TS|[STZ])?"
_SYLLABLES = re.compile(f"{_ONSET}{_VOWEL}{{1,3}}(?:{_CODA}{_ONSET}{_VOWEL}{{1,3}})*{_CODA}")
_HAS_VOWEL = re.compile(_VOWEL)


def read_initialism(place: Place) -> str | None:
    """Words of an initialism; None for a word in capitals, and for consonants alone, which espeak-ng spells."""
    locale, written = place.locale, place.match["letters"]
    row = locale.rows("initialism").get(written)
    ending = place.match["ending"] or ""
    if row is not None and row.spoken != "letters":
        return f"{row.spoken}{ending}"
    if "A" not in locale.rows("letter"):
        return None
    if row is None and (
        len(written) > MAX_LETTERS
        or set(written) <= ROMAN_LETTERS
        or not _HAS_VOWEL.search(written)
        or _SYLLABLES.fullmatch(written)
    ):
        return None
    return spelled(locale, written) + ending
