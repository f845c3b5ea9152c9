"""Values of SSML attributes other than those of ``<prosody>``: breaks, phones, voices and languages."""

import re
import unicodedata
from collections.abc import Callable, Mapping
from types import MappingProxyType

from lexicon.dictionary import arpabet_segments
from lexicon.errors import InputError
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.languages import language_code
from lexicon.marked_text import PhoneMark
from lexicon.marked_text_builder import MarkedTextBuilder

Attributes = Mapping[str, str]
TYPICAL_HZ = 165.0  # between the usual pitch of men and of women, for a voice of which it is not known
VoiceHz = Callable[[str | None, str], float]  # usual pitch of a voice (None: that of the request) in a language
MAX_ATTRIBUTE_CHARACTERS = 10_000  # longer text belongs between tags
# Seconds by strength: from pauses of read speech at commas (0.2-0.4 s) to those between paragraphs (1 s).
BREAKS_S = MappingProxyType({"none": 0.0, "x-weak": 0.1, "weak": 0.2, "medium": 0.4, "strong": 0.7, "x-strong": 1.0})
ALPHABETS: Mapping[str, Callable[[str], tuple[IpaPhone, ...]]] = MappingProxyType({
    "ipa": parse_ipa, "x-arpabet": arpabet_segments, "arpabet": arpabet_segments, "x-cmu": arpabet_segments,
    "cmu-arpabet": arpabet_segments,
})  # fmt: skip
# Voices that a document may name, as in tts2face.sound; Piper voices are files, which a document cannot open.
VOICES = ("heart", "kore", "fenrir", "emma", "fable", "joe", "mei", "espeak", "espeak-female")
_ENGLISH_VOICES = frozenset(VOICES[:6])
GENDERS = ("female", "male", "neutral")
MAX_PHONES_CHARACTERS = 500  # characters of ``ph``
MAX_WORD_CHARACTERS = 60  # characters of a word with given phones
_LOCALE = re.compile(r"([a-z]{2,3}-[A-Z]{2})-\w")  # de-DE-KatjaNeural, en-US-Neural2-C
_NO_WORD = re.compile(r"[^\w'’-]+")
PhonemeWord = tuple[str, tuple[IpaPhone, ...]]


def typical_hz(_: str | None, __: str) -> float:
    """Pitch of a voice of which nothing is known, in Hz."""
    return TYPICAL_HZ


def primary_subtag(tag: str) -> str:
    """Primary subtag of a language tag: de of de-CH."""
    return tag.strip().replace("_", "-").partition("-")[0].lower()


def known_language(tag: str, note: Callable[[str], None]) -> str | None:
    """Code of a language; None, which is noted, if there is none (SSML 1.1, 3.1.12 leaves it to the processor)."""
    try:
        return language_code(tag)
    except InputError:
        note(f"there is no language {tag[:40]!r}; its words are spoken in the language around them")
        return None


def check_lengths(element: str, attributes: Attributes) -> None:
    """Refuse attributes longer than `MAX_ATTRIBUTE_CHARACTERS`."""
    for name, value in attributes.items():
        if len(value) > MAX_ATTRIBUTE_CHARACTERS or len(name) > MAX_ATTRIBUTE_CHARACTERS:
            raise InputError(
                f"the attribute {name[:40]} of <{element}> has {len(value)} characters, but the maximum is "
                f"{MAX_ATTRIBUTE_CHARACTERS}; put the text between tags"
            )


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


def choose_voice(
    attributes: Mapping[str, str], language: str, note: Callable[[str], None]
) -> tuple[str | None, str | None]:
    """Voice and language of a ``<voice>`` element; None where they do not change.

    Of several names the first available one is used; a gender selects among the voices of the language. `note` is
    called with what is not followed.

    Raises
    ------
    InputError
        The voice does not speak the language.
    """
    tag = (
        attributes.get("xml:lang")
        or attributes.get("language")
        or attributes.get("languages", "").split(" ")[0].partition(":")[0]
    )
    spoken = known_language(tag, note) if tag else None
    gender = attributes.get("gender", "neutral").strip() or "neutral"
    if gender not in GENDERS:
        note(f"there is no gender {gender[:40]!r} of voices")
    is_american = (spoken or language) in {"en-us", "en"}
    by_gender = {"female": "heart" if is_american else "espeak-female", "male": "espeak"}.get(gender)
    if "name" not in attributes:
        return by_gender, spoken
    name = next((name for name in attributes["name"].split() if name in VOICES), None)
    if name is None:
        guessed = None if tag else _language_of_name(attributes["name"])
        is_other = guessed is not None and primary_subtag(guessed) != primary_subtag(language)
        said = f"; its words are taken for {guessed} by its name" if is_other else ""
        note(f"there is no voice {attributes['name'][:40]!r}, another one speaks{said}; there are {', '.join(VOICES)}")
        return by_gender, guessed if is_other else spoken
    if name in _ENGLISH_VOICES and not (spoken or language).startswith("en"):
        raise InputError(f"the voice {name} speaks English, not {spoken or language}; use espeak")
    return name, spoken


def _language_of_name(name: str) -> str | None:
    """Language that the name of a service's voice begins with: de of de-DE-KatjaNeural; None without one."""
    match = _LOCALE.match(name.strip())
    try:
        return language_code(match[1]) if match else None
    except InputError:
        return None


def add_phonemes(builder: MarkedTextBuilder, text: str, phones: str, alphabet: str) -> None:
    """Add words with given phones."""
    for number, (word, segments) in enumerate(phoneme_words(text, phones, alphabet)):
        start = builder.at + (number > 0)
        builder.add_mark(PhoneMark(start, start + len(word), segments))
        builder.add_text(f" {word}" if number else word)
