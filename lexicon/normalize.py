"""Spoken form of a text, the input of a voice: English numbers, dates, money, units and symbols become words.

One scan from left to right: each written form has a pattern and a reader. The result consists of words, with
apostrophes and hyphens inside them, and sentence punctuation; normalisation is idempotent and linear in time.
"""

import functools
import re
from collections.abc import Iterator
from dataclasses import replace

from lexicon import form_readers as forms
from lexicon import written_forms as readings
from lexicon.canonical import canonical_text, signs_before_vowels
from lexicon.capitals import sentence_case
from lexicon.locales.reading import read_forms
from lexicon.number_words import MAX_CARDINAL_DIGITS
from lexicon.pauses import MARKS, last_mark
from lexicon.scripts import name_foreign_letters, name_letters_in_words
from lexicon.sources import written_groups
from lexicon.vowels import add_vowels
from lexicon.written_forms import WrittenForm

_FULL_MONTH = "|".join(readings.MONTHS)
_MONTH = rf"(?:{_FULL_MONTH}|(?:Jan|Feb|Mar|Apr|Jun|Jul|Aug|Sept?|Oct|Nov|Dec)\b\.?)"
_AMOUNT = r"(?:[0-9]{1,3}(?:,[0-9]{3}){1,6}(?:\.[0-9]{1,20})?(?!,?[0-9])|[0-9]{1,400}(?:\.[0-9]{1,20})?|\.[0-9]{1,20})"
_SIGNED = rf"(?:(?<![\w.)])[+-])?{_AMOUNT}"
_SIGN = r"(?:US\$|[$£€¥₹₩₽₺₿])"
_CODE = "|".join(code for code in readings.CURRENCIES if code.isalpha())
_MAGNITUDE = r"(?:thousand|million|billion|trillion|bn|mn|tn|[kKmMbBT])\b"
_TLD = r"(?:com|org|net|edu|gov|io|ai|app|dev|info|uk|us|de|fr|eu|tv|me|ca|ch|au|nz|jp|cn|ru|es|nl|se|pl)"
_LABEL = r"[A-Za-z0-9][A-Za-z0-9-]{0,62}"
_TAIL = r"[^\s,;!]{0,500}[^\s,;!.:?]"
_HALF = r"(?:[aApP]\.[mM]\.?|[aApP][mM]\b)"
_START, _STOP = r"(?<![^\W\d_])", r"(?![^\W\d_])"  # no letter before, after
_LETTERS = r"[^\W\d_]+"
_SINGLE_LETTER = re.compile(rf"{_START}[^\W\d_]{_STOP}")
# espeak-ng omits what follows the first 160 letters of a word; the longest in use have 85. From U+0900 on, scripts
# without spaces between words begin.
# An asterisk between numbers or letters: 2*3, 2 * x; 4* hotels and s*x are none.
_MULTIPLIED = re.compile(
    r"(?<=[0-9)])(\s?)\*\1(?=[0-9(]|[a-z]\b)|(?<=\b[a-z])(\s?)\*\2(?=[0-9(])|(?<=\b[a-z])\s\*\s(?=[a-z]\b)"
)
_LONG_WORD = re.compile(r"[^\W\d_\u0900-\U0010ffff]{100}(?=[^\W\d_\u0900-\U0010ffff])")
# espeak-ng reads aujourd’hui in English, and 12 345 with a narrow space as two numbers
_AS_ESPEAK_READS = str.maketrans({"’": "'", "ʼ": "'", "\u00a0": " ", "\u202f": " ", "\u2009": " "})
_LONG_NUMBER = re.compile(rf"[0-9]{{{MAX_CARDINAL_DIGITS + 1},}}")


def _unit_pattern() -> str:
    units = sorted(readings.read_table("units.tsv"), key=len, reverse=True)
    return "(?:" + "|".join(re.escape(unit) + (r"(?![\w^/'])" if unit[-1].isalnum() else "") for unit in units) + ")"


def _letter_unit_pattern() -> str:
    """Units with a letter that occurs in no English word (μm, kΩ)."""
    units = [unit for unit in readings.read_table("units.tsv") if len(unit) > 1 and set(unit) & set("μΩ")]
    return "(?:" + "|".join(sorted(units, key=len, reverse=True)) + ")"


def _abbreviation_pattern() -> str:
    table = readings.read_table("abbreviations.tsv")
    written = sorted(table, key=len, reverse=True)
    titles = "|".join(title.upper() for title in written if table[title][1] in forms.TITLES)
    dotless = rf"(?:Mr|Mrs|Ms|Dr|Prof|etc|vs|approx){_STOP}"
    return rf"(?P<abbr>(?:{'|'.join(map(re.escape, written))})(?=\.)|(?:{titles})(?=\. ?[A-Z])|{dotless})\.?"


# Name, pattern and reader, in the order in which they are tried at each position; every repeat over letters is bounded
# or cannot be retried from within itself, so that the scan is linear.
def _form_table() -> tuple[tuple[str, str, forms.Reader], ...]:
    unit = _unit_pattern()
    return (
        ("quick", r"(?!(?:etc|vs|approx|et)\b)[a-z]+(?= |$|[,;!?—…](?: |$))", forms.read_unchanged),
        ("space", r" +", forms.read_nothing),
        ("mark", r"[.,;:!?—…](?= |$)", forms.read_punctuation),
        ("email", rf"[\w+-](?:[\w.+-]{{0,62}}[\w+-])?@{_LABEL}(?:\.{_LABEL}){{1,5}}(?!\w)", forms.read_address),
        ("url", rf"(?:(?:https?|ftp)://|www\.){_TAIL}", forms.read_address),
        ("host", rf"(?:{_LABEL}\.){{1,4}}{_TLD}\b(?![.]\w)(?:/(?:{_TAIL})?)?", forms.read_address),
        ("tag", r"[#@](?=[0-9_]{0,60}[^\W\d_])\w{1,140}", forms.read_hashtag),
        ("slashed", r"and/or\b|w/o\b|w/(?= )|[nN]/[aA]\b", forms.read_slashed),
        ("iso", r"(?P<isoy>[0-9]{4})-(?P<isom>[0-9]{2})-(?P<isod>[0-9]{2})(?![\w-])", forms.read_iso_date),
        (
            "monthday",
            rf"(?P<mf>{_MONTH}) (?P<mfd>[0-9]{{1,2}})(?:st|nd|rd|th)?(?![\w:/%-]|[.,][0-9])"
            r"(?:,? (?P<mfy>[12][0-9]{3})(?![\w-]|[.,:][0-9]))?",
            forms.read_month_first,
        ),
        ("monthyear", rf"(?P<my>{_MONTH}),? (?P<myy>[12][0-9]{{3}})(?![\w-]|[.,:][0-9])", forms.read_month_year),
        (
            "daymonth",
            rf"(?P<dfd>[0-9]{{1,2}})(?:st|nd|rd|th)?(?: of)?[ -](?P<df>{_MONTH})"
            r"(?:,?[ -](?P<dfy>[12][0-9]{3})(?![\w-]))?",
            forms.read_day_first,
        ),
        (
            "numericdate",
            r"(?P<nd1>[0-9]{1,2})(?P<ndsep>[/.-])(?P<nd2>[0-9]{1,2})(?P=ndsep)(?P<ndy>[12][0-9]{3}|[0-9]{2})"
            r"(?![\w/-]|\.[0-9])",
            forms.read_numeric_date,
        ),
        (
            "scientific",
            r"(?P<mantissa>(?<![\w.])[+-]?[0-9]{1,9}(?:\.[0-9]{1,9})?)[eE](?P<exponent>[+-]?[0-9]{1,3})(?![\w.])"
            rf"(?: ?(?P<sunit>{unit}))?",
            forms.read_scientific,
        ),
        ("version", r"[0-9]{1,4}(?:\.[0-9]{1,4}){2,6}(?!\w)", forms.read_version),
        (
            "clock",
            rf"(?P<hh>[0-9]{{1,2}}):(?P<mm>[0-9]{{2}})(?::(?P<ss>[0-9]{{2}}))?(?![\w:])(?: ?(?P<half>{_HALF}))?"
            rf"|(?P<hh2>[0-9]{{1,2}}) ?(?P<half2>{_HALF})|(?P<hh3>[0-9]{{1,2}}):(?P<mm3>[0-9]{{2}})(?P<half3>{_HALF})",
            forms.read_clock,
        ),
        ("ratio", r"(?P<ra>[0-9]{1,3}):(?P<rb>[0-9]{1,3})(?![\w:])", forms.read_proportion),
        (
            "money",
            rf"(?P<moneyminus>(?<![\w.])-)?(?P<sign>{_SIGN}) ?(?P<moneya>-?{_AMOUNT})"
            rf"(?:[–-](?:{_SIGN})?(?P<moneyto>{_AMOUNT})(?![\w-]))?(?: ?(?P<mag>{_MAGNITUDE}))?",
            forms.read_money,
        ),
        (
            "moneyafter",
            rf"(?P<moneyb>{_SIGNED})(?: ?(?P<mag2>thousand|million|billion|trillion|bn))?"
            rf" ?(?:(?P<sign2>[$£€¥₹₩₽₺₿¢])|(?P<sign3>{_CODE})\b)",
            forms.read_money_after,
        ),
        (
            "telephone",
            r"(?:\+[0-9]{1,3}[ .-]?)?(?:\([0-9]{2,4}\) ?|[0-9]{3,4}[ .-])[0-9]{3}[ .-][0-9]{4}(?![\w-])"
            r"|\+[0-9]{1,3}(?:[ .-][0-9]{2,4}){2,5}(?![\w-])|(?<![\w-])[0-9]{3}-[0-9]{4}(?![\w-])|\+[0-9]{8,15}(?!\w)",
            forms.read_telephone,
        ),
        (
            "feetinches",
            r"(?P<ft>[0-9]{1,3}) ?(?:ft\b\.?|feet|foot) (?P<ftin>[0-9]{1,2}(?:\.[0-9]{1,2})?) ?in\b"
            r"(?:\.(?=[,;]| [a-z]))?",
            forms.read_feet_inches,
        ),
        (
            "inches",
            rf"(?P<inchamount>{_AMOUNT})[ -]in"
            r"(?:\.(?=[,;]| [a-z])|(?= ?(?:long|wide|tall|high|deep|thick|across|by(?= [0-9])|x)\b))",
            forms.read_inches,
        ),
        (
            "grid",
            rf"(?P<across>[0-9]{{1,5}}) ?[xX] ?(?P<down>[0-9]{{1,5}})(?![\w.])(?: ?(?P<gunit>{unit}))?",
            forms.read_dimensions,
        ),
        ("feet", r"(?P<feet>[1-9])'(?P<inches>[0-9]{1,2})?(?![\w'])", forms.read_feet),
        ("decade", r"'?(?P<decade>[1-9]0|[12][0-9]{2}0)'?s\b", forms.read_decade),
        ("ordinal", r"(?P<ord>[0-9]{1,3}(?:,[0-9]{3}){1,5}|[0-9]{1,15})(?:st|nd|rd|th)\b", forms.read_ordinal),
        (
            "fraction",
            r"(?:(?P<whole>[0-9]{1,6})[ -])?(?P<frac>(?P<top>[0-9]{1,3})/(?P<bottom>[0-9]{1,3}))(?![\w/])",
            forms.read_fraction,
        ),
        (
            "range",
            rf"(?P<from>{_AMOUNT})[–-](?P<sign4>[$£€])?(?P<to>{_AMOUNT})(?![\w-])(?: ?(?P<runit>{unit}))?",
            forms.read_range,
        ),
        ("measure", rf"(?P<amount>{_SIGNED})[ -]?(?P<unit>{unit})(?:\.(?= [a-z]))?", forms.read_measure),
        ("power", r"\^(?P<power>-?[0-9]{1,3})(?![0-9])", forms.read_power),
        ("kilo", rf"(?P<kilo>{_AMOUNT})k\b", forms.read_thousands),
        ("number", _SIGNED, forms.read_plain_number),
        ("sharp", rf"{_START}(?P<note>[A-G])#(?![\w#])", forms.read_sharp),
        ("sheet", rf"{_START}A(?P<sheet>[0-9]{{1,4}})(?![\w.-])", forms.read_letter_a),
        ("abbreviation", rf"{_START}{_abbreviation_pattern()}{_STOP}", forms.read_abbreviation),
        (
            "dotted",
            rf"{_START}(?:[^\W\d_]\.){{2,12}}{_STOP}|{_START}[^\W\d_](?:\.[^\W\d_]){{1,12}}(?![\w.])",
            forms.read_dotted_letters,
        ),
        ("initial", rf"{_START}[A-Z]\.(?= [A-Z](?:[a-z]|\.))", forms.read_initial),
        ("roman", rf"{_START}[IVXLCDM]{{1,15}}{_STOP}(?!['-][^\W\d_])", forms.read_roman_numeral),
        ("unitname", rf"{_START}{_letter_unit_pattern()}{_STOP}", forms.read_unit_name),
        ("letter", rf"{_START}(?![\u0000-\u024f])[^\W\d_]{_STOP}", forms.read_letter),
        ("word", rf"{_LETTERS}(?:['-]{_LETTERS})*", forms.read_unchanged),
        ("sentence", r"(?<=[a-z])\.(?=[A-Z])|[,;:!?—…]", forms.read_unchanged),
        ("dot", r"\.", forms.read_dot),
        ("symbol", r"[\s\S]", forms.read_symbol),
    )


@functools.cache
def _scanner() -> tuple[re.Pattern[str], dict[str, forms.Reader]]:
    rows = _form_table()
    return re.compile("|".join(f"(?P<f_{name}>{pattern})" for name, pattern, _ in rows)), {
        f"f_{name}": reader for name, _, reader in rows
    }


def split_tokens(text: str) -> Iterator[WrittenForm]:
    """Written forms of an English text in order, with their words; the text between them is white space."""
    pattern, readers = _scanner()
    previous = ""
    for match in pattern.finditer(name_letters_in_words(sentence_case(canonical_text(text)))):
        spoken = _name_letters(readers[match.lastgroup or ""](match, previous))
        if spoken:
            yield WrittenForm(match.group(), spoken)
            previous = spoken[-1] if spoken[-1] in MARKS else spoken.rpartition(" ")[2]


def _name_letters(spoken: str) -> str:
    """Words of a form, with the names of foreign letters that became single ones (#Ͱ, A.Ͱ)."""
    if spoken.isascii():
        return spoken
    return _SINGLE_LETTER.sub(lambda letter: forms.read_letter(letter, ""), name_letters_in_words(spoken))


def join_words(words: list[str]) -> str:
    """Join words with single spaces and marks after their word; of adjacent marks the strongest is kept."""
    pieces: list[str] = []
    for piece in words:
        if piece not in MARKS:
            pieces += [" ", piece] if pieces else [piece]
        elif pieces and pieces[-1][-1] in MARKS:
            pieces[-1] = pieces[-1][:-1] + max(pieces[-1][-1], piece, key=",;:.!?".find)
        elif pieces:
            pieces.append(piece)
    return "".join(pieces).rstrip(" ,;:")


def normalize(text: str, language: str = "en-us") -> str:
    """Normalise an English text to words, and a text of another language to canonical characters.

    Numbers in other languages are read by espeak-ng.
    """
    if not language.startswith("en"):
        return canonical_text(text, keep_marks=True)
    return join_words([token.spoken for token in split_tokens(_MULTIPLIED.sub(" × ", text))])


def spoken_forms(text: str, language: str) -> list[WrittenForm]:
    """Parts of a text that is not English, with their spoken forms, which a voice of the language reads.

    Numbers, dates, abbreviations and signs of a language with a table (`lexicon.locales`) become words. Single letters
    of other writing systems are replaced by their names; a word of more than 100 letters is divided, as are the digits
    of a longer number than English names.
    """
    return [replace(form, spoken=_readable(form.spoken, language)) for form in read_forms(text, language)]


def _readable(spoken: str, language: str) -> str:
    text = name_foreign_letters(spoken.translate(_AS_ESPEAK_READS), language)
    text = _LONG_NUMBER.sub(lambda number: " ".join(number.group()), text)
    return _LONG_WORD.sub(r"\g<0> ", text)


def written_pieces(text: str, language: str) -> list[tuple[str, str]]:
    """Words of a text that is not English as they are written (3,50 €), and the punctuation after each."""
    forms = spoken_forms(text, language)
    pieces = "".join(form.spoken for form in forms).split()
    found: list[tuple[str, str]] = []
    for written, at in written_groups(pieces, forms):
        last = pieces[at.stop - 1]
        found.append((written, "" if written == last else last_mark(last)))
    return found


def spoken_form(text: str, language: str) -> str:
    """Spoken form of a text: English is normalised; of other languages see `spoken_forms`.

    Arabic and Hebrew get vowels where a model of them is installed.
    """
    if language.startswith("en"):
        return _LONG_WORD.sub(r"\g<0> ", normalize(text))
    text = "".join(form.spoken for form in spoken_forms(text, language))
    return signs_before_vowels(add_vowels(text, language))
