r"""Signs of English texts that are spoken where their neighbours say so: 27", |x|, 5!, 7 - 4, Mon-Fri, 3 * 4, ★★★.

`lexicon.canonical` drops quotes, bars, stars and backslashes, and makes pauses of dashes and ranges. Here those that
are spoken become stand-ins, which it keeps; `written_signs` gives a written form its own signs back.
"""

import functools
import re
from collections.abc import Callable
from types import MappingProxyType

INCH, FACTORIAL, MINUS, RANGE, BAR, BACKSLASH, STAR, HOME, UNDERSCORE, ARROW = "∹⊣∸∼∣∖✮∿⎵⟶"
_SIGN_OF = MappingProxyType({
    INCH: '"', FACTORIAL: "!", MINUS: "-", RANGE: "–", BAR: "|", BACKSLASH: "\\", STAR: "★", HOME: "~", UNDERSCORE: "_",
    ARROW: "->",
    "∕": ")/",
})  # fmt: skip
OVER = "∕"  # the bar of a fraction behind a bracket
_WRITTEN = str.maketrans(dict(_SIGN_OF))
_SIGNS = re.compile("['’`\"”″|★⭐\\*_−–—⁺⁻!/~-]")
_ANY = re.compile(r"[0-9]['’]|`|[\"”″|★⭐\\*]|[0-9a-zA-Z)°%]\)?\s?[-–—−!/]|~/|_|[⁺⁻]|->|[1-7]\*")
_DAY = r"(?:(?:Mon|Tues?|Wed|Thu(?:rs?)?|Fri|Sat|Sun)\b\.?|(?:Mon|Tues|Wednes|Thurs|Fri|Satur|Sun)days?\b)"
_MONTH = (
    r"(?:(?:Jan|Feb|Mar|Apr|May|Jun|Jul|Aug|Sept?|Oct|Nov|Dec)\b\.?|"
    r"(?:January|February|March|April|June|July|August|September|October|November|December)\b)"
)
_DASH = r"\s?[-–—−]\s?"
_HALF = r"[ap]\.?m\b\.?"
_SUM = re.compile(r"\s*(?:[=+×÷*/<>≤≥≈]|\Z|[.,;?!)](?:\s|\Z)|(?:and|is|equals|gives|makes|or|then)\b)")
_OPERATOR_BEFORE = re.compile(r"[=+×÷*/<>≤≥≈(]\s*\Z|\b(?:[Cc]ompute|[Cc]alculate|[Ss]olve|[Ee]valuate)\s*\Z")
_SCORE = re.compile(
    r"\b(?:w[io]n|wins|lost|lose|beat|beats|score[ds]?|score|led|lead|drew|draw|victory|defeat|final)\b"
)
_RANGE_BEFORE = re.compile(
    r"\b(?:pages?|pp\.|chapters?|ages?|aged|grades?|weeks?|days?|years?|from|between|lines?|rows?|verses?|items?|steps?|"
    r"floors?|rooms?|numbers?|sections?|parts?|vols?\.|nos?\.|figs?\.|(?:jan|feb|mar|apr|may|june?|july?|aug|sept?|oct|nov|dec)[a-z]*\.?|\d\s?(?:[ap]m)?)\s*\Z",
    re.IGNORECASE,
)
_STARRED = (
    r"(?:hotels?|resorts?|rat(?:ings?|ed)|reviews?|restaurants?|service|accommodation|luxury|b&bs?|lodges?|inns?|villas?|"
    r"apartments?|hostels?|motels?|spas?|safety|generals?|stays?|quality|standards?|experience|products?|sellers?|scores?|"
    r"books?|films?|movies?|games?|apps?|drivers?|hosts?|guests?|places?|treatment|energy|recruits?)\b"
)
_PLAIN = str.maketrans("²³", "23")
_CONTEXT = 60  # characters before a dash between spaces that decide what it is
_SINGLE = re.compile("['’‘]")
_ELISION = re.compile(r"(?:em|cause|til|tis|twas|bout|round|n)\b|[0-9]0s\b", re.IGNORECASE)
_QUOTES = re.compile(r"[\"”″“]|''")


def _between_numbers(m: re.Match[str]) -> str:
    """A dash with spaces between numbers: minus, or the range or score that it is without spaces."""
    before = m.string[max(0, m.start() - _CONTEXT) : m.start()]
    if m["sign"] == "−" or _OPERATOR_BEFORE.search(before):
        return f"{m['a']} {MINUS} "
    if _RANGE_BEFORE.search(before) or _SCORE.search(before):
        return f"{m['a']}–"
    return f"{m['a']} {MINUS} " if _SUM.match(m.string, m.end("b")) else f"{m['a']}–"


def _range(m: re.Match[str]) -> str:
    return f"{m[1] or m[2]} {RANGE} "


def _minus(m: re.Match[str]) -> str:
    return f"{m[1] or m[2]} {MINUS} "


def _charge(m: re.Match[str]) -> str:
    return m[1].translate(_PLAIN) + ("+" if m[2] == "⁺" else MINUS)


def _without_closing_quotes(text: str) -> str:
    """A text without the single quotes that end a quotation behind a number, which are no marks of feet."""
    pieces: list[str] = []
    at = 0
    is_open = False
    for quote in _SINGLE.finditer(text):
        before, after = text[quote.start() - 1 : quote.start()], text[quote.end() : quote.end() + 1]
        if is_open and before.isalnum() and not after.isalnum():
            is_open = False
            if before.isdigit():
                pieces += [text[at : quote.start()], " "]
                at = quote.end()
        elif not before.isalnum() and after.isalnum() and not _ELISION.match(text, quote.end()):
            is_open = True
    return "".join([*pieces, text[at:]])


def _with_inches(text: str) -> str:
    """Marks of inches in place of the double quotes that end no quotation and follow a number."""
    pieces: list[str] = []
    at = 0
    is_open = False
    for quote in _QUOTES.finditer(text):
        start = quote.start()
        sign = quote[0]
        follows_digit = text[start - 1 : start].isdigit() or text[start - 1 : start] in {"½", "¼", "¾"}
        if follows_digit and (sign in {"″", "''"} or not is_open) and sign != "“":
            pieces += [text[at:start], INCH]
            at = quote.end()
        elif sign in {'"', "“", "”"}:
            is_open = sign == "“" or (sign == '"' and not is_open)
    return "".join([*pieces, text[at:]])


@functools.cache
def _steps() -> tuple[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]], ...]:
    """Patterns in the order in which they are tried, each linear: all repeats over signs are bounded.

    They are compiled at their first use, which takes 4 ms.
    """
    return (
        # 3 * 4, 2*x; 4* hotels and s*x are none
        (
            re.compile(
                r"(?<=[0-9)])(\s?)\*\1(?=[0-9(]|[a-z]\b)|(?<=\b[a-z])(\s?)\*\2(?=[0-9(])|(?<=\b[a-z])\s\*\s(?=[a-z]\b)"
            ),
            " × ",
        ),
        (re.compile(r"(?<![\w|])\|(?=[\w-])([^|\n]{1,40})(?<=[\w)])\|(?![\w|])"), rf"{BAR}\1{BAR}"),
        (re.compile(r"(?<=[0-9])!(?=\s*[=+×÷*/<>≤≥)-]|\s?[-−] ?[0-9])|(?<=\b[nkmr])!(?=\s*[=+×÷/])"), FACTORIAL),
        (re.compile(r"\b([A-Z]:)\\"), rf"\1{BACKSLASH}"),
        (re.compile(r"(?<=[\w.∖])\\(?=[\w.])"), BACKSLASH),
        (re.compile(r"(?<![-<])-{1,3}>"), ARROW),
        # a 5* hotel; behind another number a star is the sign of a footnote
        (re.compile(rf"(?<![\w.,$£€])([1-7])\*(?=[ -]{_STARRED})|(?<=[Rr]ated )([1-7])\*"), rf"\1\2{STAR}"),
        (re.compile(r"[★⭐]"), STAR),
        (re.compile(r"(?<![\w~])~(?=/\w)"), HOME),
        (re.compile(r"(?<=[A-Za-z0-9])_(?=[\w.+-]{0,62}@\w)"), UNDERSCORE),
        (re.compile(r"(?<=[\w)])\)/(?=[\w(])"), OVER),
        # Ca²⁺, Na⁺, Cl⁻
        (re.compile(r"(?<=[A-Za-z0-9₀-₉])([²³]?)([⁺⁻])(?![⁰¹²³⁴-⁹])"), _charge),
        (re.compile(r"\b((?:F|Cl|Br|I|OH|NO[₃3]))[-−](?= ions?\b)"), rf"\1{MINUS}"),
        (re.compile(rf"\b({_DAY}){_DASH}(?={_DAY})|\b({_MONTH}){_DASH}(?={_MONTH})"), _range),
        # 9am-5pm, 6-8pm, 10 %-15 %, $10-$15
        (re.compile(rf"(?<=[0-9])( ?{_HALF}){_DASH}(?=[0-9]|noon\b|midnight\b)"), rf"\1 {RANGE} "),
        (re.compile(rf"(?<=[0-9]){_DASH}(?=[0-9]{{1,2}}(?::[0-9]{{2}})? ?{_HALF})"), f" {RANGE} "),
        (re.compile(rf"(?<=[0-9])( ?(?:%|°[CF]?)){_DASH}(?=[0-9])"), rf"\1 {RANGE} "),
        (re.compile(r"(?<=[0-9])( ?)[-–](?=[$£€][0-9.]{1,9} ?[-–])"), rf"\1{RANGE}"),
        (
            re.compile(r"(?<![\w.])(?P<a>[0-9]{1,9}(?:[.,][0-9]{1,9})?)(?: (?P<sign>[-–−]) |−)(?=(?P<b>[0-9]{1,9}))"),
            _between_numbers,
        ),
        # x - 1, n-1, 2 - x
        (
            re.compile(r"(?<![\w'’.-])([kmnpqrtxyz]) [-–−] (?=[0-9(]|[a-z]\b)|(?<![\w'’.-])([kmnxyz])[-−](?=[0-9])"),
            _minus,
        ),
        (re.compile(r"(?<=[0-9)])(?: [-−] (?=[kmnxyz]\b(?![-'’.]))|[-−](?=[knxyz]\b(?![-'’.])))"), f" {MINUS} "),
    )


def keep_signs(text: str) -> str:
    """An English text with stand-ins for the signs that are spoken; the text itself if it has none."""
    if not (_SIGNS.search(text) and _ANY.search(text)):
        return text
    text = _without_closing_quotes(text.replace("`", " "))
    for pattern, replacement in _steps():
        text = pattern.sub(replacement, text)
    return _with_inches(text)


def written_signs(form: str) -> str:
    """A written form with the signs of which it has stand-ins."""
    return form if form.isascii() else form.translate(_WRITTEN)
