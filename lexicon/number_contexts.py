"""Numbers that are no amounts: rooms, roads and flights are read by halves, codes and telephones digit by digit.

What a number is follows from the words before and after it; ``states.tsv`` has the states before postal codes.
"""

import re

from lexicon.number_words import cardinal_words, digit_words, number_words, ordinal_words
from lexicon.written_forms import read_table

CONTEXT = 48  # characters on each side that decide
_HALVES_BEFORE = re.compile(
    r"(?:\b(?:rooms?|rm\.?|suites?|ste\.?|apartments?|apt\.?|gates?|(?:p\.? ?o\.? )?box(?:es)?|lockers?|cabins?|wards?|"
    r"studios?|halls?|bays?|units?|flights?(?: [a-z][a-z0-9])?|highways?|hwy\.?|routes?|rte\.?|interstates?|freeways?|"
    r"turnpike|exits?|"
    r"(?:county|state|farm) road|(?:error|status|response|exit)(?: codes?)?|https?(?: status| error)?|"
    r"boeing|airbus|porsche|peugeot)"
    r"|\bU\.?S\.?|(?-i:\bI))[ -]\Z",
    re.IGNORECASE,
)
_STREET = (
    r"(?:St|Street|Ave|Avenue|Rd|Road|Blvd|Boulevard|Ln|Lane|Dr|Drive|Way|Ct|Court|Pl|Place|Sq|Square|Terrace|Pkwy|"
    r"Parkway|Hwy|Highway|Circle|Cir|Close|Crescent|Row|Alley)\b"
)
_HALVES_AFTER = re.compile(
    r"(?i: (?:errors?|status|responses?)\b)"
    rf"|[A-Z]?(?: [NSEW]\.?)?(?: (?:[A-Z][\w']{{0,20}}|[0-9]{{1,3}}[a-z]{{2}})){{1,3}} {_STREET}"
)
_CODE_BEFORE = re.compile(
    r"\b(?:(?:PINs?|pins?|ZIP|[Zz]ip|[Pp]ass(?:code|word)|[Ee]xt(?:ension|\.)?|[Pp]ostcode|ISBN|ISSN|"
    r"(?:[Zz]ip|ZIP|[Aa]rea|[Aa]ccess|[Ee]ntry|[Dd]oor|[Ss]ecurity|[Gg]ate|[Cc]ountry|[Pp]ostal|[Pp]romo|[Cc]onfirmation|"
    r"[Vv]erification|[Aa]ctivation|[Dd]ialing|[Ss]hort) code|"
    r"(?:[Aa]ccount|[Cc]ard|[Ss]erial|[Tt]racking|[Cc]onfirmation|[Rr]eference|[Pp]olicy|[Pp]assport|[Mm]ember|[Oo]rder|"
    r"[Pp]hone|[Tt]elephone|[Mm]obile) (?:[Nn]umber|[Nn]o\.))"
    r"(?: is| was|:| =)?|[Tt]ext(?:ed|s|ing)?\b[^.!?]{0,24} to|(?:card|account|number|phone)\b[^.!?]{0,20}"
    r" (?:ends|ended|ending) (?:in|with))(?: code| number)? \Z"
)
_CALL_BEFORE = re.compile(
    r"\b(?:[Cc]all(?:s|ed|ing)?|[Rr]ang|[Rr]ing|[Pp]hon(?:e|es|ed|ing)|[Dd]ial(?:s|l?ed|l?ing)?|[Tt]ext(?:s|ed|ing)?)"
    r"(?: at| on)? \Z|\b[Ee]mergency (?:numbers?|lines?|calls?|services?)\b[^.!?;0-9]{0,20}\Z"
)
# The numbers before one that is read as they are: call 911 or 112, rooms 305 and 306.
_OTHERS_BEFORE = re.compile(r"(?:[0-9]{3,20}(?:, ?(?:and |or )?| (?:and|or|then) )){1,4}\Z")
_THINGS_AFTER = re.compile(r" (?:more |other |new |different )?(?:people|men|women|children|[a-z]{3,}s)\b")
_VERSION_BEFORE = re.compile(r"\b(?:[Vv]ersion|[Rr]elease|[Ss]ection|[Uu]pdate|v) ?\Z")
SHORT_NUMBERS = frozenset({"911"})  # digit by digit without a verb, too, but where a car or a road has it


def halves_words(written: str) -> str:
    """A number of three or four digits in two halves: 305 is three oh five, 1600 sixteen hundred."""
    if written[0] == "0":
        return digit_words(written)
    head, tail = int(written[:-2]), int(written[-2:])
    if not tail:
        return cardinal_words(int(written)) if head % 10 == 0 else f"{cardinal_words(head)} hundred"
    return f"{cardinal_words(head)} {'oh ' if tail < 10 else ''}{cardinal_words(tail)}"


def words_in_context(m: re.Match[str], written: str) -> str:
    """Words of a number that is a code or a designation at its place in a text; empty where it is an amount."""
    if not (3 <= len(written) <= 20 and written.isdigit()):
        return ""
    before = m.string[max(0, m.start() - CONTEXT) : m.start()]
    after = m.string[m.end() : m.end() + CONTEXT]
    is_counted = _THINGS_AFTER.match(after) is not None
    if not is_counted:
        before = _OTHERS_BEFORE.sub("", before)
    if len(written) <= 4 and (_HALVES_BEFORE.search(before) or _HALVES_AFTER.match(after)):
        return halves_words(written)
    is_called = _CALL_BEFORE.search(before) is not None and not is_counted
    if is_called or written in SHORT_NUMBERS or _CODE_BEFORE.search(before):
        return digit_words(written)
    return ""


def read_scripture(m: re.Match[str], _: str) -> str:
    """1 Cor. 13:4-7 is First Corinthians thirteen four to seven."""
    part = {"I": "1", "II": "2", "III": "3"}.get(m["part"] or "", m["part"])
    name = read_table("scripture.tsv")[m["book"]][0] if m["book"] else m.group().partition(" ")[0]
    places = re.sub(r"[-–]", " to ", m["places"]).replace(":", " ").replace(";", ",")
    places = re.sub(r"[0-9]+", lambda number: f" {number_words(number[0])} ", places)
    head = f"{ordinal_words(int(part)).capitalize()} {name}" if part else name
    return " ".join(f"{head} {places}".replace(" ,", ",").split())


def read_network_address(m: re.Match[str], _: str) -> str:
    """10.0.0.101:8080 is ten dot zero dot zero dot one oh one colon eighty eighty; 1.2.3.4 is a version."""
    parts = m["host"].split(".")
    before = m.string[max(0, m.start() - CONTEXT) : m.start()]
    if _VERSION_BEFORE.search(before) or (not m["port"] and max(map(len, parts)) < 3):
        return " point ".join(number_words(part) for part in parts)
    host = " dot ".join(halves_words(part) if len(part) > 2 else number_words(part) for part in parts)
    if not m["port"]:
        return host
    return f"{host} colon {halves_words(m['port']) if len(m['port']) in {3, 4} else number_words(m['port'])}"


def read_zip_code(m: re.Match[str], _: str) -> str:
    """TX 78701 and Texas 78701 are Texas seven eight seven oh one, of 10001-2345 each digit."""
    state = read_table("states.tsv").get(m["state"].replace(".", ""), (m["state"],))[0]
    return f"{state} {digit_words(m['zip']).replace('zero', 'oh')}"


def read_digits(m: re.Match[str], _: str) -> str:
    """Digits of groups one by one, with a comma between groups: ISBN 978-3-16, card numbers."""
    groups = re.findall(r"[0-9]+|X\b", m.group())
    return ", ".join(group if group == "X" else digit_words(group) for group in groups)


def read_designation(m: re.Match[str], _: str) -> str:
    """A320 is A three twenty, 747-400 seven forty-seven four hundred, A320-200 A three twenty two hundred."""
    numbers = re.findall("[0-9]+", m.group())
    letters = f"{m['letters']} " if m["letters"] else ""
    return letters + " ".join(halves_words(number) if len(number) > 2 else number_words(number) for number in numbers)
