"""Values of SSML attributes (break durations, rates, volumes), and checks common to all elements.

Values of ``<phoneme>``, ``<voice>`` and ``<lang>``: phones, voices and languages.
"""

import re
import unicodedata
from collections.abc import Callable, Mapping
from types import MappingProxyType

from lexicon.dictionary import arpabet_segments
from lexicon.errors import InputError
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.languages import language_code

Attributes = Mapping[str, str]
MAX_ATTRIBUTE_CHARACTERS = 10_000  # longer text belongs between tags
_PERCENT = re.compile(r"([+-]?)([0-9]{1,6}(?:\.[0-9]{1,9})?)%")
_FACTOR = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,9})?")
_DECIBEL = re.compile(r"([+-]?[0-9]{1,6}(?:\.[0-9]{1,9})?)\s*dB", re.IGNORECASE)
# Seconds by strength: from pauses of read speech at commas (0.2-0.4 s) to those between paragraphs (1 s).
BREAKS_S = MappingProxyType({"none": 0.0, "x-weak": 0.1, "weak": 0.2, "medium": 0.4, "strong": 0.7, "x-strong": 1.0})
NAMED_RATES = MappingProxyType({"x-slow": 0.5, "slow": 0.75, "medium": 1.0, "default": 1.0, "fast": 1.3, "x-fast": 1.7})
NAMED_VOLUMES = MappingProxyType(
    {"silent": 0.0, "x-soft": 0.35, "soft": 0.6, "medium": 1.0, "default": 1.0, "loud": 1.4, "x-loud": 2.0}
)
ALPHABETS: Mapping[str, Callable[[str], tuple[IpaPhone, ...]]] = MappingProxyType({
    "ipa": parse_ipa, "x-arpabet": arpabet_segments, "arpabet": arpabet_segments, "x-cmu": arpabet_segments,
})  # fmt: skip
# Voices that a document may name, as in tts2face.sound; Piper voices are files, which a document cannot open.
VOICES = ("heart", "kore", "fenrir", "emma", "fable", "joe", "mei", "espeak", "espeak-female")
_ENGLISH_VOICES = frozenset(VOICES[:6])
GENDERS = ("female", "male", "neutral")
MAX_PHONES_CHARACTERS = 500  # characters of ``ph``
MAX_WORD_CHARACTERS = 60  # characters of a word with given phones
_NO_WORD = re.compile(r"[^\w'’-]+")
PhonemeWord = tuple[str, tuple[IpaPhone, ...]]


def primary_subtag(tag: str) -> str:
    """Primary subtag of a language tag: de of de-CH."""
    return tag.strip().replace("_", "-").partition("-")[0].lower()


def check_lengths(element: str, attributes: Attributes) -> None:
    """Refuse attributes longer than `MAX_ATTRIBUTE_CHARACTERS`."""
    for name, value in attributes.items():
        if len(value) > MAX_ATTRIBUTE_CHARACTERS or len(name) > MAX_ATTRIBUTE_CHARACTERS:
            raise InputError(
                f"the attribute {name[:40]} of <{element}> has {len(value)} characters, but the maximum is "
                f"{MAX_ATTRIBUTE_CHARACTERS}; put the text between tags"
            )


def check_attributes(element: str, attributes: Attributes, *known: str) -> Attributes:
    """The attributes, after a check that all of them are known."""
    for name in attributes:
        if name not in known:
            raise InputError(f"<{element}> does not support the attribute {name[:40]!r}; use {', '.join(known)}")
    return attributes


def look_up_value(what: str, value: str, values: Mapping[str, float]) -> float:
    """Value of a named setting."""
    if value not in values:
        raise InputError(f"there is no {what} {value[:40]!r}; use {', '.join(values)}")
    return values[value]


def parse_rate(written: str) -> float:
    """Factor of the speaking rate from a name, a percentage (80%), a change (-20%), or a number."""
    value = written.strip()
    if match := _PERCENT.fullmatch(value):
        share = float(match[2]) / 100
        return {"": share, "+": 1 + share, "-": 1 - share}[match[1]]
    if _FACTOR.fullmatch(value):
        return float(value)
    return look_up_value("rate", value, NAMED_RATES)


def parse_volume(written: str) -> float:
    """Factor of the volume from a name or decibels (+6dB)."""
    if match := _DECIBEL.fullmatch(written.strip()):
        # 1,000 dB is refused by the limits as well, and does not overflow
        return float(10.0 ** (min(float(match[1]), 1e3) / 20))
    if written.strip() not in NAMED_VOLUMES:
        raise InputError(
            f"cannot read the volume {written[:40]!r}; use decibels such as +6dB, or one of {', '.join(NAMED_VOLUMES)}"
        )
    return NAMED_VOLUMES[written.strip()]


def phoneme_words(text: str, written: str, alphabet: str) -> list[PhonemeWord]:
    """Words with their phones: word by word if the IPA has as many words as the text, else all phones as one word."""
    if alphabet not in ALPHABETS:
        raise InputError(f"<phoneme> does not support the alphabet {alphabet[:40]!r}; use {', '.join(ALPHABETS)}")
    if len(written) > MAX_PHONES_CHARACTERS:
        raise InputError(
            f"the phones of a <phoneme> have {len(written)} characters; use at most {MAX_PHONES_CHARACTERS}"
        )
    words = [word for word in (_NO_WORD.sub("", part).strip("'’-_") for part in text.split()) if word]
    parts = written.split()
    if alphabet == "ipa" and len(parts) == len(words) > 1:
        return [_phoneme_word(word, part, alphabet) for word, part in zip(words, parts, strict=True)]
    word = "-".join(words) or "".join(c for c in written if unicodedata.category(c) in {"Ll", "Lu", "Lo"}) or "phones"
    return [_phoneme_word(word, written, alphabet)]


def _phoneme_word(word: str, written: str, alphabet: str) -> PhonemeWord:
    segments = ALPHABETS[alphabet](written)
    if not segments:
        raise InputError(f'the <phoneme> of {word[:40]!r} contains no phone; write ph="..." in {alphabet}')
    if len(word) > MAX_WORD_CHARACTERS:
        raise InputError(
            f"a <phoneme> needs words of at most {MAX_WORD_CHARACTERS} characters, not {len(word)}; shorten it"
        )
    return word, segments


def choose_voice(attributes: Mapping[str, str], language: str) -> tuple[str | None, str | None]:
    """Voice and language of a ``<voice>`` element; None where they do not change.

    Of several names the first available one is used; a gender selects among the voices of the language.

    Raises
    ------
    InputError
        The voice, gender or language does not exist, or the voice does not speak the language.
    """
    tag = attributes.get("xml:lang") or attributes.get("language") or attributes.get("languages", "").split(" ")[0]
    spoken = language_code(tag) if tag else None
    gender = attributes.get("gender", "neutral")
    if gender not in GENDERS:
        raise InputError(f"there is no gender {gender[:40]!r} of voices; use {', '.join(GENDERS)}")
    is_american = (spoken or language) in {"en-us", "en"}
    by_gender = {"female": "heart" if is_american else "espeak-female", "male": "espeak", "neutral": None}[gender]
    if "name" not in attributes:
        return by_gender, spoken
    name = next((name for name in attributes["name"].split() if name in VOICES), None)
    if name is None:
        raise InputError(f"there is no voice {attributes['name'][:40]!r}; use {', '.join(VOICES)}, or a gender")
    if name in _ENGLISH_VOICES and not (spoken or language).startswith("en"):
        raise InputError(f"the voice {name} speaks English, not {spoken or language}; use espeak")
    return name, spoken
