"""Numbers as English words: cardinals, ordinals, decimals, years, fractions, digits one by one, Roman numerals."""

_ONES = (
    "zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve",
    "thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen",
)  # fmt: skip
_TENS = ("zero", "ten", "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")
_SCALES = ("", "thousand", "million", "billion", "trillion", "quadrillion", "quintillion")
_IRREGULAR = {"one": "first", "two": "second", "three": "third", "five": "fifth", "eight": "eighth", "nine": "ninth"}
_IRREGULAR["twelve"] = "twelfth"
MAX_CARDINAL_DIGITS = 3 * len(_SCALES)  # longer numbers are read digit by digit
_ROMAN = {"I": 1, "V": 5, "X": 10, "L": 50, "C": 100, "D": 500, "M": 1000}


def digit_words(written: str) -> str:
    """Each digit by itself: 007 is zero zero seven."""
    return " ".join(_ONES[int(digit)] for digit in written if digit.isdigit())


def _below_hundred(value: int) -> str:
    if value < 20:
        return _ONES[value]
    tens, ones = divmod(value, 10)
    return _TENS[tens] + (f"-{_ONES[ones]}" if ones else "")


def _below_thousand(value: int) -> str:
    hundreds, rest = divmod(value, 100)
    words = [f"{_ONES[hundreds]} hundred"] if hundreds else []
    return " ".join([*words, _below_hundred(rest)] if rest or not hundreds else words)


def cardinal_words(value: int) -> str:
    """42 is forty-two, 1234 is one thousand two hundred thirty-four; above quintillions digit by digit."""
    if value < 0:
        return f"minus {cardinal_words(-value)}"
    if value >= 10**MAX_CARDINAL_DIGITS:
        return digit_words(str(value))
    groups: list[str] = []
    scale = 0
    while value:
        value, group = divmod(value, 1000)
        if group:
            groups.append(f"{_below_thousand(group)} {_SCALES[scale]}".strip())
        scale += 1
    return " ".join(reversed(groups)) or "zero"


def number_words(written: str) -> str:
    """A number with signs between thousands, decimals or leading zeros: 3.14 is three point one four."""
    whole, _, decimals = written.replace(",", "").replace("'", "").partition(".")
    if len(whole) > MAX_CARDINAL_DIGITS or (len(whole) > 1 and whole[0] == "0" and not decimals):
        words = digit_words(whole)
    else:
        words = cardinal_words(int(whole or "0"))
    return f"{words} point {digit_words(decimals)}" if decimals else words


def ordinal_from_cardinal(words: str) -> str:
    """The ordinal of a cardinal in words: twenty-one is twenty-first."""
    start = max(words.rfind(" "), words.rfind("-")) + 1
    last = words[start:]
    regular = f"{last[:-1]}ieth" if last.endswith("y") else f"{last}th"
    return words[:start] + _IRREGULAR.get(last, regular)


def ordinal_words(value: int) -> str:
    """21 is twenty-first."""
    return ordinal_from_cardinal(cardinal_words(value))


def year_words(value: int) -> str:
    """1999 is nineteen ninety-nine, 2005 two thousand five, 1905 nineteen oh five, 1900 nineteen hundred."""
    century, rest = divmod(value, 100)
    # 2000 to 2009 are two thousand and so on, other years two halves
    if value < 1000 or value > 9999 or (value % 1000 < 10):
        return cardinal_words(value)
    if not rest:
        return f"{cardinal_words(century)} hundred"
    return f"{cardinal_words(century)} {'oh ' if rest < 10 else ''}{cardinal_words(rest)}"


def plural(words: str) -> str:
    """Plural of the last word: twenty becomes twenties, hundred hundreds, six sixes."""
    if words.endswith("y"):
        return f"{words[:-1]}ies"
    return f"{words}es" if words.endswith("x") else f"{words}s"


def decade_year_words(value: int) -> str:
    """1990 is nineteen nineties, 90 nineties, 2000 two thousands."""
    return plural(year_words(value) if value >= 1000 else cardinal_words(value))


def fraction_words(top: int, bottom: int) -> str:
    """1/2 is one half, 3/4 three quarters, 5/8 five eighths; others are read with over."""
    # no ordinal for these: 5/0, 1/128, 0/4
    if bottom in {0, 1} or bottom > 100 or top == 0:
        return f"{cardinal_words(top)} over {cardinal_words(bottom)}"
    part = {2: "half", 4: "quarter"}.get(bottom) or ordinal_words(bottom)
    if top == 1:
        return f"one {part}"
    return f"{cardinal_words(top)} {'halves' if bottom == 2 else part + 's'}"


def roman_value(numeral: str) -> int:
    """Value of a Roman numeral in standard spelling; 0 for any other string."""
    value = 0
    for letter, following in zip(numeral, [*numeral[1:], ""], strict=True):
        amount = _ROMAN[letter]
        value += -amount if following and _ROMAN[following] > amount else amount
    # IIII or IC are no numerals: only the standard spelling of the value is
    return value if 0 < value < 4000 and _roman_numeral(value) == numeral else 0


def _roman_numeral(value: int) -> str:
    pairs = [(1000, "M"), (900, "CM"), (500, "D"), (400, "CD"), (100, "C"), (90, "XC"), (50, "L"), (40, "XL")]
    pairs += [(10, "X"), (9, "IX"), (5, "V"), (4, "IV"), (1, "I")]
    written = ""
    for amount, letters in pairs:
        count, value = divmod(value, amount)
        written += letters * count
    return written
