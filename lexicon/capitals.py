"""Text written in capitals, as in subtitles and headings, in the capitals and small letters of ordinary writing.

In such a text capitals do not tell names, initialisms and abbreviations from other words. `sentence_case` writes it as
the tables of abbreviations, months and units expect it, and leaves in capitals what is spelled: ``DR. JONES OF THE U.S.
ARMY`` becomes ``Dr. Jones of the U.S. army``. Initialisms of other texts are not touched.
"""

import functools
import re
from collections.abc import Iterable

from lexicon import written_forms as readings
from lexicon.dictionary import cmudict_lookup, own_pronunciation, word_set
from lexicon.english import CAPITALISED_WORDS, is_acronym, is_read_by_letters
from lexicon.form_readers import BEFORE_ROMAN, NEVER_LETTERS, RULERS, TITLES
from lexicon.number_words import roman_value
from lexicon.sentence_ends import abbreviations

_WORD = re.compile(r"[^\W\d_]+(?:['’][^\W\d_]+)*")
_TWO_CAPITALS = re.compile(r"[^\W\d_a-z]{2}")  # without them no word is in capitals
_PREFIX = re.compile(r"(?:Mc|Mac)(?=[A-Z])")
_SENTENCE_END = re.compile(r"[!?…。！？]|\.(?![0-9])|\n\s*\n|:\s|\A\Z")
_OF_INITIALISM = re.compile(r"([A-Z]{2,5})(?:['’]?S)\Z")  # the FBI's, DVDs
_STOP = re.compile(r"\s*[.!?…]")
_VOWELS = frozenset("AEIOUY")
_SYLLABLE = re.compile("[^AEIOU][AEIOU][^AEIOUHWY]")  # a short name (JAX) rather than an initialism (ICU, ETA)
_SUBJECTS = word_set("HE SHE IT WE THEY YOU I THE THIS THAT THERE")  # begin a sentence after an abbreviation
_NAMED = word_set("MONDAY TUESDAY WEDNESDAY THURSDAY FRIDAY SATURDAY SUNDAY") | {
    month.upper() for month in readings.MONTHS if month not in ("March", "May")
}
_SHORT_MONTHS = frozenset({month[:3].upper() for month in readings.MONTHS} | {"SEPT", "MARCH"})
_NAMES = frozenset({"MAX", "MIN"})  # abbreviations of small letters that are names and words in capitals
_DOTLESS = frozenset({"MR", "MRS", "MS", "DR"})  # without a full stop, as in British English
_ENDINGS = frozenset({"S", "ST", "ND", "RD", "TH", "AM", "PM"})  # after digits
_TITLES_ALONE = frozenset({"Dr", "Mr", "Mrs", "Ms", "St"})  # also without a name after them
# as `english.MAX_SPELLED_LETTERS`: FBI is spelled, NASA is not
_MAX_SPELLED_LETTERS = 3
# Abbreviations of four letters and more that dictionaries read as words.
READ_ACRONYMS = word_set(
    "ADAC AIPAC ARPA ASCAP ASCII ASEAN AWACS AWOL BAFTA BIOS CERN CMOS COBOL COVID DARPA DEFCON EBITDA EPCOT ESPN "
    "FAFSA FEMA FICA FIFA FLOTUS FOMO GATT HAMAS HIPAA ICANN IKEA INTERPOL JPEG JSON LASER LEGO LIBOR LINUX MENSA MERS "
    "MPEG NAFTA NASCAR NASDAQ NIMBY NORAD OECD OPEC OSHA OXFAM PAYPAL POTUS RADAR RICO SARS SCOTUS SCUBA SONAR SONY "
    "SWAT UEFA UNESCO UNICEF UNIX USAID VISA YAML YMCA YOLO"
)
# Short words that are shouted and are no initialisms.
_SHOUTED = word_set(
    "AHA ASK ATE BOO BOY BUY CRY DID DIE EAT FAR FEW GOD GUN HIT HUH JOY LIE MAD NAH OWN PAY SAD TRY UGH USE WAR YAY "
    "YEP YUP"
)
_MIN_WORD_LETTERS = 4  # a text with such a word in capitals holds more than initialisms


@functools.cache
def _initialisms() -> dict[str, tuple[frozenset[str], frozenset[str]]]:
    """Initialisms that are also words, with the words after and before which they are no words; none: anywhere."""
    table = readings.read_table("initialisms.tsv")
    return {word: (word_set(after.upper()), word_set(before.upper())) for word, (after, before) in table.items()}


@functools.cache
def _function_words() -> frozenset[str]:
    return CAPITALISED_WORDS | {word.upper() for word in readings.read_table("function_words.tsv")}


@functools.cache
def _units() -> dict[str, str]:
    return {unit.casefold(): unit for unit in reversed(readings.read_table("units.tsv"))}


@functools.cache
def _abbreviations(language: str) -> dict[str, str]:
    """Abbreviations by their capitals; of two spellings (No, no) the capitalised one."""
    written = sorted((word for word in abbreviations(language) if len(word) > 1), reverse=True)
    return {
        word.upper(): word
        for word in written
        if word.upper() != word and (word[0].isupper() or word.upper() not in _NAMES)
    }


def is_in_capitals(texts: Iterable[str]) -> bool:
    """Whether texts of one author, such as the cues of a file, are written in capitals: nine of ten words are."""
    words = [word for text in texts for word in _WORD.findall(text) if len(word) > 1 and word.lower() != word.upper()]
    n_capital = sum(map(_is_capital, words))
    return len(words) > 1 and n_capital >= 0.9 * len(words) and _is_shouted(words)


def is_word_in_capitals(word: str, before: str) -> bool:
    """Whether an English word in capitals, beside words in small letters, is a word: NEVER and SO, but not FBI or NASA.

    Parameters
    ----------
    before
        The word before it: what *the WHO* is, *WHO* is not.
    """
    plain = word.replace("’", "'")
    if (
        plain in _initialisms()
        or is_acronym(plain)
        or plain in READ_ACRONYMS
        or plain in readings.read_table("informal_words.tsv")
        or (plain == "WHO" and before.lower() == "the")
    ):
        return False
    if len(plain) <= _MAX_SPELLED_LETTERS:
        return plain in _function_words() or plain in _SHOUTED
    return _is_word(plain) and not is_read_by_letters(plain)


def sentence_case(text: str, language: str = "en-us", *, is_shouted: bool = False) -> str:
    """A text whose passages in capitals are written with small letters; every character keeps its place.

    A passage is the whole text, or whole sentences of it, with two or more words in capitals, of which one is no
    initialism.

    Parameters
    ----------
    language
        Of English all words change, of other languages abbreviations: espeak-ng reads capitals as words.
    is_shouted
        The text is one of several that are in capitals (`is_in_capitals`), however short it is.
    """
    words = list(_WORD.finditer(text)) if is_shouted or _TWO_CAPITALS.search(text) else []
    written = list(text) if words else [text]
    for first, last in [(0, len(words))] if is_shouted else _passages(text, words):
        if language.partition("-")[0].lower() == "en":
            _write_english(text, words[first:last], written)
        else:
            _write_abbreviations(text, words[first:last], _abbreviations(language), written)
    return "".join(written)


def _is_capital(word: str) -> bool:
    return _PREFIX.sub("", word).isupper()


def _is_shouted(words: list[str]) -> bool:
    long = [word for word in words if len(word) > 1]
    return len(long) > 1 and any(len(word) >= _MIN_WORD_LETTERS or word in _function_words() for word in long)


def _passages(text: str, words: list[re.Match[str]]) -> list[tuple[int, int]]:
    """Half-open ranges of words in capitals that are whole sentences."""
    found: list[tuple[int, int]] = []
    first = 0
    for at in range(len(words) + 1):
        if at < len(words) and _may_be_capital(words[at].group()):
            continue
        start, end = first, at
        while start < end and start > 0 and not _divides(text, words, start):
            start += 1
        while end > start and end < len(words) and not _divides(text, words, end):
            end -= 1
        inside = words[start:end]
        if _is_shouted([word.group() for word in inside]) or any(
            _abbreviation(text, word, _abbreviations("en")) for word in inside
        ):
            found.append((start, end))
        first = at + 1
    return found


def _may_be_capital(word: str) -> bool:
    """Whether a word is in capitals, or of a writing system without them."""
    return _is_capital(word) or word.upper() == word.lower()


def _divides(text: str, words: list[re.Match[str]], at: int) -> bool:
    """Whether a sentence ends between a word and the one before it."""
    between = text[words[at - 1].end() : words[at].start()]
    return _SENTENCE_END.search(between) is not None and (between.strip() != "." or not between.endswith("."))


def _write_abbreviations(text: str, words: list[re.Match[str]], known: dict[str, str], written: list[str]) -> None:
    for word in words:
        spelling = _abbreviation(text, word, known)
        if spelling:
            written[word.start() : word.start() + len(spelling)] = spelling


def _abbreviation(text: str, word: re.Match[str], known: dict[str, str]) -> str:
    """Spelling of the abbreviation that begins at a word and ends with a full stop; empty without one."""
    longest = re.match(r"[^\W\d_]+(?:\.[^\W\d_]+){0,3}(?=\.)", text[word.start() : word.start() + 12])
    is_inside = word.start() > 0 and text[word.start() - 1] == "."
    return known.get(longest.group(), "") if longest and not is_inside else ""


def _write_english(text: str, words: list[re.Match[str]], written: list[str]) -> None:
    """Write the words of a passage with small letters."""
    names = [_abbreviation(text, word, _abbreviations("en")) for word in words]
    names = [name if _is_abbreviated(name, words[at + 1 : at + 2]) else "" for at, name in enumerate(names)]
    starts, end = True, 0
    for at, word in enumerate(words):
        if word.start() < end:  # the D of Ph.D.
            continue
        starts = starts and not any(map(str.isdigit, text[end : word.start()]))
        spelling = names[at] or _spelling(text, word, *(_neighbour(words, near) for near in (at - 1, at + 1)))
        is_name = _is_name_after(names[at - 1] if at else "", word.group()) or _is_name_before(text, words, names, at)
        if spelling[:1].islower() and not names[at] and (starts or is_name):
            spelling = spelling[0].upper() + spelling[1:]
        end = word.start() + len(spelling)
        written[word.start() : end] = spelling
        starts = _STOP.match(text, end) is not None and not names[at] and not (len(spelling) == 1 and text[end] == ".")


def _neighbour(words: list[re.Match[str]], at: int) -> str:
    return words[at].group() if 0 <= at < len(words) else ""


def _is_abbreviated(name: str, following: list[re.Match[str]]) -> bool:
    """Whether a word with a full stop is a title, which a name follows (HON. SMITH; not: THANKS, HON.), or no title."""
    context = readings.read_table("abbreviations.tsv").get(name, ("", ""))[1]
    return context != "title" or name in _TITLES_ALONE or _is_content(following[0].group() if following else "")


def _is_content(word: str) -> bool:
    return word != "" and (word not in _function_words() or word == "WHO")  # Dr. Who


def _is_name_after(abbreviation: str, word: str) -> bool:
    """Whether a word after an abbreviation is a name (Dr. Jones), or begins a sentence (... Inc. He left)."""
    context = readings.read_table("abbreviations.tsv").get(abbreviation, ("", ""))[1]
    return abbreviation != "" and (word in _SUBJECTS or (context in TITLES and _is_content(word)))


def _is_name_before(text: str, words: list[re.Match[str]], names: list[str], at: int) -> bool:
    """Whether a word before an abbreviation is a name: Main St., Smith Jr."""
    following = names[at + 1] if at + 1 < len(words) else ""
    context = readings.read_table("abbreviations.tsv").get(following, ("", ""))[1]
    if context not in ("after", "doctor", "saint") or not _is_content(words[at].group()):
        return False
    if text[words[at].end() : words[at + 1].start()].strip():
        return False
    after = text[words[at + 1].end() : words[at + 2].start()] if at + 2 < len(words) else "?"
    return context == "after" or not (after.strip() == "." and _is_content(words[at + 2].group()))


def _spelling(text: str, word: re.Match[str], before: str, after: str) -> str:
    """A word of an English passage: in small letters, or as it is where its letters are read one by one."""
    letters = word.group()
    beside = _beside_number(text, word)
    if beside:
        return beside
    if letters in _DOTLESS or letters in _NAMED or (letters in _NAMES and text.startswith(".", word.end())):
        return letters.capitalize()
    if letters == "A" and _is_content(after):
        return "a"
    stem = _OF_INITIALISM.match(letters)
    if stem is not None and _is_spelled(stem[1], before, after) and not _is_word(letters):
        return stem[1] + letters[stem.end(1) :].lower()
    is_kept = len(letters) == 1 or not _is_capital(letters) or _is_spelled(letters, before, after)
    # I'm, I'll
    return letters if is_kept else letters.lower().replace("i'", "I'", letters.startswith("I'"))


def _beside_number(text: str, word: re.Match[str]) -> str:
    """A unit, currency, month or ending beside digits, as its table writes it; empty for another word."""
    letters = word.group()
    before = text[max(word.start() - 2, 0) : word.start()]
    after = text[word.end() :][:3]
    if before.endswith("/") and letters in ("H", "S"):  # km/h
        return letters.lower()
    has_number = before.rstrip()[-1:].isdigit()
    if has_number and letters.casefold() in _units():
        return letters if letters in _units().values() else _units()[letters.casefold()]
    if letters in readings.CURRENCIES and (has_number or after.strip()[:1].isdigit()):
        return letters
    if letters in _SHORT_MONTHS and (has_number or re.match(r"\.? \d", after)):
        return letters.capitalize()
    is_glued = before[-1:].isdigit()
    if is_glued and letters in _ENDINGS:
        return letters.lower()
    return letters if is_glued or after[:1].isdigit() else ""


def _is_spelled(word: str, before: str, after: str) -> bool:
    """Whether a word of a passage in capitals is an initialism or a Roman numeral."""
    is_roman = re.fullmatch("[IVXLCDM]+", word) is not None and roman_value(word) > 0
    if is_roman and (word in NEVER_LETTERS or before.lower() in BEFORE_ROMAN | RULERS):
        return True
    if word in _initialisms():
        preceding, following = _initialisms()[word]
        return not (preceding or following) or before in preceding or after in following
    return _has_letters_alone(word)


def _is_word(word: str) -> bool:
    return cmudict_lookup(word) is not None or own_pronunciation(word) is not None


@functools.lru_cache(maxsize=10_000)
def _has_letters_alone(word: str) -> bool:
    """Whether dictionaries read a word by its letters, or do not have it and it does not look like a word."""
    if _is_word(word) or not word.isalpha():
        return is_read_by_letters(word)
    is_short = len(word) <= _MAX_SPELLED_LETTERS and not _SYLLABLE.fullmatch(word)
    return is_short or not set(word) & _VOWELS
