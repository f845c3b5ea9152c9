"""Written forms of English: the pattern of each, and the reader that says its words."""

import re

from lexicon import code_forms as codes
from lexicon import date_readers as dates
from lexicon import form_readers as forms
from lexicon import formulas, informal_words
from lexicon import number_contexts as contexts
from lexicon import written_forms as readings
from lexicon.kept_signs import INCH, RANGE, STAR

_START, _STOP = r"(?<![^\W\d_])", r"(?![^\W\d_])"  # no letter before, after
_FULL_MONTH = "|".join(readings.MONTHS)
_MONTH = rf"(?:{_FULL_MONTH}|(?:Jan|Feb|Mar|Apr|Jun|Jul|Aug|Sept?|Oct|Nov|Dec)\b\.?)"
_THOUSANDS = r"(?:(?:,[0-9]{3}){1,6}(?:\.[0-9]{1,20})?(?!,?[0-9])|(?:'[0-9]{3}){1,6}(?:\.[0-9]{1,20})?(?!'?[0-9]))"
_AMOUNT = rf"(?:[0-9]{{1,3}}{_THOUSANDS}|[0-9]{{1,400}}(?:\.[0-9]{{1,20}})?|\.[0-9]{{1,20}})"
_SIGNED = rf"(?:(?<![\w.)])[+-])?{_AMOUNT}"
_SIGN = rf"(?:{_START}(?:{'|'.join(readings.DOLLARS)})\$|[$£€¥₹₩₽₺₿])"
_CODE = "|".join(code for code in readings.CURRENCIES if code.isalpha())
_MAGNITUDE = r"(?:thousand|million|billion|trillion|bn|mn|tn|[kKmMbBT])\b"
_TLD = r"(?:com|org|net|edu|gov|io|ai|app|dev|info|uk|us|de|fr|eu|tv|me|ca|ch|au|nz|jp|cn|ru|es|nl|se|pl)"
_LABEL = r"[A-Za-z0-9][A-Za-z0-9-]{0,62}"
_TAIL = r"[^\s,;!]{0,500}[^\s,;!.:?]"
_HALF = r"(?:[aApP]\.[mM]\.?|[aApP][mM]\b)"
_LETTERS = r"[^\W\d_]+"
_SHORT_DAY = "(?:Mon|Tues?|Wed|Thu(?:rs?)?|Fri|Sat|Sun)"
_SHORT_NAME = rf"(?:{_SHORT_DAY}|Jan|Feb|Mar|Apr|Jun|Jul|Aug|Sept?|Oct|Nov|Dec)"
_STATE = "|".join(readings.read_table("states.tsv"))
_STATE_NAME = "|".join(
    name for (name,) in readings.read_table("states.tsv").values() if name.replace(" ", "").isalpha()
)
_PART = r"[\w+-]{1,64}(?:\.[\w+-]{1,32}){0,4}"  # of a path
_CLUSTER = "th|sh|ch|wh|st|pl|pr|br|cr|dr|fr|gr|tr|bl|cl|fl|gl|sl|sp|sk|sc|sm|sn|sw|tw|kn|wr|qu|[a-z]"  # of a stutter
_ELEMENT = f"(?:{'|'.join(sorted(formulas.ELEMENTS, key=len, reverse=True))})"
_TWO_LETTERS = f"(?:{'|'.join(symbol for symbol in sorted(formulas.ELEMENTS) if len(symbol) > 1)})"
_METAL = "(?:Cl|Br|Fe|Ca|Mg|Na|Cu|Zn|Al|Pb|Ag|Hg|Li)"
_MORE = "(?:more|less|better|worse|faster|slower|larger|bigger|smaller|higher|longer|stronger|cheaper)"
_PER = "(?:mo|month|wk|week|yr|year|day|night|person|head|hour|minute|second|acre|gallon|page|item|user|share|ton)"


def _unit_pattern() -> str:
    """Units, and two of them with a slash (mg/dL)."""
    units = sorted(readings.read_table("units.tsv"), key=len, reverse=True)
    words = "|".join(re.escape(unit) for unit in units if unit[-1].isalnum())
    signs = "|".join(re.escape(unit) for unit in units if not unit[-1].isalnum())
    return rf"(?:(?:{words})(?:/(?:{words}))?(?![\w^/'])|{signs})"


def _scripture_pattern() -> str:
    """A book of scripture with chapter and verses (Psalm 23:1), of a book with a number also a chapter (1 John 3)."""
    books = "|".join(sorted(readings.read_table("scripture.tsv"), key=len, reverse=True))
    verses = r"[0-9]{1,3}:[0-9]{1,3}(?:[-–][0-9]{1,3}(?::[0-9]{1,3})?)?(?!\w|[:.][0-9])"
    more = r"(?:(?:; ?| and )[0-9]{1,3}:[0-9]{1,3}(?:[-–][0-9]{1,3})?(?![\w:]| ?[ap]\.?m\b))"
    return (
        rf"{_START}(?:(?P<part>[1-4]|I{{1,3}}) )?(?:(?P<book>{books})\.?|[Vv]erses?) "
        rf"(?P<places>{verses}{more}{{0,6}}|(?(part)[0-9]{{1,3}}|(?!))(?![\w:]|[.,][0-9]))(?! ?[ap]\.?m\b)"
    )


def _rate_pattern() -> str:
    """Two units with a slash, without a number: in mg/dL, km/h."""
    words = "|".join(unit for unit in sorted(readings.read_table("units.tsv"), key=len, reverse=True) if unit.isalpha())
    return rf"(?:{words})/(?:{words})(?![\w^/'-])"


def _letter_unit_pattern() -> str:
    """Units with a letter that occurs in no English word (μm, kΩ)."""
    units = [unit for unit in readings.read_table("units.tsv") if len(unit) > 1 and set(unit) & set("μΩ")]
    return "(?:" + "|".join(sorted(units, key=len, reverse=True)) + ")"


def _abbreviation_pattern() -> str:
    table = readings.read_table("abbreviations.tsv")
    written = sorted(table, key=len, reverse=True)
    titles = "|".join(title.upper() for title in written if table[title][1] in forms.TITLES)
    dotless = (
        r"(?:(?:Mr|Mrs|Ms|Dr|Prof|etc|vs|approx)|(?:St|Mt|Ft)(?= [A-Z])|(?:Rm|Apt|Vol|Figs?|Jct)(?= [0-9])"
        rf"|(?<=[a-z] )(?:Ave|Blvd|Rd|Hwy|Pkwy|St(?![^\W_]| [A-Z0-9]))){_STOP}"
    )
    return rf"(?P<abbr>(?:{'|'.join(map(re.escape, written))})(?=\.)|(?:{titles})(?=\. ?[A-Z])|{dotless})\.?"


# In the order in which they are tried at each position, by its sign (a: a letter, 0: a digit, .: another). Forms with #
# are only in texts with a digit, those with / in texts with a sign of addresses, so that plain sentences do not compile
# them. Every repeat over letters is bounded or cannot be retried from within itself, so that the scan is linear.
def form_table() -> tuple[tuple[str, str, str, forms.Reader], ...]:
    """Name of each written form, signs with which it begins, pattern, and reader."""
    unit = _unit_pattern()
    return (
        ("by", "a#", rf"x(?= ?[0-9]{{1,4}}(?:\.[0-9]{{1,2}})? ?['{INCH}])", formulas.read_by),
        (
            "quick",
            "a",
            r"(?!(?:etc|vs|approx|et|verses?(?= [0-9]))\b)[a-z]+(?= |$|[,;!?—…](?: |$))"
            rf"|(?<!{RANGE} )(?!(?:Mrs?|Ms|Dr|Prof|Et)\b)[A-Z][a-z]+(?= [a-z])",
            codes.read_word,
        ),
        ("space", ".", r" +", forms.read_nothing),
        ("mark", ".", r"[.,;:!?—…](?= |$)", forms.read_punctuation),
        ("relation", ".", r"!=|<=|>=|==+|=>|&&", formulas.read_relation),
        ("scripture", "a0#", _scripture_pattern(), contexts.read_scripture),
        (
            "email",
            "a0./",
            rf"[\w+⎵-](?:[\w.+⎵-]{{0,62}}[\w+-])?@{_LABEL}(?:\.{_LABEL}){{1,5}}(?!\w)",
            codes.read_address,
        ),
        ("url", "a", rf"(?:(?:https?|ftp)://|www\.){_TAIL}", codes.read_address),
        ("host", "a0", rf"(?:{_LABEL}\.){{1,4}}{_TLD}\b(?![.]\w)(?:/(?:{_TAIL})?)?", codes.read_address),
        ("color", ".", codes.COLOR, codes.read_color),
        ("file", "a0", rf"{_LABEL}\.{codes.FILE_ENDING}(?!\w|\.\w)", codes.read_path),
        ("tag", ".", r"[#@](?=[0-9_]{0,60}[^\W\d_])\w{1,140}", codes.read_hashtag),
        ("slashed", "a/", r"and/or\b|w/o\b|w/(?= )|[nN]/[aA]\b|b/c\b|c/o\b", forms.read_slashed),
        ("rate", "a/", rf"{_START}{_rate_pattern()}", forms.read_rate),
        ("parting", "./", r"(?<=[A-Z][0-9])/(?=[A-Z][0-9])", forms.read_nothing),
        ("season", "0", r"(?P<year>(?:19|20)[0-9]{2})/(?P<next>[0-9]{2})(?![\w/])", dates.read_season),
        (
            "either",
            "a/",
            r"(?<![/\w])(?!d[A-Za-z]/d)(?P<either>[^\W\d_]{2,30}|[A-Z])/(?P<other>[^\W\d_]{2,30}|[A-Z])(?P<third>/[^\W\d_]{2,30}|'s)?(?![\w/.-]\w|\w)",
            forms.read_either,
        ),
        (
            "path",
            "a./",
            rf"(?<![\w/.])(?:[∿.]|\.\.)/{_PART}(?:/{_PART}){{0,12}}|(?<![\w/.])(?:/{_PART}){{2,12}}"
            rf"|(?<![\w/])[A-Z]:∖{_PART}(?:∖{_PART}){{0,12}}"
            r"|(?<![\w/])[A-Za-z][\w-]{0,40}(?:/[\w-]{1,40}){1,8}\.[a-z]{1,4}(?![\w.]\w)",
            codes.read_path,
        ),
        (
            "hash",
            "a0#",
            r"(?<!\w)(?=[0-9a-f]{6,64}(?!\w))(?:(?:[0-9]+[a-f]+){2,}[0-9]*|(?:[a-f]+[0-9]+){2,}[a-f]*)"
            r"|(?<!\w)0x[0-9A-Fa-f]{1,16}(?!\w)",
            codes.read_hash,
        ),
        (
            "keys",
            "a./",
            rf"(?<!\w){codes.KEYS}(?: ?\+ ?(?:[A-Za-z]{{1,9}}[0-9]{{0,2}}|[0-9])){{1,3}}(?!\w)",
            codes.read_keys,
        ),
        (
            "zip",
            "a#",
            rf"(?<=[a-z.,] )(?P<state>{_STATE}|(?<=, )(?:{_STATE_NAME}|D\.C\.)) "
            r"(?P<zip>[0-9]{5}(?:-[0-9]{4})?)(?![\w-])",
            contexts.read_zip_code,
        ),
        (
            "digits",
            "0",
            r"(?=(?:[0-9]-?){9}(?:[0-9]-?){0,3}[0-9X](?![\w-]))[0-9]{1,5}(?:-[0-9]{1,7}){2,4}(?:-X)?(?![\w-])|[0-9]{5}-[0-9]{4}(?![\w-])"
            r"|[0-9]{4}(?: [0-9]{4}){3}(?![0-9])|(?<=ISSN )[0-9]{4}-[0-9]{3}[0-9X](?!\w)|(?<=ISBN )[0-9]{9,13}X?(?!\w)",
            contexts.read_digits,
        ),
        (
            "shortdate",
            "a0#",
            rf"(?P<weekday>{_SHORT_DAY}\b\.?|{'|'.join(readings.DAYS)}),? "
            r"(?P<sd1>[0-9]{1,2})/(?P<sd2>[0-9]{1,2})(?![\w/])"
            r"|(?:(?<=[Oo]n )|(?<=[Bb]y )|(?<=due )|(?<=until )|(?<=since ))"
            rf"(?P<sd3>1?[0-9])/(?P<sd4>1[3-9]|2[0-9]|3[01])(?![\w/-]| of\b| ?in(?:ch|\b)| ?{INCH})",
            dates.read_short_date,
        ),
        ("iso", "0", r"(?P<isoy>[0-9]{4})-(?P<isom>[0-9]{2})-(?P<isod>[0-9]{2})(?![\w-])", dates.read_iso_date),
        (
            "monthday",
            "a#",
            rf"(?P<mf>{_MONTH}) (?P<mfd>[0-9]{{1,2}})(?:st|nd|rd|th)?(?:[–-](?P<mfto>[0-9]{{1,2}})(?![0-9]))?"
            r"(?![\w:/%-]|[.,][0-9])(?:,? (?P<mfy>[12][0-9]{3})(?![\w-]|[.,:][0-9]))?",
            dates.read_month_first,
        ),
        ("monthyear", "a#", rf"(?P<my>{_MONTH}),? (?P<myy>[12][0-9]{{3}})(?![\w-]|[.,:][0-9])", dates.read_month_year),
        (
            "daymonth",
            "0",
            rf"(?P<dfd>[0-9]{{1,2}})(?:st|nd|rd|th)?(?: of)?[ -](?P<df>{_MONTH})"
            r"(?:,?[ -](?P<dfy>[12][0-9]{3})(?![\w-]))?",
            dates.read_day_first,
        ),
        (
            "numericdate",
            "0",
            r"(?P<nd1>[0-9]{1,2})(?P<ndsep>[/.-])(?P<nd2>[0-9]{1,2})(?P=ndsep)(?P<ndy>[12][0-9]{3}|[0-9]{2})"
            r"(?![\w/-]|\.[0-9])",
            dates.read_numeric_date,
        ),
        (
            "scientific",
            "0.#",
            r"(?P<mantissa>(?<![\w.])[+-]?[0-9]{1,9}(?:\.[0-9]{1,9})?)[eE](?P<exponent>[+-]?[0-9]{1,3})(?![\w.])"
            rf"(?: ?(?P<sunit>{unit}))?",
            forms.read_scientific,
        ),
        (
            "address",
            "0",
            r"(?P<host>[0-9]{1,3}(?:\.[0-9]{1,3}){3})(?::(?P<port>[0-9]{2,5}))?(?![\w:]|\.[0-9])",
            contexts.read_network_address,
        ),
        ("version", "0", r"[0-9]{1,4}(?:\.[0-9]{1,4}){2,6}(?!\w)", forms.read_version),
        (
            "angle",
            "0",
            r"(?P<degrees>[0-9]{1,3})° ?(?P<arcminutes>[0-9]{1,2})'"
            rf"(?: ?(?P<arcseconds>[0-9]{{1,2}}(?:\.[0-9]{{1,3}})?){INCH})?"
            r"(?: ?(?P<pole>[NSEW])(?!\w))?",
            formulas.read_angle,
        ),
        (
            "lasting",
            "0",
            r"(?:(?P<lasth>[0-9]{1,3}) ?h(?:rs?)? ?)?(?P<lastm>[0-5]?[0-9]) ?m(?:ins?)?"
            r"(?: ?(?P<lasts>[0-5]?[0-9]) ?s(?:ecs?)?)?"
            r"(?![\w/^-])(?(lasth)|(?(lasts)|(?!)))",
            dates.read_lasting,
        ),
        ("points", "0", r"(?P<points>[0-9]{1,3}(?:\.[0-9]{1,2} ?pp| ?bps))(?!\w)", forms.read_points),
        (
            "lap",
            "0",
            r"(?P<lapm>[0-9]{1,3}):(?P<laps>[0-5][0-9])\.(?P<lapf>[0-9]{1,3})(?![\w:])",
            dates.read_lap,
        ),
        (
            "clock",
            "0",
            rf"(?P<hh>[0-9]{{1,2}}):(?P<mm>[0-9]{{2}})(?::(?P<ss>[0-9]{{2}}))?(?![\w:])(?: ?(?P<half>{_HALF}))?"
            rf"|(?P<hh2>[0-9]{{1,2}}) ?(?P<half2>{_HALF})|"
            rf"(?P<hh3>[0-9]{{1,2}})(?::|\.(?=[0-9]{{2}} ?[ap]))(?P<mm3>[0-9]{{2}}) ?(?P<half3>{_HALF})",
            dates.read_clock,
        ),
        ("ratio", "0", r"(?P<ra>[0-9]{1,3}):(?P<rb>[0-9]{1,3})(?![\w:])", dates.read_proportion),
        (
            "money",
            "a.#",
            rf"(?P<moneyminus>(?<![\w.])-)?(?P<sign>{_SIGN}) ?(?P<moneya>-?{_AMOUNT})"
            rf"(?:[–-](?:{_SIGN})?(?P<moneyto>{_AMOUNT})(?![\w-]))?(?: ?(?P<mag>{_MAGNITUDE}))?",
            forms.read_money,
        ),
        (
            "moneyafter",
            "0.#",
            rf"(?P<moneyb>{_SIGNED})(?: ?(?P<mag2>thousand|million|billion|trillion|bn))?"
            rf" ?(?:(?P<sign2>[$£€¥₹₩₽₺₿¢])|(?P<sign3>{_CODE})\b)",
            forms.read_money_after,
        ),
        (
            "telephone",
            "0.#",
            r"(?:(?:\+[0-9]{1,3}|1)[ .-]?)?(?:\([0-9]{2,4}\) ?|[0-9]{3,4}[ .-])[0-9]{3}[ .-][0-9]{4}(?![\w-])"
            r"|\+[0-9]{1,3}(?:[ .-][0-9]{1,8}){2,6}(?![\w-])|(?<![\w-])[0-9]{3}-[0-9]{4}(?![\w-])|\+[0-9]{8,15}(?!\w)"
            r"|(?<![\w.,:/-])0[0-9]{2,4}(?:[ -][0-9]{3,8}){1,3}(?![\w-])",
            forms.read_telephone,
        ),
        (
            "feetinches",
            "0",
            r"(?P<ft>[0-9]{1,3}) ?(?:ft\b\.?|feet|foot) (?P<ftin>[0-9]{1,2}(?:\.[0-9]{1,2})?) ?in\b"
            r"(?:\.(?=[,;]| [a-z]))?",
            forms.read_feet_inches,
        ),
        (
            "inches",
            "0.#",
            rf"(?P<inchamount>{_AMOUNT})[ -]in"
            r"(?:\.(?=[,;]| [a-z])|(?= ?(?:long|wide|tall|high|deep|thick|across|by(?= [0-9])|x)\b))",
            forms.read_inches,
        ),
        (
            "inchmark",
            "0.#",
            rf"(?:(?:(?P<iwhole>[0-9]{{1,4}})[ -])?(?P<itop>[0-9]{{1,2}})/(?P<ibottom>[0-9]{{1,3}})"
            rf"|(?P<inches2>{_AMOUNT})) ?{INCH}",
            formulas.read_inch_mark,
        ),
        ("stars", "0.", rf"(?P<starnumber>[0-9])?{STAR}+", formulas.read_stars),
        (
            "times",
            "0",
            rf"(?P<times>[0-9]{{1,3}}) ?[xX×](?=/{_PER}\b| (?:a|an|per|each|every|daily|weekly|monthly|as|{_MORE})\b)",
            forms.read_times,
        ),
        (
            "packs",
            "0",
            rf"(?P<packs>[0-9]{{1,3}}) ?[x×] ?(?P<content>{_AMOUNT}) ?(?P<punit>{unit})(?= [a-z])",
            forms.read_packs,
        ),
        (
            "grid",
            "0",
            rf"(?P<across>[0-9]{{1,5}}) ?[xX] ?(?P<down>[0-9]{{1,5}})(?![\w.])(?: ?(?P<gunit>{unit}))?",
            forms.read_dimensions,
        ),
        (
            "feet",
            "0",
            rf"(?P<feet>[0-9]{{1,3}})'(?: ?(?P<inches>[0-9]{{1,2}}){INCH}?)?(?![\w'])",
            formulas.read_feet,
        ),
        ("decade", "0.#", r"'?(?P<decade>[1-9]0|[12][0-9]{2}0)'?s\b", dates.read_decade),
        ("ordinal", "0", r"(?P<ord>[0-9]{1,3}(?:,[0-9]{3}){1,5}|[0-9]{1,15})(?:st|nd|rd|th)\b", forms.read_ordinal),
        ("owner", "0", r"(?P<owner>[0-9]{1,6})'s\b", forms.read_owner),
        (
            "outof",
            "0",
            r"(?P<outtop>[0-9]{1,3}\.[0-9]{1,2})/(?P<outbottom>[0-9]{1,3})(?![\w/])",
            forms.read_out_of,
        ),
        (
            "fraction",
            "0.#",
            r"(?P<fractionminus>(?<![\w.)])-(?=[0-9]))?"
            r"(?:(?P<whole>[0-9]{1,6})[ -])?(?P<frac>(?P<top>[0-9]{1,3})/(?P<bottom>[0-9]{1,3}))(?![\w/])"
            rf"(?: ?(?P<funit>{unit}|in(?= (?:thick|wide|long|deep|high)\b)))?(?:\.(?= [a-z]))?",
            forms.read_fraction,
        ),
        (
            "per",
            "./",
            rf"(?:(?<=[0-9$£€¢])|(?<=[0-9][xX×])|(?<=llion))/(?:(?P<per>{unit})|(?P<perword>{_PER})\b)",
            forms.read_per,
        ),
        (
            "over",
            "./",
            r"(?:(?<=[\s(+×=-][b-hj-z])|(?<=\bd[A-Za-z])(?=/d[a-z]\b)|(?<=^[b-hj-z])|(?<=π))/(?=[0-9]|d?[b-hj-z]\b|delta\b|π)"
            r"|(?<=[0-9])/(?=[kmnxyz]\b|π)",
            formulas.read_over,
        ),
        (
            "designation",
            "a0#",
            rf"{_START}(?P<letters>[A-Z]{{1,2}})[0-9]{{3}}(?:-[0-9]{{2,4}})?(?![\w-])|7[0-9]7-[0-9]{{2,3}}(?![\w-])",
            contexts.read_designation,
        ),
        ("postcode", "a#", rf"{_START}[A-Z]{{1,2}}[0-9][0-9A-Z]? [0-9][A-Z]{{2}}(?!\w)", codes.read_hash),
        (
            "range",
            "0.#",
            rf"(?P<from>{_AMOUNT})[–-](?P<sign4>[$£€])?(?P<to>{_AMOUNT})(?![\w-])(?: ?(?P<runit>{unit}))?",
            forms.read_range,
        ),
        ("measure", "0.#", rf"(?P<amount>{_SIGNED})[ -]?(?P<unit>{unit})(?:\.(?= [a-z]))?", forms.read_measure),
        ("power", ".#", r"\^(?P<power>-?[0-9]{1,3})(?![0-9])", forms.read_power),
        ("kilo", "0.#", rf"(?P<kilo>{_AMOUNT})k\b", forms.read_thousands),
        ("number", "0.#", _SIGNED, forms.read_plain_number),
        ("sharp", "a", rf"{_START}(?P<note>[A-G])#(?![\w#])", forms.read_sharp),
        ("sheet", "a#", rf"{_START}A(?P<sheet>[0-9]{{1,4}})(?![\w.-])", forms.read_letter_a),
        ("abbreviation", "a", rf"{_START}{_abbreviation_pattern()}{_STOP}", forms.read_abbreviation),
        (
            "dotted",
            "a",
            rf"{_START}(?:[^\W\d_]\.){{2,12}}{_STOP}|{_START}[^\W\d_](?:\.[^\W\d_]){{1,12}}(?![\w.])",
            forms.read_dotted_letters,
        ),
        (
            "shortname",
            "a",
            rf"(?:(?P<dayone>{_SHORT_NAME})\b\.?(?= {RANGE})|(?<={RANGE} )(?P<daytwo>{_SHORT_NAME})\b\.?"
            rf"|(?P<daythree>{_SHORT_DAY})(?=,? (?:{_FULL_MONTH}\b"
            r"|[0-9]{1,2}(?:st|nd|rd|th|:[0-9]{2}| ?[apAP]\.?[mM])\b)))",
            dates.read_short_name,
        ),
        ("initial", "a", rf"{_START}[A-Z]\.(?= [A-Z](?:[a-z]|\.))", forms.read_initial),
        ("roman", "a", rf"{_START}[IVXLCDM]{{1,15}}{_STOP}(?!['-][^\W\d_])", forms.read_roman_numeral),
        (
            "chemical",
            "a",
            rf"{_START}(?=[A-Za-z]{{0,24}}[a-z0-9+∸])(?:(?:{_ELEMENT}[0-9]{{0,3}}){{2,12}}|{_METAL}[0-9]{{1,2}}|(?:{_TWO_LETTERS}|[HKFI])(?=[0-9]?[+∸]))(?:[0-9]?[+∸])?"
            r"(?![\w+]|['-]\w)(?<=[0-9a-z+∸FIOSHN])",
            formulas.read_chemical,
        ),
        ("who", "a", rf"{_START}WHO{_STOP}(?!['-]\w)", forms.read_who),
        ("unitname", "a", rf"{_START}{_letter_unit_pattern()}{_STOP}", forms.read_unit_name),
        ("letter", "a", rf"{_START}(?![\u0000-\u024f])[^\W\d_]{_STOP}", forms.read_letter),
        (
            "stutter",
            "a",
            rf"{_START}(?i:(?P<stutter>{_CLUSTER})-(?:(?P=stutter)-){{0,5}}(?P<stuttered>(?P=stutter)[a-z']{{0,30}})){_STOP}",
            informal_words.read_stutter,
        ),
        (
            "identifier",
            "a",
            rf"{_START}(?=[A-Z]?[a-z]{{1,30}}[A-Z])[A-Za-z]{{4,60}}(?!\w|['-]\w)",
            codes.read_identifier,
        ),
        ("word", "a", rf"{_LETTERS}(?:['-]{_LETTERS})*", codes.read_word),
        ("bar", ".", "∣", formulas.read_bar),
        ("standin", ".", f"[{''.join(formulas.STAND_INS)}]", formulas.read_stand_in),
        ("sentence", ".", r"(?<=[a-z])\.(?=[A-Z])|[,;:!?—…]", forms.read_unchanged),
        ("dot", ".", r"\.", forms.read_dot),
        ("bound", ".", r"(?:(?<=[∣)0-9] )|(?<=\s[a-z] )|(?<=[∣)0-9]))[≤≥]", formulas.read_bound),
        ("symbol", "a0.", r"[\s\S]", forms.read_symbol),
    )
