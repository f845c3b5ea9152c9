"""Arabic numbers, which take the gender of what is counted, the opposite one from 3 to 10, and a case.

The rules of CLDR have neither. Words are the rows ``numeral`` of the table; grammar after Ryding, A Reference Grammar
of Modern Standard Arabic (2005), chapter 15, without the endings of pause.
"""

from lexicon.locales.tables import Locale

_AND = " و"
_SCALES = (10**9, 10**6, 10**3)


def arabic_number(locale: Locale, n: int, kind: str, is_feminine: bool, is_oblique: bool) -> str:
    """Words of a whole number.

    Parameters
    ----------
    kind
        ``ordinal``: definite (الثالث), to 99; a larger one is a cardinal with the article. Else a cardinal.
    is_feminine, is_oblique
        Gender of what is counted; whether a preposition or a noun governs the number.
    """
    if kind == "ordinal":
        return _ordinal(locale, n, is_feminine, is_oblique)
    parts = []
    rest = n
    for scale in _SCALES:
        many, rest = divmod(rest, scale)
        if many:
            parts.append(_scaled(locale, many, scale, is_oblique))
    if rest or not parts:
        parts.append(_below_thousand(locale, rest, is_feminine, is_oblique))
    return _AND.join(parts)


def _forms(locale: Locale, key: object) -> tuple[str, ...]:
    return locale.rows("numeral")[str(key)].forms


def _scaled(locale: Locale, many: int, scale: int, is_oblique: bool) -> str:
    """Thousands and more: ألف، ألفان، ثلاثة آلاف، خمسة عشر ألفا، مئة ألف."""
    singular, dual, dual_oblique, plural, accusative = _forms(locale, scale)
    if many == 1:
        return singular
    if many == 2:
        return dual_oblique if is_oblique else dual
    last = many % 100
    noun = plural if 3 <= last <= 10 else accusative if last > 10 else singular
    return f"{arabic_number(locale, many, 'cardinal', False, is_oblique)} {noun}"


def _below_thousand(locale: Locale, n: int, is_feminine: bool, is_oblique: bool) -> str:
    hundreds, rest = divmod(n, 100)
    parts = [_forms(locale, hundreds * 100)[-1 if is_oblique else 0]] if hundreds else []
    if rest or not hundreds:
        parts.append(_below_hundred(locale, rest, is_feminine, is_oblique))
    return _AND.join(parts)


def _below_hundred(locale: Locale, n: int, is_feminine: bool, is_oblique: bool) -> str:
    if n <= 12:
        forms = _forms(locale, n)  # masculine, feminine; of 2 and 12 their oblique forms, too
        return forms[min(is_feminine + 2 * is_oblique, len(forms) - 2 + is_feminine) if len(forms) > 1 else 0]
    unit, ten = n % 10, n - n % 10
    if n < 20:
        return f"{_forms(locale, unit)[is_feminine]} {_forms(locale, 'ten')[is_feminine]}"
    tens = _forms(locale, ten)[is_oblique]
    if not unit:
        return tens
    name = _forms(locale, "one")[is_feminine] if unit == 1 else _below_hundred(locale, unit, is_feminine, is_oblique)
    return f"{name}{_AND}{tens}"


def _ordinal(locale: Locale, n: int, is_feminine: bool, is_oblique: bool) -> str:
    rows = locale.rows("numeral")
    if not 1 <= n <= 99:
        return f"ال{arabic_number(locale, n, 'cardinal', is_feminine, is_oblique)}"
    if f"{n}." in rows:
        return _forms(locale, f"{n}.")[is_feminine]
    unit, ten = n % 10, n - n % 10
    name = _forms(locale, "one." if unit == 1 else f"{unit}.")[is_feminine] if unit else ""
    if n < 20:
        return f"{name} {_forms(locale, 'ten')[is_feminine]}"
    tens = f"ال{_forms(locale, ten)[is_oblique]}"
    return f"{name}{_AND}{tens}" if name else tens
