"""Readers of ordinals: by an ending (2e, 3-го), by a full stop (2. gün), and of days at the start of a span."""

from lexicon.locales.counted import noun_behind
from lexicon.locales.dates import day_words
from lexicon.locales.nouns import gender_of
from lexicon.locales.numbers import Grammar, cardinal, ordinal, year
from lexicon.locales.place import Place


def read_suffixed(place: Place) -> str | None:
    """Number with an ending that says how it is read: 1er, 2º, 3-го, 80er."""
    row = place.locale.rows("suffix")[place.match["suffix"]]
    n, grammar = int(place.match["digits"]), place.grammar("ordinal")
    if place.match["suffix"] == "°" and not noun_behind(place):  # 25° are degrees
        return None
    noun = noun_behind(place)
    case = row.details.get("noun", "") if noun else ""  # tercer piso
    grammar = Grammar(row.details.get("gender", grammar.gender), case or row.details.get("case", grammar.case))
    if noun and noun[-1] in row.details:  # на 1-й странице
        grammar = Grammar(*row.details[noun[-1]].split(" "))
    if "tens" in row.details and n % 10 == 0 and n > 10:  # 90-е годы
        grammar = Grammar(case=row.details["tens"])
    if row.spoken == "ordinal":
        return ordinal(place.locale, n, grammar)
    if n == 1 and "one" in row.details:  # 1-комнатная
        return row.spoken.format(row.details["one"])
    said = year(place.locale, n) if n > 1100 and place.locale.setting("years") else cardinal(place.locale, n, grammar)
    return row.spoken.format(said)


def read_dotted_ordinal(place: Place) -> str | None:
    """Ordinal with a full stop (der 5. Platz, 2. gün), also at the end of a sentence (am 3.); else None."""
    locale, following = place.locale, place.after
    if place.requires_ordinal:  # it is one without a full stop: na peronie 4. Potem ...
        return None
    grammar = place.grammar("ordinal")
    starts_sentence = following in locale.words("function_words") and following[:1].isupper()
    if (not following or starts_sentence) and not place.ends_in_ordinal:
        return None
    is_known = following.lower() in locale.words("ordinal_nouns")
    is_within = following[:1].islower() and locale.setting("dotted_ordinals") == "small"
    if not (is_known or is_within or grammar.case):
        return None
    gender = gender_of(locale, following)
    case = grammar.case
    own = locale.rows("case").get(f"ordinal {place.before.lower()} {gender}")
    said = ordinal(locale, int(place.match["digits"]), Grammar(gender, own.spoken if own else case))
    return f"{said}." if starts_sentence else said


def read_first_day(place: Place) -> str | None:
    """First day of a span of days in one month, with the word for to: vom 1.-5. Mai."""
    return f"{day_words(place, int(place.match['day']))} {place.locale.setting('to')}".rstrip() + " "
