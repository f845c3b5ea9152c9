"""Reader of fractions: ½ Liter, 3/4, deux heures et demie."""

import unicodedata

from lexicon.locales.nouns import gender_of, noun_form
from lexicon.locales.numbers import Amount, Grammar, whole
from lexicon.locales.place import Place
from lexicon.locales.tables import Locale, Row


def read_fraction(place: Place) -> str | None:
    """Fraction of a sign (½) or of two numbers, behind a whole number or alone."""
    locale, match = place.locale, place.match
    if match["vulgar"]:
        top, _, bottom = unicodedata.normalize("NFKC", match["vulgar"]).partition("⁄")
    else:
        top, bottom = match["top"], match["bottom"]
    integer = match["integer"] or ""
    noun, gender = _noun(place, integer)
    known = locale.rows("fraction")
    mixed = known.get(f"{integer}+{top}/{bottom}") or known.get(f"+{top}/{bottom}")
    if integer and mixed:
        return _mixed(locale, integer, mixed, noun, gender)
    row = known.get(f"{top}/{bottom}") or known.get(f"/{bottom}")
    if row:
        part = (noun and row.details.get(gender)) or row.spoken.format(whole(locale, top))
    else:
        part = f"{whole(locale, top)} {locale.setting('over')} {whole(locale, bottom)}"
    said = locale.setting("mixed", "{} {}").format(whole(locale, integer), part) if integer else part
    return f"{said} {noun}".rstrip()


def _noun(place: Place, integer: str) -> tuple[str, str]:
    """Noun behind a fraction, with a unit in its words, and its gender."""
    locale, written = place.locale, place.match["noun"] or ""
    unit = locale.rows("unit").get(written)
    if unit is None:
        return written, gender_of(locale, written)
    is_one = not integer and len(unit.forms) == 2  # medio kilogramo; half a kilogram is the genitive in Russian
    noun = unit.forms[0] if is_one else noun_form(locale, unit, Amount("", integer or "1", "5"))
    return noun, unit.details.get("gender") or gender_of(locale, unit.forms[0])


def _mixed(locale: Locale, integer: str, row: Row, noun: str, gender: str) -> str:
    said = whole(locale, integer, Grammar(gender))
    if noun and "behind" in row.details:  # deux heures et demie
        return f"{said} {noun} {row.details.get(gender, row.details['behind'])}"
    return f"{row.details.get(gender, row.spoken).format(said)} {noun}".rstrip()
