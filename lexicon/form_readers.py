"""Readers of `lexicon.normalize`: the words of a matched written form, given the word before it."""

import re
import unicodedata
from collections.abc import Callable

from lexicon import written_forms as readings
from lexicon.dictionary import word_set
from lexicon.informal_words import informal_word, plain_word
from lexicon.number_contexts import words_in_context
from lexicon.number_words import cardinal_words, digit_words, number_words, ordinal_words, roman_value, year_words
from lexicon.pauses import MARKS
from lexicon.scripts import language_scripts, letter_name, letter_script
from lexicon.sentence_ends import is_abbreviated, starts_sentence

NEVER_LETTERS = frozenset({"II", "III", "VII", "VIII"})  # Roman numerals that abbreviate nothing
TITLES = frozenset({"title", "doctor", "saint"})  # contexts of abbreviations before names
_BEFORE_YEAR = word_set(
    "in since of by from until till before after during early late mid circa around year copyright to and between "
    "summer winter spring fall autumn class"
)
BEFORE_ROMAN = word_set(
    "chapter part volume act scene section book war phase type level class appendix article figure table episode "
    "season stage grade title rocky unit version schedule group tier bowl fantasy "
    "apollo gemini round"
)
RULERS = word_set(
    "henry louis elizabeth george edward charles william james richard mary philip pius benedict paul francis "
    "frederick wilhelm nicholas catherine peter alexander napoleon ramses leo gregory clement innocent urban ivan "
    "ferdinand henri boniface constantine albert margaret"
)
# common names: John I is hardly a king where a sentence goes on with I
_RULERS_NOT_FIRST = word_set(
    "john robert alfonso carl christian gustav otto leopold victor sixtus julius adrian martin stephen eugene "
    "baldwin philippe rama amenhotep thutmose ludwig umberto celestine nikolai karl"
)
Reader = Callable[[re.Match[str], str], str]
_BEFORE_NAME = re.compile(r" [A-Z]")
_BEFORE_LETTER = re.compile(r"[ -][a-z]")
_BEFORE_NUMBER = re.compile(r" ?[0-9]")
_AMID_SENTENCE = re.compile(r" [a-z]|[:?,]")
_DETERMINED = re.compile(r"\b(?:my|your|his|her|our|their|its|the|a) (?:[a-z]+ )?\Z", re.IGNORECASE)
_NO_NAMES = word_set("The On In At And But When Dear I If As To From Near")
_CENTURY = re.compile(r"(?:st|nd|rd|th)?[ -](?:[Cc]entur(?:y|ies)|[Dd]ynasty|[Oo]lympi)")
_AT_END = re.compile(r"\s*$")
CONTEXT_AFTER = 48  # characters after a full stop that decide whether a sentence begins there
# 50-50, 80-20: shares of a whole
_SPLITS = frozenset((str(part), str(100 - part)) for part in range(10, 95, 5) if part >= 50 or part % 10 == 0)
_NAMED_FRACTIONS = {"24/7": "twenty-four seven", "9/11": "nine eleven", "50/50": "fifty fifty"}
_SCORED = re.compile(
    r"\b(?:scor|rat(?:e|ing)|grade|quiz|test|exam|review|mark|points?|got|gave|give|solid|perfect)", re.I
)
_OUT_OF = frozenset({"5", "10", "20", "50", "100"})  # of which marks are given
_ALONE_AFTER = re.compile(r"\s*(?:[.,;:!?)]|\Z)|,? (?:on|in|for|from|by|and|but|at|with|to|so|because|this|last)\b")
_PEOPLE_AFTER = re.compile(
    r" (?!miles|cups|inches|feet|pounds|ounces|\w*spoons|acres|lit|met|pints|quarts|yards|hours|seconds|times)"
    r"(?:people|men|women|children|[a-z]{3,}s)\b"
)
_VISION = re.compile(" (?:vision|hindsight|eyesight)")
_EQUATION = re.compile(r"\s*[=+×÷*<>≤≥-]\s*[0-9a-z]")
_PRESSURES = (range(60, 261), range(30, 161))  # mmHg, of the heart's beat and between two
# Times behind a slash, by which something is counted.
_RATES = {"mo": "month", "wk": "week", "yr": "year", "hr": "hour", "min": "minute", "sec": "second"}
_RATES |= {name: name for name in ("day", "night", "person")}


def text_before(m: re.Match[str]) -> str:
    """Text before a form that decides how it is read."""
    return m.string[max(0, m.start() - CONTEXT_AFTER) : m.start()]


def read_money(m: re.Match[str], previous: str) -> str:
    """$5.20 is five dollars and twenty cents."""
    sign = readings.DOLLARS.get(m["sign"][:-1], m["sign"])
    if m["moneyto"]:
        return f"{number_words(m['moneya'].lstrip('-'))} to {readings.money_words(m['moneyto'], sign, m['mag'] or '')}"
    words = readings.money_words((m["moneyminus"] or "") + m["moneya"], sign, m["mag"] or "")
    return _as_attribute(words, sign, m, previous) if m["mag"] or "." not in m["moneya"] else words


def read_money_after(m: re.Match[str], previous: str) -> str:
    """5 EUR is five euros, a 75¢ stamp a seventy-five cent stamp."""
    sign = m["sign2"] or m["sign3"]
    words = readings.money_words(m["moneyb"], sign, m["mag2"] or "")
    return words if "." in m["moneyb"] else _as_attribute(words, sign, m, previous)


def _as_attribute(words: str, currency: str, m: re.Match[str], previous: str) -> str:
    """Money in the singular before a noun: a $5 bill."""
    single, many = readings.CURRENCIES[currency][:2]
    is_attribute = previous.lower() in {"a", "an"} and _BEFORE_LETTER.match(m.string, m.end())
    return words.removesuffix(many) + single if is_attribute and words.endswith(many) else words


def read_measure(m: re.Match[str], previous: str) -> str:
    """5 km is five kilometers, a 5 km run a five kilometer run."""
    is_joined = m.string[m.end("amount")] == "-" or previous.lower() in {"a", "an"}
    if is_joined and _BEFORE_LETTER.match(m.string, m.end()):
        return f"{readings.signed_number_words(m['amount'])} {readings.unit_words(m['unit'], is_one=True)}"
    return readings.measure_words(m["amount"], m["unit"])


def read_telephone(m: re.Match[str], _: str) -> str:
    """555-1234 is five five five, one two three four."""
    return readings.telephone_words(m.group())


def read_version(m: re.Match[str], _: str) -> str:
    """1.2.3 is one point two point three."""
    return " point ".join(number_words(part) for part in m.group().split("."))


def read_points(m: re.Match[str], _: str) -> str:
    """0.2 pp is zero point two percentage points, 25 bps twenty-five basis points."""
    number, is_basis = m.group().rstrip(" bps"), m.group().endswith("bps")
    return f"{number_words(number)} {'basis' if is_basis else 'percentage'} point{'s' if number != '1' else ''}"


def read_power(m: re.Match[str], _: str) -> str:
    """^2 is squared."""
    return {"2": "squared", "3": "cubed"}.get(
        m["power"]
    ) or f"to the power of {readings.signed_number_words(m['power'])}"


def read_thousands(m: re.Match[str], _: str) -> str:
    """10k is ten thousand."""
    return f"{number_words(m['kilo'])} thousand"


def read_plain_number(m: re.Match[str], previous: str) -> str:
    """A number by itself: a year, a cardinal, a decimal, or digits."""
    return words_in_context(m, m.group()) or _number(m.group(), previous)


def read_owner(m: re.Match[str], _: str) -> str:
    """The 4's of no. 4's turn is four's."""
    return f"{number_words(m['owner'])}'s"


def read_packs(m: re.Match[str], _: str) -> str:
    """2 x 400g tins is two four hundred gram tins."""
    return f"{number_words(m['packs'])} {number_words(m['content'])} {readings.unit_words(m['punit'], is_one=True)}"


def read_per(m: re.Match[str], _: str) -> str:
    """The /kg of $3/kg is per kilogram."""
    if m["per"]:
        return f"per {readings.unit_words(m['per'], is_one=True)}"
    return f"per {_RATES.get(m['perword'], m['perword'])}"


def read_times(m: re.Match[str], _: str) -> str:
    """The 3x of 3x/day is three times."""
    return "once" if m["times"] == "1" else f"{number_words(m['times'])} times"


def read_who(m: re.Match[str], previous: str) -> str:
    """The WHO is spelled, WHO is not."""
    return "W H O" if previous.lower() == "the" else m.group()


def read_initial(m: re.Match[str], previous: str) -> str:
    """The J of J. Smith; a letter that ends a sentence keeps its full stop."""
    if m.group()[0] in "IVXLCDM" and previous.lower() in RULERS | BEFORE_ROMAN:
        return m.group()
    is_first = not previous or previous in MARKS
    if not is_first and starts_sentence(m.string[m.end() : m.end() + CONTEXT_AFTER].lstrip()):
        return m.group()
    starts_name = is_first or previous[:1].isupper() or previous in {"by", "and", "with"}
    return m.group()[0] if starts_name else m.group()


def read_nothing(_m: re.Match[str], _: str) -> str:
    """Nothing for white space."""
    return ""


def read_punctuation(m: re.Match[str], _: str) -> str:
    """A punctuation mark; nothing for the full stop of an abbreviation within a sentence (Insp. Morse)."""
    before, after = m.string[max(m.start() - 24, 0) : m.start()], m.string[m.end() : m.end() + CONTEXT_AFTER]
    return "" if m.group() == "." and is_abbreviated(before, after.lstrip(), "en") else m.group()


def read_dot(m: re.Match[str], _: str) -> str:
    """A full stop within a form without a reader of its own."""
    before, after = m.string[: m.start()][-1:], m.string[m.end() : m.end() + 1]
    return "dot" if before.isalnum() and after.isalnum() else "."


def read_range(m: re.Match[str], previous: str) -> str:
    """5-10 km is five to ten kilometers, 1990-1995 two years."""
    # 1815-1820: two numbers of four digits are years, whatever stands before
    before = "in" if len(m["from"]) == len(m["to"]) == 4 else previous
    if not m["runit"] and (m["from"], m["to"]) in _SPLITS:
        return f"{number_words(m['from'])} {number_words(m['to'])}"
    words = f"{_number(m['from'], before)} to {_number(m['to'], before)}"
    if m["sign4"]:
        return f"{_number(m['from'], '')} to {readings.money_words(m['to'], m['sign4'], '')}"
    return f"{words} {readings.unit_words(m['runit'])}" if m["runit"] else words


def _number(written: str, previous: str) -> str:
    if len(written) == 4 and written.isdigit():
        value = int(written)
        # four digits of these years are a year without more; earlier ones only after "in", "since" ...
        if 1900 <= value <= 2099 or (1100 <= value < 1900 and previous.lower() in _BEFORE_YEAR):
            return year_words(value)
    if len(written) > 1 and written[0] == "0" and written.isdigit():
        return digit_words(written)
    return readings.signed_number_words(written)


def read_fraction(m: re.Match[str], previous: str) -> str:
    """-1/2 is minus one half; without the sign see `_fraction_words`."""
    return f"minus {_fraction_words(m)}" if m["fractionminus"] else _fraction_words(m)


def _fraction_words(m: re.Match[str]) -> str:
    """3/4 is three quarters, 10/10 ten out of ten, 120/80 one hundred twenty over eighty, 245/3 for three wickets."""
    top, bottom = m["top"], m["bottom"]
    unit = m["funit"]
    if m["whole"] or unit:
        is_one = not m["whole"] and int(top) <= int(bottom)
        name = "" if not unit else readings.unit_words("inch" if unit == "in" else unit, is_one=is_one)
        return f"{readings.ratio_words(top, bottom, m['whole'] or '')} {name}".strip()
    if m["frac"] == "20/20" and _VISION.match(m.string, m.end()):
        return "twenty twenty"
    if m["frac"] in _NAMED_FRACTIONS:
        return _NAMED_FRACTIONS[m["frac"]]
    relation = _relation(m, int(top), int(bottom))
    return f"{number_words(top)} {relation} {number_words(bottom)}" if relation else readings.ratio_words(top, bottom)


def _relation(m: re.Match[str], top: int, bottom: int) -> str:
    """Word for a slash between two numbers; empty in a fraction."""
    if top == bottom:
        return "out of"
    if top in _PRESSURES[0] and bottom in _PRESSURES[1] and top > bottom:
        return "over"
    if top >= 30 and bottom <= 10 and not _EQUATION.match(m.string, m.end()):
        return "for"
    if m["bottom"] in _OUT_OF and top < bottom and _PEOPLE_AFTER.match(m.string, m.end()):
        return "out of"
    is_mark = m["bottom"] in _OUT_OF and top < bottom and _ALONE_AFTER.match(m.string, m.end())
    return "out of" if is_mark and _SCORED.search(text_before(m)) else ""


def read_out_of(m: re.Match[str], _: str) -> str:
    """4.5/5 is four point five out of five."""
    return f"{number_words(m['outtop'])} out of {number_words(m['outbottom'])}"


def read_ordinal(m: re.Match[str], _: str) -> str:
    """21st is twenty-first."""
    return ordinal_words(int(m["ord"].replace(",", "")))


def read_roman_numeral(m: re.Match[str], previous: str) -> str:
    """Henry VIII is Henry the eighth, Chapter IV Chapter four; elsewhere capitals are read as letters."""
    value, before = roman_value(m.group()), previous.lower()
    if value and _CENTURY.match(m.string, m.end()):
        return ordinal_words(value)
    # I is the pronoun unless a name stands before it
    if value == 1 and not previous[:1].isupper():
        return m.group()
    if value < 40 and ((value and before in RULERS) or (value > 1 and before in _RULERS_NOT_FIRST)):
        return f"the {ordinal_words(value)}"
    if value and (before in BEFORE_ROMAN or m.group() in NEVER_LETTERS):
        return cardinal_words(value)
    return m.group()


def keep_full_stop(words: str, m: re.Match[str]) -> str:
    """Keep the full stop of an abbreviation that also ends the sentence."""
    after = m.string[m.end() : m.end() + CONTEXT_AFTER]
    ends = _AT_END.match(m.string, m.end()) or (after[:1].isspace() and starts_sentence(after.lstrip()))
    return f"{words}." if ends and m.group().endswith(".") else words


def read_abbreviation(m: re.Match[str], previous: str) -> str:
    """Dr. Smith is Doctor Smith, Main St. is Main Street, No. 5 number five."""
    table = readings.read_table("abbreviations.tsv")
    spoken, context = table.get(m["abbr"]) or table[m["abbr"].capitalize()]
    before_name = bool(_BEFORE_NAME.match(m.string, m.end()))
    after_name = previous[:1].isupper() and previous not in _NO_NAMES
    if context == "number" and not (_BEFORE_NUMBER.match(m.string, m.end()) or _is_named_number(m)):
        return m.group()
    if context == "doctor" and after_name and not before_name:
        return keep_full_stop("Drive", m)
    if context == "saint" and (after_name or not before_name):
        return keep_full_stop("Street", m)
    return spoken if context in {"title", "number"} else keep_full_stop(spoken, m)


def _is_named_number(m: re.Match[str]) -> bool:
    """Whether the number itself is named: my new no. is, his account no. by noon."""
    if m["abbr"].lower() != "no" or not _AMID_SENTENCE.match(m.string, m.end()):
        return False
    return _DETERMINED.search(text_before(m)) is not None


def read_dotted_letters(m: re.Match[str], _: str) -> str:
    """F.B.I. is FBI; I.I. is I I, as II would be a number; A.A.A.A. is A A A A, as AAAA would be a stretched word."""
    letters = m.group().replace(".", "").upper()
    is_apart = letters in NEVER_LETTERS or plain_word(letters) != letters
    return keep_full_stop(" ".join(letters) if is_apart else letters, m)


def read_scientific(m: re.Match[str], _: str) -> str:
    """1e-9 is one times ten to the minus nine."""
    power = readings.signed_number_words(m["exponent"].removeprefix("+"))
    return f"{readings.signed_number_words(m['mantissa'])} times ten to the {power}{_unit_words(m['sunit'])}"


def read_feet_inches(m: re.Match[str], _: str) -> str:
    """6 ft 2 in is six feet two inches."""
    return f"{readings.measure_words(m['ft'], 'ft')} {readings.measure_words(m['ftin'], 'inch')}"


def read_inches(m: re.Match[str], _: str) -> str:
    """3 in. is three inches."""
    return readings.measure_words(m["inchamount"], "inch")


def read_dimensions(m: re.Match[str], _: str) -> str:
    """3x4 is three by four."""
    return f"{number_words(m['across'])} by {number_words(m['down'])}{_unit_words(m['gunit'])}"


def _unit_words(unit: str | None) -> str:
    """Plural of a unit after a space; empty for none."""
    return f" {readings.unit_words(unit)}" if unit else ""


def read_sharp(m: re.Match[str], _: str) -> str:
    """C# is C sharp."""
    return f"{m['note']} sharp"


def read_letter_a(m: re.Match[str], _: str) -> str:
    """A4 is A-four; with a space the letter would be an article."""
    return f"A-{number_words(m['sheet']).replace(' ', '-')}"


def read_slashed(m: re.Match[str], _: str) -> str:
    """and/or is and or."""
    known = {"and/or": "and or", "w/o": "without", "w/": "with", "n/a": "not applicable", "N/A": "not applicable"}
    known |= {"b/c": "because", "c/o": "care of"}
    return known[m.group()]


def read_either(m: re.Match[str], _: str) -> str:
    """Input/output is input output, AC/DC AC DC, bits/second bits per second."""
    unit = _RATES.get(m["other"], m["other"])
    if m["either"].endswith("s") and unit in _RATES.values():
        return f"{m['either']} per {unit}"
    third = (m["third"] or "").replace("/", " ")
    return f"{informal_word(m['either'])} {informal_word(m['other'])}{third}"


def read_rate(m: re.Match[str], _: str) -> str:
    """The mg/dL of "in mg/dL" is milligrams per deciliter."""
    return readings.unit_words(m.group())


def read_unchanged(m: re.Match[str], _: str) -> str:
    """The written form itself."""
    return m.group()


def read_unit_name(m: re.Match[str], _: str) -> str:
    """A unit without a number: the kΩ of "in kΩ" is kiloohms."""
    return readings.read_table("units.tsv")[m.group()][1]


def read_letter(m: re.Match[str], _: str) -> str:
    """A single letter of another script is its name: π is pi."""
    return m.group() if letter_script(m.group()) in language_scripts("en") else letter_name(m.group()) or m.group()


def read_symbol(m: re.Match[str], _: str) -> str:
    """The name of a symbol: from the table, else from Unicode."""
    symbol = m.group()
    known = readings.read_table("symbols.tsv").get(symbol)
    if known:
        return known[0]
    category = unicodedata.category(symbol)
    if category[0] == "N":
        value = unicodedata.numeric(symbol)
        return (
            cardinal_words(int(value))
            if value.is_integer()
            else f"{value:.3f}".rstrip("0").replace("0.", "zero point ")
        )
    # emoji and signs without a row are spoken by their Unicode name (decision 015)
    if category[0] == "S":
        return " ".join(re.findall("[a-z]+", unicodedata.name(symbol, "").lower()))
    return symbol if category[0] in "LM" else ""
