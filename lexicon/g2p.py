"""Grapheme-to-phoneme conversion by espeak-ng, through phonemizer, in every language of espeak-ng.

espeak-ng is a library with global state: one lock guards all calls.
"""

import functools
import re
import threading
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from lexicon.errors import BackendError, InputError
from lexicon.ipa import IpaPhone, parse_ipa

DEFAULT_LANGUAGE = "en-us"
MAX_DATA_PATH = 150  # characters; espeak-ng cuts longer paths off (its buffer holds 160)
_LOCK = threading.RLock()
# No voice speaks a hyphen behind a mark; espeak-ng 1.52 may read beyond its text at one.
_HYPHEN_BEHIND_MARK = re.compile(r"(?<=[^\w\s])-(?=[^\W\d])")
_LANGUAGE_SWITCH = re.compile(r"\([a-z0-9-]+\)")  # espeak-ng marks foreign words: (en)...(fr); their phones are kept
# The output of espeak-ng in tone languages is partly not IPA: tones as digits and as ɜ (a "3"), retroflexes with a dot.
# The vowel of English words among them is long: ɜː.
_TONE_LANGUAGES = frozenset({"cmn", "hak", "yue", "vi", "th", "my", "shn"})
_TONE_SPELLINGS = (
    (re.compile(r"ɜ(?!ː)|[0-9]|-"), ""),
    (re.compile(r"ts\."), "ʈʂ"),
    (re.compile(r"s\."), "ʂ"),
    (re.compile(r"(?<=[ptkqscɕʂ])h"), "ʰ"),
    (re.compile(r"nɡ"), "ŋ"),
)
# Vowels that espeak-ng 1.52 writes as others of their language: unrounded ones as y (мы, mưa, noite) and o (个), and
# Turkish ü as ø, where ö is œ.
_VOWEL_SPELLINGS = MappingProxyType({
    "cmn": (re.compile("o-"), "ɤ"), "vi": (re.compile("y"), "ɯ"), "ru": (re.compile("y"), "ɨ"),
    "pt-br": (re.compile("y"), "i"), "tr": (re.compile("ø"), "y"),
})  # fmt: skip
_SPELLINGS = (
    (re.compile(r"r\."), "ɽ"),
    (re.compile(r"sx"), "ɧ"),  # Swedish sju
    (re.compile(r"(?<=`)_?ʔ"), "ʼ"),  # Quechua ejectives
    (re.compile(r"(?<=[tc])_h"), "ʰ"),  # Korean aspirates
)


@functools.cache
def _espeak_wrapper() -> Any:
    """Phonemizer's espeak-ng class, set to the paths of the library and its data."""
    try:
        import espeakng_loader
        from phonemizer.backend.espeak.wrapper import EspeakWrapper
    except ImportError as missing:
        raise BackendError(f"{missing.name} is missing; install it with `pip install tts2face`") from missing
    data = str(espeakng_loader.get_data_path())
    if len(data) > MAX_DATA_PATH:
        raise BackendError(
            f"espeak-ng cannot read data under a path of more than {MAX_DATA_PATH} characters ({data}); "
            "install tts2face in a folder nearer to the root"
        )
    EspeakWrapper.set_library(espeakng_loader.get_library_path())
    EspeakWrapper.set_data_path(data)
    return EspeakWrapper


@functools.cache
def languages() -> Mapping[str, str]:
    """Names of all languages that espeak-ng speaks, by code.

    Raises
    ------
    BackendError
        espeak-ng is not installed or cannot be loaded.
    """
    with _LOCK:
        wrapper = _espeak_wrapper()
        try:
            voices = wrapper().available_voices()
        except RuntimeError as broken:
            raise BackendError(f"espeak-ng cannot be loaded: {broken}; reinstall espeakng-loader") from broken
    return MappingProxyType({voice.language: voice.name.strip() for voice in voices})


def check_language(language: str) -> None:
    """Check that a language is a code of espeak-ng; `lexicon.languages.language_code` converts other spellings.

    Raises
    ------
    InputError
        There is no such code.
    """
    if language != DEFAULT_LANGUAGE and language not in languages():
        raise InputError(
            f"there is no language {language[:40]!r}; use a code such as en-us, de, fr-fr, ja "
            "(`tts2face languages` lists all)"
        )


@functools.cache
def _espeak_reader(language: str) -> Any:
    reader = _espeak_wrapper()()
    reader.set_voice(language)
    return reader


def phonemize(lines: Sequence[str], language: str) -> tuple[tuple[str, ...], ...]:
    """IPA of each line in the notation of espeak-ng: one string per spoken word, phones separated by underscores.

    espeak-ng joins and splits words (``of the`` is one, a year is four).

    Raises
    ------
    InputError
        The language does not exist.
    BackendError
        espeak-ng is not installed.
    """
    check_language(language)
    if not lines:
        return ()
    with _LOCK:
        reader = _espeak_reader(language)
        texts = [_HYPHEN_BEHIND_MARK.sub(" ", line) for line in lines]
        spoken = [reader.text_to_phonemes(text) if text.strip() else "" for text in texts]
    parts = ([part.strip("_") for part in _LANGUAGE_SWITCH.sub("", line).split()] for line in spoken)
    return tuple(tuple(part for part in line if part) for line in parts)


def parse_espeak_word(written: str, language: str) -> tuple[IpaPhone, ...]:
    """Phones of one word in the notation of espeak-ng.

    Raises
    ------
    InputError
        It contains a letter that is not a phone of the table.
    """
    if language in _VOWEL_SPELLINGS:
        pattern, vowel = _VOWEL_SPELLINGS[language]
        written = pattern.sub(vowel, written)
    is_tonal = language.partition("-")[0] in _TONE_LANGUAGES
    for pattern, ipa in (*_TONE_SPELLINGS, *_SPELLINGS) if is_tonal else _SPELLINGS:
        written = pattern.sub(ipa, written)
    return parse_ipa(written)


def segments_by_rules(words: Sequence[str], language: str) -> tuple[tuple[IpaPhone, ...], ...]:
    """Phones of words by espeak-ng, each word by itself; empty for a word that it does not read."""
    return tuple(
        tuple(segment for part in written for segment in parse_espeak_word(part, language))
        for written in phonemize(words, language)
    )
