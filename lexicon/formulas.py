"""Readers of formulas: factorials, bars, fractions of letters, chemistry; and marks of inches and feet, stars."""

import re

from lexicon import written_forms as readings
from lexicon.dictionary import word_set
from lexicon.english import CAPITALISED_WORDS
from lexicon.kept_signs import ARROW, BACKSLASH, FACTORIAL, HOME, MINUS, OVER, RANGE
from lexicon.number_words import number_words, ordinal_words

CONTEXT = 48  # characters before a mark that decide what it is
ELEMENTS = word_set(
    "H He Li Be B C N O F Ne Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga Ge As Se Br Kr Rb Sr Y Zr Nb "
    "Mo Tc Ru Rh Pd Ag Cd In Sn Sb Te I Xe Cs Ba La Ce Pr Nd Sm Eu Gd Tb Dy Ho Er Yb Lu Hf Ta W Re Os Ir Pt Au Hg Tl "
    "Pb Bi Po At Rn Fr Ra Ac Th Pa U Np Pu Am Cm"
)
# Second parts of formulas without digits: KCl, NaOH, ZnS; others (CoSy, LaTi) are rarely formulas.
_ANIONS = word_set("Cl Br F I O S OH CN H N As Se Te P Cl-")
_PART = re.compile(r"([A-Z][a-z]?)([0-9]{0,3})")
STAND_INS = {
    FACTORIAL: "factorial",
    MINUS: "minus",
    RANGE: "to",
    BACKSLASH: "backslash",
    HOME: "tilde",
    OVER: "over",
    ARROW: "to",
}
_POLES = {"N": "north", "S": "south", "E": "east", "W": "west"}
_RELATIONS = {
    "!=": "is not equal to", "<=": "less than or equal to", ">=": "greater than or equal to", "=>": "to",
    "&&": "and",
}  # fmt: skip
_PLAYED_BEFORE = re.compile(
    r"\b(?:goals?|scor\w+|draw|drew|equali[sz]\w+|penalt\w+|substitut\w+|booked|kick-?off|match|half-?time)\b[^.!?]*\Z"
)
_SYMBOLS_AFTER = re.compile(r" ?(?:long|wide|tall|high|deep|thick|across|by|x|×|of|in|from|and|or|to)\b|[.,;:!?]|\s*\Z")


def is_chemical(written: str) -> bool:
    """Whether a word is a chemical formula: NaCl, H2SO4, Fe3+, Cl-; words (He, Co, No) and codes (A4) are none."""
    formula = written.rstrip("+" + MINUS)
    has_charge = formula != written
    parts = _PART.findall(formula)
    if "".join(symbol + number for symbol, number in parts) != formula:
        return False
    symbols = [symbol for symbol, _ in parts]
    if not all(symbol in ELEMENTS for symbol in symbols):
        return False
    if has_charge:
        return len(symbols) > 1 or len(symbols[0]) > 1 or symbols[0] in {"H", "K", "F", "I"}
    if any(number for _, number in parts):
        return any(len(symbol) > 1 for symbol in symbols) or len(symbols) > 1
    return any(len(symbol) > 1 for symbol in symbols) and len(symbols) > 1 and _ends_in_anion(formula, symbols)


def _ends_in_anion(formula: str, symbols: list[str]) -> bool:
    rest = formula.removeprefix(symbols[0])
    return rest in _ANIONS and formula not in {"CoS", "NoH", "HoI", "NaN", "AtI", "InO", "AsI", "BeI"}


def read_chemical(m: re.Match[str], _: str) -> str:
    """H2SO4 is H two S O four, NaCl N A C L, Fe3+ Fe three plus; another word is unchanged."""
    written = m.group()
    if not is_chemical(written):
        return written
    formula = written.rstrip("+" + MINUS)
    pieces: list[str] = []
    for symbol, number in _PART.findall(formula):
        if pieces and not pieces[-1][-1].islower() and not number_follows(pieces):
            pieces[-1] += symbol.upper()
        else:
            pieces.append(symbol.upper())
        if number:
            pieces.append(number_words(number))
    charge = {"+": "plus", MINUS: "minus"}.get(written[-1], "")
    return " ".join([*(_letters(piece) for piece in pieces), charge]).strip()


def number_follows(pieces: list[str]) -> bool:
    """Whether the last piece is a number in words."""
    return pieces[-1].islower()


def _letters(piece: str) -> str:
    """Letters as one initialism (CO2), or one by one where they would be a word (SO4) or are many."""
    if piece.islower() or (len(piece) <= 3 and piece not in CAPITALISED_WORDS):
        return piece
    return " ".join(piece)


def read_inch_mark(m: re.Match[str], _: str) -> str:
    """27" monitor is twenty-seven inch monitor, 6" wide six inches wide."""
    follows = _SYMBOLS_AFTER.match(m.string, m.end())
    words = (
        readings.ratio_words(m["itop"], m["ibottom"], m["iwhole"] or "") if m["itop"] else number_words(m["inches2"])
    )
    return f"{words} {'inches' if follows and words != 'one' else 'inch'}"


def read_feet(m: re.Match[str], previous: str) -> str:
    """5'10 is five foot ten, 12' x twelve feet by, a 10' ladder a ten foot ladder."""
    feet = number_words(m["feet"])
    # of football: a goal in the 67'
    if not m["inches"] and _PLAYED_BEFORE.search(m.string[max(0, m.start() - CONTEXT) : m.start()]):
        is_named = previous.lower() == "the"
        return f"{ordinal_words(int(m['feet']))} minute" if is_named else f"{feet} minute{'s' if feet != 'one' else ''}"
    if m["inches"]:
        return f"{feet} foot {number_words(m['inches'])}"
    return f"{feet} {'feet' if _SYMBOLS_AFTER.match(m.string, m.end()) and feet != 'one' else 'foot'}"


def read_by(_m: re.Match[str], _: str) -> str:
    """The x between two lengths: 12' x 14'."""
    return "by"


def read_angle(m: re.Match[str], _: str) -> str:
    """51°30'26" N is fifty-one degrees thirty minutes twenty-six seconds north."""
    parts = [(m["degrees"], "degree"), (m["arcminutes"], "minute"), (m["arcseconds"], "second")]
    words = [f"{number_words(count)} {name}{'' if count == '1' else 's'}" for count, name in parts if count]
    return " ".join([*words, *([_POLES[m["pole"]]] if m["pole"] else [])])


def read_relation(m: re.Match[str], _: str) -> str:
    """!= is is not equal to, >= greater than or equal to, => to."""
    return _RELATIONS.get(m.group(), "equals")


def read_bar(m: re.Match[str], _: str) -> str:
    """|x| is the absolute value of x."""
    before = m.string[m.start() - 1 : m.start()]
    is_opening = not (before.isalnum() or before in {")", FACTORIAL}) and m.string[m.end() : m.end() + 1].strip() != ""
    return "the absolute value of" if is_opening else ""


def read_stand_in(m: re.Match[str], _: str) -> str:
    """Words of a kept sign."""
    return STAND_INS[m.group()]


def read_bound(m: re.Match[str], _: str) -> str:
    """The ≤ of x ≤ 5 is is at most; that of "with ≤ 5 items" has no is."""
    return f"is {readings.read_table('symbols.tsv')[m.group()][0]}"


def read_over(_m: re.Match[str], _: str) -> str:
    """The slash of a fraction of letters: x/2, Δy/Δx."""
    return "over"


def read_stars(m: re.Match[str], _: str) -> str:
    """★★★ is three stars, 4★ hotel four star hotel."""
    n_stars = len(re.findall("✮", m.group()))
    if m["starnumber"]:
        follows = _SYMBOLS_AFTER.match(m.string, m.end())
        return f"{number_words(m['starnumber'])} star{'s' if follows and m['starnumber'] != '1' else ''}"
    return f"{number_words(str(n_stars))} star{'s' if n_stars != 1 else ''}"
