"""Reader of initialisms: letter by letter where a table says so, or where no syllables are made of their letters."""

import re

from lexicon.locales.place import Place
from lexicon.locales.roman import ROMAN_LETTERS, spelled

MAX_LETTERS = 5  # of an initialism that no table has
MAX_FOREIGN_LETTERS = 3  # of an initialism in another script, even if it could be said: USA, VIP
_VOWEL = "[AEIOUYÄÖÜÀ-ÅÈ-ÏÒ-ÕÙ-Û]"
_ONSET = (
    "(?:S?(?:[PTKCBDGFV]H?|TH)[LRJ]?|SCH[LRMNW]?|[SZTDKG]W|S[LMN]|[KGP]N|P[SF][LR]?|QU|[TD][SZ]|L?L|[HJMNÑRSÇWXZQ])?"
)
_CODA = "H?[RL]{0,2}[MN]{0,2}(?:SCH|CH|CK|PF|PH|TH|[BCDFGKPQSTVXZß])?(?:ST|TS|[STZ])?"
_SYLLABLES = re.compile(f"{_ONSET}{_VOWEL}{{1,3}}(?:{_CODA}{_ONSET}{_VOWEL}{{1,3}})*{_CODA}")
_HAS_VOWEL = re.compile(_VOWEL)


def read_initialism(place: Place) -> str | None:
    """Words of an initialism; None for a word in capitals, and for consonants alone, which espeak-ng spells.

    In another script (setting ``foreign_letters``) consonants alone are read here, too: espeak-ng spells them in
    English.
    """
    locale, written = place.locale, place.match["letters"]
    row = locale.rows("initialism").get(written)
    ending = place.match["ending"] or ""
    if row is not None and row.spoken != "letters":
        return f"{row.spoken}{ending}"
    if "A" not in locale.rows("letter"):
        return None
    if row is None and not _is_spelled(place, written):
        return None
    return spelled(locale, written) + ending


def _is_spelled(place: Place, written: str) -> bool:
    """Whether letters of no table are spelled: if they make no syllables; of another script three in any case."""
    if len(written) > MAX_LETTERS or set(written) <= ROMAN_LETTERS:
        return False
    if place.locale.setting("foreign_letters"):
        is_among_capitals = place.before.isupper() or place.after.isupper()  # HOW ARE YOU
        is_word = len(written) > MAX_FOREIGN_LETTERS and _SYLLABLES.fullmatch(written)
        return written.isascii() and not is_word and not (is_among_capitals and _HAS_VOWEL.search(written))
    return bool(_HAS_VOWEL.search(written)) and not _SYLLABLES.fullmatch(written)
