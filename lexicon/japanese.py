"""Accent phrases of Japanese text with their reading in kana, by pyopenjtalk-plus (extra ``[japanese]``).

Without the library texts in kana alone are read by their spelling, with numbers in kana: the particles は and へ at the
end of what is written between spaces or marks are wa and e.
"""

import functools
import os
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lexicon.chunks import split_chunks
from lexicon.errors import BackendError, import_of_extra

_KANA = re.compile("[ァ-ヺー]+")
_OF_NUMBERS = frozenset("0123456789０１２３４５６７８９.,．，")
_NUMBERS = "一二三四五六七八九十百千万億兆"
_MINUS = str.maketrans("−", "-")
_MARKS = "。、，．！？…!?,;:；："
# what stands between marks and spaces, with the brackets around it
_PLAIN = re.compile(rf"[^\s{_MARKS}「」『』（）()・]+")
_PARTICLE = re.compile(r"(?<=[ぁ-ゖー])[はへ]\Z")
_PARTICLES = {"は": "わ", "へ": "え"}
_NO_PARTICLE = frozenset({"はは"})
# espeak-ng 1.52 says r-a-o for りょ
_AS_ESPEAK_READS = tuple(
    (re.compile(f"(?<=[りリ])[{small}]"), large) for small, large in (("ゃャ", "ヤ"), ("ゅュ", "ユ"), ("ょョ", "ヨ"))
)
MAX_CHARACTERS = 300  # per call; the library rejects texts of about 8,000 bytes


@dataclass(frozen=True, slots=True)
class JapanesePhrase:
    """Half-open range of characters of an accent phrase, and its kana; several readings of a number are one phrase."""

    start: int
    end: int
    kana: str


@functools.cache
def _kanji() -> re.Pattern[str]:
    """A Chinese character; compiled at its first use, which takes 4 ms."""
    return re.compile("[㐀-䶿一-鿿豈-﫿々〆〇𠀀-𪛟]")


def has_kanji(text: str) -> bool:
    """Whether the text contains Chinese characters."""
    return not text.isascii() and _kanji().search(text) is not None


@functools.cache
def load_reader() -> Any:
    """The library that reads Chinese characters."""
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # it imports onnxruntime, which would send telemetry
    with import_of_extra(
        "Japanese with Chinese characters needs pyopenjtalk-plus; run: pip install 'tts2face[japanese]', or write "
        "the text in kana"
    ):
        import pyopenjtalk
    return pyopenjtalk


def has_reader() -> bool:
    """Whether the library that reads Chinese characters is installed."""
    try:
        load_reader()
    except BackendError:
        return False
    return True


def to_kana(text: str) -> str:
    """Spoken form in kana (particles wa and e, long vowels, numbers), with spaces between accent phrases."""
    pieces, at = list[str](), 0
    for phrase in japanese_phrases(text):
        pieces += [_marks_of(text[at : phrase.start]), " ", phrase.kana]
        at = phrase.end
    return "".join([*pieces, _marks_of(text[at:])]).strip()


def japanese_phrases(text: str) -> tuple[JapanesePhrase, ...]:
    """Accent phrases of a text in order; Chinese characters need the library that reads them."""
    if not has_kanji(text) and not has_reader():
        return tuple(_plain_phrases(text))
    return _read_phrases(text)


@functools.lru_cache(maxsize=256)
def _read_phrases(text: str) -> tuple[JapanesePhrase, ...]:
    """Accent phrases of a text by the library, which takes 1 ms a sentence and is asked for a text several times."""
    read = load_reader().run_frontend
    found, start = list[JapanesePhrase](), 0
    for chunk in split_chunks(text, MAX_CHARACTERS, "ja"):
        end = start
        for piece in chunk.split(" "):  # white space alone is dropped
            end = text.index(piece, end) + len(piece)
        found += _phrases(read(_with_digits(chunk)), _folded(text[start:end]), start)
        start = end
    return tuple(_whole_numbers(found, text))


def _with_digits(text: str) -> str:
    """A text in which numbers are digits where the library reads their characters as another word (十分, 八百)."""
    from lexicon.locales.tables import find_locale

    locale = find_locale("ja")
    for pattern, row in locale.rows("counted").items() if locale else ():
        text = re.sub(f"(?<![{_NUMBERS}])(?:{pattern})(?![{_NUMBERS}])", row.spoken, text)
    return text


def numbers_in_kana(words: str) -> str:
    """Words of a number in kana, where the library that reads Chinese characters is not installed."""
    if has_reader():
        return words
    from lexicon.locales.tables import alternatives, find_locale

    locale = find_locale("ja")
    if locale is None:
        return words
    rows = locale.rows("kana")
    return re.sub(alternatives(locale, "kana"), lambda found: rows[found.group()].spoken, words)


def as_espeak_reads(kana: str) -> str:
    """Kana that espeak-ng says as they are spoken."""
    for pattern, large in _AS_ESPEAK_READS:
        kana = pattern.sub(large, kana)
    return kana


def _marks_of(text: str) -> str:
    return "".join(sign for sign in text if sign in _MARKS)


def _plain_phrases(text: str) -> Iterator[JapanesePhrase]:
    for part in _PLAIN.finditer(text):
        word = part.group()
        kana = word if word in _NO_PARTICLE else _PARTICLE.sub(lambda found: _PARTICLES[found.group()], word)
        yield JapanesePhrase(part.start(), part.end(), kana)


def _folded(text: str) -> tuple[str, list[int]]:
    """A text in canonical characters, and for each of them the index of the character that it is of, and the end."""
    parts = [unicodedata.normalize("NFKC", character).translate(_MINUS) for character in text]
    return "".join(parts), [at for at, part in enumerate(parts) for _ in part] + [len(text)]


def _phrases(
    words: Sequence[Mapping[str, Any]], letters: tuple[str, list[int]], start: int
) -> Iterator[JapanesePhrase]:
    """Phrases of the words of a reader; `chain_flag` 1 joins a word to the phrase before it."""
    found: list[JapanesePhrase] = []
    for word, (first, last) in zip(words, _spans(words, letters), strict=True):
        # the library marks devoiced vowels by ’, and writes the particle ヲ, which is spoken オ
        spoken = str(word["pron"]).replace("’", "").replace("ヲ", "オ")
        if not _KANA.fullmatch(spoken):
            continue
        is_same = bool(found) and start + first < found[-1].end
        if found and (is_same or word["chain_flag"] == 1):
            space = " " * (word["chain_flag"] != 1)
            before = found.pop()
            found.append(JapanesePhrase(before.start, start + last, before.kana + space + spoken))
        else:
            found.append(JapanesePhrase(start + first, start + last, spoken))
    return iter(found)


def _whole_numbers(phrases: Sequence[JapanesePhrase], text: str) -> Iterator[JapanesePhrase]:
    """Phrases of which none begins within a number (3.|5ドル)."""
    whole: JapanesePhrase | None = None
    for phrase in phrases:
        is_inside = whole is not None and whole.end == phrase.start and text[phrase.start].isdigit()
        if whole is not None and is_inside and text[whole.end - 1] in _OF_NUMBERS:
            whole = JapanesePhrase(whole.start, phrase.end, f"{whole.kana} {phrase.kana}")
            continue
        if whole is not None:
            yield whole
        whole = phrase
    if whole is not None:
        yield whole


def _place_of(written: str, text: str, at: int) -> tuple[int, int]:
    """Range of the next occurrence of a word in a text, perhaps with spaces within it (3 日); -1 if there is none."""
    place = text.find(written, at, at + len(written) + MAX_CHARACTERS)
    if place >= 0 and not any(map(str.isalnum, text[at:place])):
        return place, place + len(written)
    spaced = re.compile(r"\s?".join(map(re.escape, written))).search(text, at, at + 2 * len(written) + MAX_CHARACTERS)
    if spaced is not None and " " in spaced.group() and not any(map(str.isalnum, text[at : spaced.start()])):
        return spaced.span()
    return place, place + len(written)


def _spans(words: Sequence[Mapping[str, Any]], letters: tuple[str, list[int]]) -> list[tuple[int, int]]:
    """Range of each word in the text; the words of a number (十, 四) share the range of its digits."""
    text, places = letters
    spans: list[tuple[int, int]] = []
    at = n_waiting = 0
    for word in words:
        written = unicodedata.normalize("NFKC", str(word["string"])).translate(_MINUS)
        place, end = _place_of(written, text, at)
        gap = text[at:place]
        is_number = n_waiting > 0 and any(map(str.isdigit, gap))
        if place < 0 or not (is_number or not any(map(str.isalnum, gap))):
            n_waiting += 1
            spans.append((at, at))
            continue
        first = _after_space(text, at, place)
        spans[len(spans) - n_waiting :] = [(first, place)] * n_waiting
        at, n_waiting = end, 0
        spans.append((place, at))
    first = _after_space(text, at, len(text))
    spans[len(spans) - n_waiting :] = [(first, len(text.rstrip()))] * n_waiting
    return [(places[first], places[max(last - 1, first)] + (last > first)) for first, last in spans]


def _after_space(text: str, first: int, last: int) -> int:
    return last - len(text[first:last].lstrip())
