"""What a matched written form says, given the word before it: the readers that `lexicon.normalize` calls."""

import re
import unicodedata
from collections.abc import Callable

from lexicon import written_forms as readings
from lexicon.letters import letter_name
from lexicon.numbers import cardinal, digits, number, ordinal, roman, year
from lexicon.stops import is_abbreviated, starts_sentence
from lexicon.writing_systems import script_of, scripts_of


def _words(written: str) -> frozenset[str]:
    return frozenset(written.split())


_MARKS = frozenset(".,;:!?")
_BEFORE_YEAR = _words(
    "in since of by from until till before after during early late mid circa around year copyright to and between "
    "summer winter spring fall autumn class"
)
_BEFORE_ROMAN = _words(
    "chapter part volume act scene section book war phase type level class appendix article figure table episode "
    "season stage grade title rocky unit version schedule group tier bowl fantasy"
)
_RULERS = _words(
    "henry louis elizabeth george edward charles william james richard mary philip pius benedict paul francis "
    "frederick wilhelm nicholas catherine peter alexander napoleon ramses leo gregory clement innocent urban ivan "
    "ferdinand henri boniface constantine albert margaret"
)


Reader = Callable[[re.Match[str], str], str]


def numeric_date(m: re.Match[str], _: str) -> str:
    """3/15/2024 is March fifteenth; 13/13/13 is no date and is read number by number."""
    first, separator, second, last = m["nd1"], m["ndsep"], m["nd2"], m["ndy"]
    said = readings.numeric_date(int(first), int(second), last, separator)
    sign = {"/": "slash", ".": "point", "-": "dash"}[separator]
    return said or f" {sign} ".join(number(part) for part in (first, second, last))


def iso_date(m: re.Match[str], _: str) -> str:
    """2024-03-15 is March fifteenth, twenty twenty-four."""
    month, day = int(m["isom"]), int(m["isod"])
    if 1 <= month <= 12 and 1 <= day <= 31:
        return readings.date(day, month, m["isoy"])
    return " dash ".join(number(m[part]) for part in ("isoy", "isom", "isod"))


def month_first(m: re.Match[str], _: str) -> str:
    """March 3, 2024 is March third, twenty twenty-four."""
    month, day, last = readings.month_number(m["mf"]), int(m["mfd"]), m["mfy"] or ""
    if 1 <= day <= 31:
        return readings.date(day, month, last)
    return f"{readings.MONTHS[month - 1]} {number(m['mfd'])}" + (f", {year(int(last))}" if last else "")


def month_year(m: re.Match[str], _: str) -> str:
    """March 2024 is March twenty twenty-four."""
    return f"{readings.MONTHS[readings.month_number(m['my']) - 1]} {year(int(m['myy']))}"


def day_first(m: re.Match[str], previous: str) -> str:
    """3 March 2024 is the third of March, twenty twenty-four."""
    month, day, last = readings.month_number(m["df"]), int(m["dfd"]), m["dfy"] or ""
    if not 1 <= day <= 31:
        return f"{number(m['dfd'])} {readings.MONTHS[month - 1]}" + (f" {year(int(last))}" if last else "")
    said = readings.date(day, month, last, day_first=True)
    return said.removeprefix("the ") if previous.lower() == "the" else said


def clock(m: re.Match[str], _: str) -> str:
    """3:05 pm is three oh five PM; 26:70 is no time but twenty-six to seventy."""
    hour, minute = m["hh"] or m["hh2"] or m["hh3"], m["mm"] or m["mm3"] or "0"
    half = m["half"] or m["half2"] or m["half3"] or ""
    if int(hour) > 24 or int(minute) > 59:
        after = f" {half.replace('.', '').upper()}".rstrip()
        return " to ".join(cardinal(int(part)) for part in (hour, minute, m["ss"]) if part) + after
    return _ended(readings.time_of_day(int(hour), int(minute), int(m["ss"] or 0), half), m)


def proportion(m: re.Match[str], _: str) -> str:
    """3:1 is three to one."""
    return f"{cardinal(int(m['ra']))} to {cardinal(int(m['rb']))}"


def money(m: re.Match[str], _: str) -> str:
    """$5.20 is five dollars and twenty cents."""
    sign = "USD" if m["sign"] == "US$" else m["sign"]
    if m["moneyto"]:
        return f"{number(m['moneya'].lstrip('-'))} to {readings.money(m['moneyto'], sign, m['mag'] or '')}"
    return readings.money((m["moneyminus"] or "") + m["moneya"], sign, m["mag"] or "")


def money_after(m: re.Match[str], _: str) -> str:
    """5 EUR is five euros."""
    return readings.money(m["moneyb"], m["sign2"] or m["sign3"], m["mag2"] or "")


def measure(m: re.Match[str], _: str) -> str:
    """5 km is five kilometers."""
    return readings.measure(m["amount"], m["unit"])


def telephone(m: re.Match[str], _: str) -> str:
    """555-1234 is five five five, one two three four."""
    return readings.telephone(m.group())


def decade(m: re.Match[str], _: str) -> str:
    """1990s is nineteen nineties."""
    return readings.decade_of(m["decade"])


def version(m: re.Match[str], _: str) -> str:
    """1.2.3 is one point two point three."""
    return " point ".join(number(part) for part in m.group().split("."))


def power(m: re.Match[str], _: str) -> str:
    """^2 is squared."""
    return {"2": "squared", "3": "cubed"}.get(m["power"]) or f"to the power of {readings.signed(m['power'])}"


def thousands(m: re.Match[str], _: str) -> str:
    """10k is ten thousand."""
    return f"{number(m['kilo'])} thousand"


def plain_number(m: re.Match[str], previous: str) -> str:
    """A number by itself: a year, a cardinal, a decimal, or digits."""
    return _number(m.group(), previous)


def initial(m: re.Match[str], previous: str) -> str:
    """The J of J. Smith; a letter that ends a sentence keeps its full stop."""
    if m.group()[0] in "IVXLCDM" and previous.lower() in _RULERS | _BEFORE_ROMAN:
        return m.group()
    is_first = not previous or previous in _MARKS
    if not is_first and starts_sentence(m.string[m.end() : m.end() + _SEEN_BEHIND].lstrip()):
        return m.group()
    starts_name = is_first or previous[:1].isupper() or previous in {"by", "and", "with"}
    return m.group()[0] if starts_name else m.group()


def nothing(_m: re.Match[str], _: str) -> str:
    """Space says nothing."""
    return ""


def mark(m: re.Match[str], _: str) -> str:
    """Punctuation; nothing for the full stop of an abbreviation that ends no sentence (Insp. Morse)."""
    before, after = m.string[max(m.start() - 24, 0) : m.start()], m.string[m.end() : m.end() + _SEEN_BEHIND]
    return "" if m.group() == "." and is_abbreviated(before, after.lstrip(), "en") else m.group()


def dot(m: re.Match[str], _: str) -> str:
    """A full stop inside a form that nothing else reads."""
    before, after = m.string[: m.start()][-1:], m.string[m.end() : m.end() + 1]
    return "dot" if before.isalnum() and after.isalnum() else "."


def span(m: re.Match[str], previous: str) -> str:
    """5-10 km is five to ten kilometers, 1990-1995 two years."""
    before = "in" if len(m["from"]) == len(m["to"]) == 4 else previous
    said = f"{_number(m['from'], before)} to {_number(m['to'], before)}"
    if m["sign4"]:
        return f"{_number(m['from'], '')} to {readings.money(m['to'], m['sign4'], '')}"
    return f"{said} {readings.table('units.tsv')[m['runit']][1]}" if m["runit"] else said


def _number(written: str, previous: str) -> str:
    if len(written) == 4 and written.isdigit():
        value = int(written)
        if 1900 <= value <= 2099 or (1100 <= value < 1900 and previous.lower() in _BEFORE_YEAR):
            return year(value)
    if len(written) > 1 and written[0] == "0" and written.isdigit():
        return digits(written)
    return readings.signed(written)


def fraction(m: re.Match[str], _: str) -> str:
    """3/4 is three quarters."""
    known = {"24/7": "twenty-four seven", "9/11": "nine eleven", "50/50": "fifty fifty"}.get(m["frac"])
    return known or readings.ratio(m["top"], m["bottom"], m["whole"] or "")


def ordinal_number(m: re.Match[str], _: str) -> str:
    """21st is twenty-first."""
    return ordinal(int(m["ord"].replace(",", "")))


def roman_numeral(m: re.Match[str], previous: str) -> str:
    """Henry VIII is Henry the eighth, Chapter IV Chapter four; elsewhere capitals stay letters."""
    value, before = roman(m.group()), previous.lower()
    if value == 1 and not previous[:1].isupper():
        return m.group()
    if value and before in _RULERS and value < 40:
        return f"the {ordinal(value)}"
    if value and before in _BEFORE_ROMAN:
        return cardinal(value)
    return m.group()


_BEFORE_NAME = re.compile(r" [A-Z]")
_BEFORE_NUMBER = re.compile(r" ?[0-9]")
_NO_NAMES = _words("The On In At And But When Dear I If As To From Near")
_AT_END = re.compile(r"\s*$")
_SEEN_BEHIND = 48  # characters behind a full stop that tell whether a sentence begins there


def _ended(words: str, m: re.Match[str]) -> str:
    """Keep the full stop of an abbreviation that also ends the sentence."""
    after = m.string[m.end() : m.end() + _SEEN_BEHIND]
    ends = _AT_END.match(m.string, m.end()) or (after[:1].isspace() and starts_sentence(after.lstrip()))
    return f"{words}." if ends and m.group().endswith(".") else words


def abbreviation(m: re.Match[str], previous: str) -> str:
    """Dr. Smith is Doctor Smith, Main St. is Main Street, No. 5 number five."""
    spoken, context = readings.table("abbreviations.tsv")[m["abbr"]]
    before_name = bool(_BEFORE_NAME.match(m.string, m.end()))
    after_name = previous[:1].isupper() and previous not in _NO_NAMES
    if context == "number" and not _BEFORE_NUMBER.match(m.string, m.end()):
        return m.group()
    if context == "doctor" and after_name and not before_name:
        return _ended("Drive", m)
    if context == "saint" and (after_name or not before_name):
        return _ended("Street", m)
    return spoken if context in {"title", "number"} else _ended(spoken, m)


def dotted(m: re.Match[str], _: str) -> str:
    """F.B.I. is FBI."""
    return _ended(m.group().replace(".", "").upper(), m)


def address(m: re.Match[str], _: str) -> str:
    """a@b.com is a at b dot com."""
    return readings.address(m.group())


def hashtag(m: re.Match[str], _: str) -> str:
    """#MachineLearning is hashtag machine learning."""
    said = readings.hashtag(m.group())
    return f"{'hashtag' if m.group()[0] == '#' else 'at'} {said}".strip()


def feet(m: re.Match[str], _: str) -> str:
    """5'10 is five foot ten."""
    inches = f" {cardinal(int(m['inches']))}" if m["inches"] else ""
    return f"{cardinal(int(m['feet']))} foot{inches}"


def slashed(m: re.Match[str], _: str) -> str:
    """and/or is and or."""
    known = {"and/or": "and or", "w/o": "without", "w/": "with", "n/a": "not applicable", "N/A": "not applicable"}
    return known[m.group()]


def same(m: re.Match[str], _: str) -> str:
    """What is written."""
    return m.group()


def unit_name(m: re.Match[str], _: str) -> str:
    """A unit without a number: the kΩ of "in kΩ" is kiloohms."""
    return readings.table("units.tsv")[m.group()][1]


def letter(m: re.Match[str], _: str) -> str:
    """A single letter of another script is its name: π is pi."""
    return m.group() if script_of(m.group()) in scripts_of("en") else letter_name(m.group()) or m.group()


def symbol(m: re.Match[str], _: str) -> str:
    """The name of a symbol: from the table, else from Unicode."""
    symbol = m.group()
    known = readings.table("symbols.tsv").get(symbol)
    if known:
        return known[0]
    category = unicodedata.category(symbol)
    if category[0] == "N":
        value = unicodedata.numeric(symbol)
        return cardinal(int(value)) if value.is_integer() else f"{value:.3f}".rstrip("0").replace("0.", "zero point ")
    if category[0] == "S":
        return " ".join(re.findall("[a-z]+", unicodedata.name(symbol, "").lower()))
    return symbol if category[0] in "LM" else ""
