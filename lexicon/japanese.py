"""Spoken katakana of Japanese text with Chinese characters, by pyopenjtalk-plus (extra ``[japanese]``).

Texts in kana alone are read by espeak-ng, which cannot read Chinese characters.
"""

import functools
import os
import re
from collections.abc import Iterator, Mapping
from typing import Any

from lexicon.chunks import split_chunks
from lexicon.errors import import_of_extra

_KANJI = re.compile("[㐀-䶿一-鿿豈-﫿々〆〇𠀀-𪛟]")
_KANA = re.compile("[ァ-ヺー]+")
_PUNCTUATION = frozenset("。、？！…，．")
MAX_CHARACTERS = 300  # per call; the library rejects texts of about 8,000 bytes


def has_kanji(text: str) -> bool:
    """Whether the text contains Chinese characters."""
    return not text.isascii() and _KANJI.search(text) is not None


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


def to_kana(text: str) -> str:
    """Spoken form in katakana (particles wa and e, long vowels, numbers), with spaces between accent phrases."""
    read = load_reader().run_frontend
    return " ".join("".join(_kana_pieces(read(chunk))).strip() for chunk in split_chunks(text, MAX_CHARACTERS, "ja"))


def _kana_pieces(words: list[Mapping[str, Any]]) -> Iterator[str]:
    """Pieces of a sentence; `chain_flag` 1 joins a word to the phrase before it."""
    for number, word in enumerate(words):
        # the library marks devoiced vowels by ’, and writes the particle ヲ, which is spoken オ
        written, spoken = str(word["string"]), str(word["pron"]).replace("’", "").replace("ヲ", "オ")
        if not _KANA.fullmatch(spoken):
            yield written if written in _PUNCTUATION else f" {written} " if written.isalnum() else " "
        else:
            yield spoken if number == 0 or word["chain_flag"] == 1 else f" {spoken}"
