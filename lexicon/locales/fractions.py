"""Reader of fractions: ½ Liter, 3/4, deux heures et demie."""

import unicodedata

from lexicon.locales.counted import noun_behind
from lexicon.locales.nouns import gender_of, noun_form
from lexicon.locales.numbers import Amount, Grammar, whole
from lexicon.locales.place import Place
from lexicon.locales.tables import Locale, Row


def read_divided(place: Place) -> str | None:
    """Whole number and a fraction with the noun between them: deux heures et demie; None where it is behind."""
    locale = place.locale
    integer, noun = place.match["integer"], place.match["noun"]
    row = _row(locale, integer, *_parts(place))
    gender = gender_of(locale, noun)
    if row is None or "behind" not in row.details or not noun[0].islower() or noun in locale.rows("unit"):
        return None
    said = whole(locale, integer, Grammar(gender))
    return f"{said} {noun} {row.details.get(gender, row.details['behind'])}"


def read_fraction(place: Place) -> str:
    """Fraction of a sign (½) or of two numbers, behind a whole number or alone, with a unit."""
    locale, integer = place.locale, place.match["integer"] or ""
    top, bottom = _parts(place)
    noun, gender = _noun(place, integer)
    row = _row(locale, integer, top, bottom)
    if integer and row:
        said = whole(locale, integer, Grammar(gender))
        if noun and "behind" in row.details:
            return f"{said} {noun} {row.details.get(gender, row.details['behind'])}"
        return f"{row.details.get(gender, row.spoken).format(said)} {noun}".rstrip()
    known = locale.rows("fraction")
    row = known.get(f"{top}/{bottom}") or known.get(f"/{bottom}")
    if row:
        case = place.grammar("fraction").case  # mit einem halben Liter
        forms = (row.details.get(key) for key in (f"{gender} {case}".strip(), case, gender) if key)
        part = next(filter(None, forms), row.spoken.format(whole(locale, top)))
    else:
        part = f"{whole(locale, top)} {locale.setting('over')} {whole(locale, bottom)}"
    said = locale.setting("mixed", "{} {}").format(whole(locale, integer), part) if integer else part
    return f"{said} {noun}".rstrip()


def _parts(place: Place) -> tuple[str, str]:
    found = place.match.groupdict()
    sign = found["vulgar"] or found.get("sign")
    if sign:
        top, _, bottom = unicodedata.normalize("NFKC", sign).partition("⁄")
        return top, bottom
    return found["top"] or found.get("first") or "", found["bottom"] or found.get("second") or ""


def _row(locale: Locale, integer: str, top: str, bottom: str) -> Row | None:
    """Row of a fraction behind a whole number: anderhalf, {} et demi."""
    known = locale.rows("fraction")
    return known.get(f"{integer}+{top}/{bottom}") or known.get(f"+{top}/{bottom}")


def _noun(place: Place, integer: str) -> tuple[str, str]:
    """Unit behind a fraction in its words (empty for another noun), and its gender."""
    locale, written = place.locale, place.match["noun"] or ""
    unit = locale.rows("unit").get(written)
    if unit is None:
        return "", gender_of(locale, noun_behind(place))
    is_one = not integer and len(unit.forms) == 2  # medio kilogramo; half a kilogram is the genitive in Russian
    noun = unit.forms[0] if is_one else noun_form(locale, unit, Amount("", integer or "1", "5"))
    return noun, unit.details.get("gender") or gender_of(locale, unit.forms[0])
