"""What ``<phoneme>``, ``<voice>`` and ``<lang>`` ask of a voice: phones, and who speaks in which language."""

import re
import unicodedata
from collections.abc import Callable, Mapping
from types import MappingProxyType

from lexicon.dictionary import arpabet_segments
from lexicon.errors import InputError
from lexicon.ipa import Segment, parse_ipa
from lexicon.languages import language_code

ALPHABETS: Mapping[str, Callable[[str], tuple[Segment, ...]]] = MappingProxyType({
    "ipa": parse_ipa, "x-arpabet": arpabet_segments, "arpabet": arpabet_segments, "x-cmu": arpabet_segments,
})  # fmt: skip
# Voices that a document may name, and how tts2face.voice calls them; a Piper voice is a file, which no document opens.
VOICES = ("heart", "espeak", "espeak-female")
GENDERS = ("female", "male", "neutral")
LONGEST_PHONES = 500  # characters of ``ph``
LONGEST_WORD = 60  # characters of a word whose phones are given
_NO_WORD = re.compile(r"[^\w'’-]+")

PhonedWord = tuple[str, tuple[Segment, ...]]


def phoned_words(text: str, written: str, alphabet: str) -> list[PhonedWord]:
    """Words and their phones: one of each where IPA has as many words as the text, else all phones as one word.

    Raises
    ------
    InputError
        There is no such alphabet, or a phone is none of it.
    """
    if alphabet not in ALPHABETS:
        raise InputError(f"<phoneme> has no alphabet {alphabet[:40]!r} here; choose {', '.join(ALPHABETS)}")
    if len(written) > LONGEST_PHONES:
        raise InputError(f"the phones of a <phoneme> have {len(written)} characters; {LONGEST_PHONES} are read")
    words = [word for word in (_NO_WORD.sub("", part).strip("'’-_") for part in text.split()) if word]
    parts = written.split()
    if alphabet == "ipa" and len(parts) == len(words) > 1:
        return [_phoned(word, part, alphabet) for word, part in zip(words, parts, strict=True)]
    shown = "-".join(words) or "".join(c for c in written if unicodedata.category(c) in {"Ll", "Lu", "Lo"}) or "phones"
    return [_phoned(shown, written, alphabet)]


def _phoned(word: str, written: str, alphabet: str) -> PhonedWord:
    segments = ALPHABETS[alphabet](written)
    if not segments:
        raise InputError(f'the <phoneme> of {word[:40]!r} holds no phone; write ph="..." in {alphabet}')
    if len(word) > LONGEST_WORD:
        raise InputError(f"a <phoneme> is read for words of at most {LONGEST_WORD} characters, not {len(word)}")
    return word, segments


def named_voice(attributes: Mapping[str, str], language: str) -> tuple[str | None, str | None]:
    """Voice and language that a ``<voice>`` asks for; None for what stays as it is.

    Of several names the first that exists counts; a gender chooses among the voices of the language.

    Raises
    ------
    InputError
        There is no such voice, gender or language, or the voice does not speak it.
    """
    tag = attributes.get("xml:lang") or attributes.get("language") or attributes.get("languages", "").split(" ")[0]
    spoken = language_code(tag) if tag else None
    gender = attributes.get("gender", "neutral")
    if gender not in GENDERS:
        raise InputError(f"there is no gender {gender[:40]!r} of voices; choose {', '.join(GENDERS)}")
    is_american = (spoken or language) in {"en-us", "en"}
    by_gender = {"female": "heart" if is_american else "espeak-female", "male": "espeak", "neutral": None}[gender]
    if "name" not in attributes:
        return by_gender, spoken
    name = next((name for name in attributes["name"].split() if name in VOICES), None)
    if name is None:
        raise InputError(f"there is no voice {attributes['name'][:40]!r} here; choose {', '.join(VOICES)}, or a gender")
    if name == "heart" and not (spoken or language).startswith("en"):
        raise InputError(f"the voice heart speaks English, not {spoken or language}; choose espeak")
    return name, spoken
