"""Read a text of a language with a table: its written forms with their words, so that only words reach espeak-ng."""

import re
import unicodedata
from collections.abc import Sequence

from lexicon.locales.harmony import with_tail
from lexicon.locales.place import Place
from lexicon.locales.scanner import PLACE, VOWEL_SIGNS, scanner
from lexicon.locales.tables import Locale, find_locale
from lexicon.written_forms import WrittenForm, read_table

# one character for one, so that the written form of each word stays known
_PLAIN = {0xA0: " ", 0x202F: " ", 0x2009: " ", 0x2007: " ", 0x2212: "-", 0x2010: "-", 0x2011: "-", 0x2044: "/",
          0x7C: " ", 0xFF05: "%", 0x66A: "%", 0x66B: ".", 0x66C: ",", 0x2019: "'", 0x2BC: "'",
          0x2126: "\u03a9"}  # fmt: skip
_MINUS = re.compile(r"(?<![\w.,])([-−][0-9]{1,400}(?:[.,][0-9]{1,400})?)")
_LAST_WORD = re.compile(rf"(?:[^\W\d_]|[{VOWEL_SIGNS}])+\Z")


class _PlainCharacters(dict[int, str]):
    """Digits of all writing systems, circles and indices as ASCII ones, and one kind of space, minus and apostrophe."""

    def __missing__(self, code: int) -> str:
        letter = chr(code)
        is_digit = code > 127 and unicodedata.category(letter) == "Nd"
        is_digit = is_digit or unicodedata.decomposition(letter).startswith(("<circle>", "<sub>"))  # ①, H₂O
        digit = unicodedata.digit(letter, None) if is_digit else None
        self[code] = plain = letter if digit is None else str(digit)
        return plain


_CHARACTERS = _PlainCharacters(_PLAIN)
_JOINED_LETTERS = re.compile(r"[\u2103\u2109\u2160-\u217f\u3371-\u337a\u3380-\u33df®™℠]")  # ℃ Ⅳ ㎏
_UNSPOKEN = frozenset("®™℠")
_POWERS = str.maketrans("23", "²³")


def _plain_text(text: str) -> tuple[str, Sequence[int]]:
    """A text in plain characters, and for each of them the index of the written one, with that of the end."""
    plain = text.translate(_CHARACTERS)
    if not _JOINED_LETTERS.search(plain):
        return plain, range(len(text) + 1)
    letters: list[str] = []
    places: list[int] = []
    for at, letter in enumerate(plain):
        said = "" if letter in _UNSPOKEN else letter
        if said and _JOINED_LETTERS.match(letter):
            said = unicodedata.normalize("NFKC", letter).translate(_POWERS)
        letters.append(said)
        places += [at] * len(said)
    return "".join(letters), (*places, len(text))


def read_forms(text: str, language: str) -> list[WrittenForm]:
    """Parts of a text with their spoken forms; written forms without blanks, and what is between them as it is.

    The sources, joined, are the text.
    """
    locale = find_locale(language)
    if locale is None:
        return _with_minus(text, language)
    plain, places = _plain_text(text)
    found: list[WrittenForm] = []
    at = done = 0
    said = ""
    join = locale.setting("join", " ")
    while place := PLACE.search(plain, at):
        match, spoken = _read(locale, plain, place, said)
        if match is None or spoken is None:
            at, said = place.end(), ""
            continue
        if done < match.start():
            found.append(WrittenForm(text[places[done] : places[match.start()]], plain[done : match.start()]))
        at = done = match.end()
        is_joined = found and _ends_in_letter(found[-1].spoken) and spoken[:1].isalnum()
        is_joined = is_joined and _last_word(found[-1].spoken) not in locale.words("prefixes")
        is_followed = (
            plain[at : at + 1].isalnum() and _ends_in_letter(spoken) and not _is_attached(locale, plain, at, spoken)
        )
        found.append(
            WrittenForm(text[places[match.start()] : places[at]], join * bool(is_joined) + spoken + join * is_followed)
        )
        said = _last_word(spoken.rstrip())
    if done < len(plain):
        found.append(WrittenForm(text[places[done] :], plain[done:]))
    return found


def _ends_in_letter(spoken: str) -> bool:
    """Whether words end in a letter, perhaps with the sign of a vowel."""
    last = spoken[-1:]
    return bool(last) and (last.isalnum() or unicodedata.category(last)[0] == "M")


def _is_attached(locale: Locale, text: str, at: int, spoken: str) -> bool:
    """Whether the letters behind a form are an ending of its last word: of a noun (퍼센트가), or of a number (일이)."""
    endings = locale.setting("endings")
    return bool(endings) and (
        spoken[-1] not in locale.setting("number_ends") or bool(re.match(endings, text[at : at + 8]))
    )


def _with_minus(text: str, language: str) -> list[WrittenForm]:
    """Parts of a text of a language without a table, whose minus before a number espeak-ng 1.52 mostly leaves out."""
    row = read_table("minus_words.tsv").get(language.partition("-")[0])
    parts = _MINUS.split(text) if row else [text]
    forms = [WrittenForm(part, part) for part in parts]
    return [
        WrittenForm(form.source, f"{row[0]} {form.source[1:]}") if row and at % 2 else form
        for at, form in enumerate(forms)
    ]


def _last_word(text: str) -> str:
    last = _LAST_WORD.search(text)
    return last.group() if last else ""


def read(text: str, language: str) -> str:
    """Spoken form of a text."""
    return "".join(form.spoken for form in read_forms(text, language))


def _read(locale: Locale, text: str, place: re.Match[str], said: str) -> tuple[re.Match[str] | None, str | None]:
    """The first form at a place that its reader reads."""
    for form in scanner(locale).at(place, text):
        match = form.pattern.match(text, place.start())
        if match and match.end() > match.start():
            found = Place(locale, text, match, said)
            spoken = form.reader(found)
            if spoken is not None:
                spoken = with_tail(spoken, match.groupdict().get("tail") or "")
                ends = match.group().endswith(".") and spoken[-1:].isalnum() and found.is_last
                return match, f"{spoken}." if ends else spoken
    return None, None
