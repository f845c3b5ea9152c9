"""Values of ``<phoneme>``, ``<voice>`` and ``<lang>``: phones, voices and languages."""

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
# Voices that a document may name, as in tts2face.voice; Piper voices are files, which a document cannot open.
VOICES = ("heart", "joe", "espeak", "espeak-female")
_ENGLISH_VOICES = frozenset({"heart", "joe"})
GENDERS = ("female", "male", "neutral")
MAX_PHONES_CHARACTERS = 500  # characters of ``ph``
MAX_WORD_CHARACTERS = 60  # characters of a word with given phones
_NO_WORD = re.compile(r"[^\w'’-]+")

PhonemeWord = tuple[str, tuple[Segment, ...]]


def phoneme_words(text: str, written: str, alphabet: str) -> list[PhonemeWord]:
    """Words with their phones: word by word if the IPA has as many words as the text, else all phones as one word.

    Raises
    ------
    InputError
        The alphabet does not exist, or a phone does not belong to it.
    """
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
