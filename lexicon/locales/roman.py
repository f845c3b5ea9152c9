"""Reader of Roman numbers: of centuries, chapters and rulers by the words around them, else the names of letters."""

from lexicon.locales.nouns import gender_of
from lexicon.locales.numbers import Grammar, cardinal, ordinal
from lexicon.locales.place import Place
from lexicon.locales.tables import Locale
from lexicon.number_words import roman_value

_SAFE_ROMAN = frozenset("IVX")  # numbers of other letters are words and sizes (MIX, XL, DVD)
ROMAN_LETTERS = frozenset("IVXLCDM")
_CONTEXT = 40


def read_roman(place: Place) -> str | None:
    """Roman number by the words around it, else the names of its letters; None for a word."""
    written, locale = place.match["roman"], place.locale
    is_model = place.text[place.match.end() : place.match.end() + 1].isdigit()  # MX5
    value = 0 if is_model else roman_value(written)
    if place.match["suffix"]:
        return _with_suffix(place, value)
    known = _in_context(place, value) if value else None
    if known:
        return known
    if value and _is_number(written, value):
        return cardinal(locale, value)
    if "I" in written and (len(written) > 2 or not value or _is_in_capitals(place)):  # espeak-ng reads MIX as 1009
        return written.lower()
    return spelled(locale, written) if len(written) > 1 else None


def _is_in_capitals(place: Place) -> bool:
    """Whether the words around are in capitals: IL EST LI."""
    return any(len(word) > 2 and word.isupper() for word in (place.before, place.after))


def _is_number(written: str, value: int) -> bool:
    """Whether letters without a context are rather a number than a size, a word or an initialism."""
    if set(written) <= _SAFE_ROMAN:
        return len(written) > 1 and "XXX" not in written
    return len(written) > 3 or (len(written) == 3 and "I" in written and value < 1000)


def read_roman_with_stop(place: Place) -> str | None:
    """Roman number with the full stop of an ordinal (II. Mehmed, Ludwig XIV. war); None where it ends a sentence."""
    locale, value = place.locale, roman_value(place.match["roman"])
    if not value:
        return None
    if locale.setting("roman_stop") == "ordinal":
        return ordinal(locale, value)
    case = place.grammar("ordinal").case
    if place.after[:1].isupper():  # im II. Weltkrieg
        return ordinal(locale, value, Grammar(case=case)) if case else None
    return _in_context(place, value)


def _with_suffix(place: Place, value: int) -> str | None:
    """Ordinal with its ending (XIXe); None for a word of other letters (De, Me)."""
    row = place.locale.rows("suffix").get(place.match["suffix"].rstrip("."))
    if not value or row is None or row.spoken != "ordinal" or not set(place.match["roman"]) <= _SAFE_ROMAN:
        return None
    return ordinal(place.locale, value, Grammar(row.details.get("gender", ""), row.details.get("case", "")))


def _in_context(place: Place, value: int) -> str | None:
    locale = place.locale
    for word in (f"+{_word_after(place)}", (place.said or place.before).lower()):
        if word in locale.rows("roman"):
            return _by_word(place, value, word)
    return _ruler(place, value)


def _word_after(place: Place) -> str:
    following = place.text[place.match.end() : place.match.end() + _CONTEXT].lstrip(" ")
    word = following.split(" ")[0].rstrip(",;:!?").lower() if following else ""
    return word if f"+{word}" in place.locale.rows("roman") else word.rstrip(".")


def _by_word(place: Place, value: int, word: str) -> str:
    """Number of the kind of a row: XX secolo, siglo XXI."""
    locale, row = place.locale, place.locale.rows("roman")[word]
    if row.spoken == "cardinal" or (row.spoken == "ruler" and value > int(locale.setting("ruler_ordinals", "99"))):
        return cardinal(locale, value)
    is_after = word.startswith("+")
    before = (place.said or place.before) if is_after else ""
    case = row.details.get(before.lower()) or row.details.get("case") or place.grammar("ordinal").case
    case = case or (row.details.get("noun", "") if before.islower() else "")
    return ordinal(locale, value, Grammar(row.details.get("gender") or gender_of(locale, word.lstrip("+")), case))


def read_letter_number(place: Place) -> str | None:
    """Ordinal in the letters of a language and their sign: Γεώργιος Α΄, τον ΙΘ΄ αιώνα; None for other letters."""
    locale, rows = place.locale, place.locale.rows("letter_value")
    written = (place.match["letters"] or place.match["short"]).replace("ΣΤ", "Ϛ")  # the one number of two letters
    if not rows.keys() >= set(written):
        return None
    value = sum(int(rows[letter].spoken) for letter in written)
    ruler = _ruler(place, value)
    if ruler:
        return ruler
    grammar = place.grammar("ordinal")
    return ordinal(locale, value, Grammar(grammar.gender or gender_of(locale, place.after), grammar.case))


def _ruler(place: Place, value: int) -> str | None:
    """Number of a ruler (quatorze, segundo, der vierzehnte, Karls des fünften); None behind another word."""
    locale, rulers = place.locale, place.locale.rows("ruler")
    genitive = locale.setting("ruler_genitive")
    row = rulers.get(place.before)
    if row is None and genitive and place.before.removesuffix("s") in rulers:
        return genitive.format(ordinal(locale, value, Grammar("", "dative")))
    if row is None:
        return None
    gender = row.details.get("gender", "m")
    if value > int(locale.setting("ruler_ordinals", "99")):
        return cardinal(locale, value)
    if value == 1 and locale.setting("ruler_first"):
        return locale.setting("ruler_first")
    case = "weak" if locale.setting(f"ruler_{gender}") else row.details.get("case", "")
    return locale.setting(f"ruler_{gender}", "{}").format(ordinal(locale, value, Grammar(gender, case)))


def spelled(locale: Locale, written: str) -> str:
    """Names of letters; a letter without a name stays."""
    names = locale.rows("letter")
    return " ".join(names[letter].spoken if letter in names else letter for letter in written)
