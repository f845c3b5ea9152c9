"""Readers of abbreviations, words of other languages, addresses and signs."""

import re
import unicodedata
from collections.abc import Collection

from lexicon.locales.nouns import noun_form
from lexicon.locales.numbers import Amount, digits, number, whole
from lexicon.locales.place import Place
from lexicon.locales.tables import Row
from lexicon.sentence_ends import ends_sentence

_CONTEXT = 40
_EQUATION = re.compile(r"[0-9.,]{1,20} ?=")
_ARROWS = frozenset("-=<>")  # before < or >: -> 5
_ROMAN = re.compile(r"[IVX]{1,8}(?![\w.])")
_SILENT = frozenset("<>~·*")  # where they stand between no numbers


def read_abbreviation(place: Place) -> str | None:
    """Words of an abbreviation where its context is that of the table; a full stop that ends the sentence stays."""
    written = place.match.group()
    rows = place.locale.rows("abbreviation")
    row = rows.get(written) or rows.get(written[:1].lower() + written[1:])
    if row is None:
        return None
    following = place.text[place.match.end() : place.match.end() + _CONTEXT]
    if not _is_in_context(place, row.details.keys(), following):
        return None
    said = _form_in_context(place, row)
    if written[:1].isupper() and not place.before and not place.said and said[:1].islower():
        said = said[:1].upper() + said[1:]
    is_end = written.endswith(".") and "end" in row.details and _starts_sentence(place, following)
    return f"{said}." if is_end else said


def read_ending(place: Place) -> str:
    """Word with an abbreviation at its end (Goethestr.)."""
    return place.match["stem"] + place.locale.rows("ending")[place.match["ending"]].spoken


def _is_in_context(place: Place, details: Collection[str], following: str) -> bool:
    """Whether an abbreviation stands where one of its details allows it; anywhere if it has none of them."""
    bare = following.lstrip(" ")
    behind = place.text[max(place.match.start() - 2, 0) : place.match.start()].strip(" ")
    allowed = {
        "number": bare[:1].isdigit() or bare[:1] in {"X", "V", "I"},
        "name": bare[:1].isupper() or bare.startswith(f"{place.locale.setting('and')} "),
        "after": behind[-1:].isalnum(),
        "roman": bool(_ROMAN.match(bare)),
    }
    contexts = allowed.keys() & details
    return not contexts or any(allowed[context] for context in contexts)


def _form_in_context(place: Place, row: Row) -> str:
    """Form of an abbreviated word: its case by the word before it, that of an adjective (XX w.), or of a king."""
    before = (place.said or place.before).lower()
    for name, form in row.details.items():
        if name[0] == "~" and before.endswith(name[1:]):
            return form
    ruler = place.locale.rows("ruler").get(place.after)
    if ruler is not None and "ruler" in row.details and ruler.spoken == "m":
        return row.details["ruler"]
    return row.details.get(before) or row.details.get(place.grammar("abbreviation").case, row.spoken)


def _starts_sentence(place: Place, following: str) -> bool:
    before = place.text[max(place.match.start() - 1, 0) : place.match.end() - 1]
    return (
        following[:1].isspace()
        and not _ROMAN.match(following.lstrip())
        and ends_sentence(before, following.lstrip(), place.locale.language)
        and (following.lstrip()[:1].isupper())
    )


def read_word(place: Place) -> str | None:
    """Word of another language as the language says it."""
    rows = place.locale.rows("word")
    written = place.match.group()
    row = rows.get(written) or rows.get(written.lower())
    return row.spoken if row else None


def read_dash(place: Place) -> str | None:
    """Word for to between what was read and a number (9h-18h); None elsewhere (COVID-19)."""
    if _EQUATION.match(place.text, place.match.end()):  # 10-5=5
        return None
    is_behind = place.said and not place.text[place.match.start() - 1 : place.match.start()].isspace()
    return f" {place.locale.setting('to')} " if is_behind else None


def read_sign(place: Place) -> str | None:
    """Words of a sign that is spoken, where it stands as its row says; None elsewhere."""
    row = place.locale.rows("sign")[place.match.group()]
    before = place.text[max(place.match.start() - 2, 0) : place.match.start()].rstrip(" ")[-1:]
    after = place.text[place.match.end() : place.match.end() + 2].lstrip(" ")[:1]
    is_led = _is_term(before) or (row.details.get("number") == "sign" and before not in _ARROWS)
    if "number" in row.details and not (_is_term(after) and is_led):
        return " " if place.match.group() in _SILENT else row.spoken
    if "math" in row.details and not (_is_term(before) and _is_term(after) and _has_equals(place)):
        return None
    if "unit" in row.details and not _stands_between_units(place):
        return " "
    return row.spoken


def read_power(place: Place) -> str | None:
    """Words of a power (10^6, 10⁻³); None for a square or cube, which have words of their own."""
    locale, raised = place.locale, place.match["raised"] or ""
    written = place.match["digits"] or unicodedata.normalize("NFKC", raised).replace("\u2212", "-")
    own = locale.rows("sign").get("²³"[int(written) - 2] if written in {"2", "3"} else "")
    if own is not None:
        return own.spoken
    sign = "-" if written.startswith("-") else ""
    exponent = number(locale, Amount(sign, written.removeprefix("-")))
    return locale.setting("power").format(exponent)


def _is_term(sign: str) -> bool:
    return sign.isdigit() or sign in {"(", ")", "√", "π", "%"}


def _has_equals(place: Place) -> bool:
    around = place.text[max(place.match.start() - _CONTEXT, 0) : place.match.end() + _CONTEXT]
    return any(sign in around for sign in "=≈<>")


def _stands_between_units(place: Place) -> bool:
    """Whether a slash stands directly behind what is counted, and before a word: 5 €/Monat."""
    return bool(place.said and place.after) and not place.text[place.match.start() - 1].isspace()


def read_unit_alone(place: Place) -> str:
    """Unit or currency without a number: one of them behind a word for per, else several."""
    locale, written = place.locale, place.match["unit"]
    row = locale.rows("unit").get(written) or locale.rows("currency")[written]
    is_one = place.before.lower() in locale.words("per_words") or place.said.lower() in locale.words("per_words")
    return noun_form(locale, row, Amount("", "1" if is_one else "100")).replace("{}", "").strip()


def read_address(place: Place) -> str:
    """Parts of an address with the names of the signs between them."""
    locale = place.locale
    names = {**locale.rows("sign"), **locale.rows("address")}
    written = re.sub(r"\Ahttps?://", "", place.match.group()).rstrip("/")
    said = []
    for part in re.findall(r"[^\W\d_]+|[0-9]+|[^\w]|_", written):
        if part[0].isdigit():
            said.append(whole(locale, part) if len(part) < 5 else digits(locale, part))
        elif part.isalpha():
            said.append(part if part != "www" else "w w w")
        elif part in names:
            said.append(names[part].spoken)
    return " ".join(said)
