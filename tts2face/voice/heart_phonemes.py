"""The neural voice's phoneme letters and the phones of the table, each way."""

from collections.abc import Sequence
from types import MappingProxyType

from lexicon.errors import InputError
from lexicon.ipa import Segment
from lexicon.phones import nearest_phones

# Letters of the misaki alphabet, in which the voice was trained, to phones of the table.
PHONE_OF_LETTER = MappingProxyType({
    "A": "eɪ", "I": "aɪ", "O": "oʊ", "Q": "oʊ", "W": "aʊ", "Y": "ɔɪ", "ʤ": "dʒ", "ʧ": "tʃ", "ə": "ə", "ɐ": "ə",
    "ᵊ": "ə", "ᵻ": "ɪ", "ɪ": "ɪ", "i": "i", "ɛ": "ɛ", "æ": "æ", "a": "æ", "ɑ": "ɑ", "ɒ": "ɑ", "ɔ": "ɔ", "ʊ": "ʊ",
    "u": "u", "ʌ": "ʌ", "ɜ": "ɝ", "ɚ": "ɚ", "e": "ɛ", "o": "ɔ", "ɹ": "ɹ", "r": "ɹ", "ð": "ð", "θ": "θ", "ʃ": "ʃ",
    "ʒ": "ʒ", "ŋ": "ŋ", "j": "j", "ɡ": "ɡ", "T": "t", "ɾ": "t", "ʔ": "t", "h": "h", "x": "k", "b": "b", "d": "d",
    "f": "f", "k": "k", "l": "l", "m": "m", "n": "n", "p": "p", "s": "s", "t": "t", "v": "v", "w": "w", "z": "z",
})  # fmt: skip
LETTERS_OF_PHONE = MappingProxyType({
    "eɪ": "A", "aɪ": "I", "oʊ": "O", "aʊ": "W", "ɔɪ": "Y", "dʒ": "ʤ", "tʃ": "ʧ", "ə": "ə", "ɪ": "ɪ", "i": "i",
    "ɛ": "ɛ", "æ": "æ", "ɑ": "ɑ", "ɔ": "ɔ", "ʊ": "ʊ", "u": "u", "ʌ": "ʌ", "ɝ": "ɜɹ", "ɚ": "əɹ", "ɹ": "ɹ", "ð": "ð",
    "θ": "θ", "ʃ": "ʃ", "ʒ": "ʒ", "ŋ": "ŋ", "j": "j", "ɡ": "ɡ", "h": "h", "b": "b", "d": "d", "f": "f", "k": "k",
    "l": "l", "m": "m", "n": "n", "p": "p", "s": "s", "t": "t", "v": "v", "w": "w", "z": "z",
})  # fmt: skip
RHOTIC_VOWELS = MappingProxyType({"ə": "ɚ", "ɝ": "ɝ", "ɚ": "ɚ"})  # vowels that merge with a following ɹ
VOWELS = frozenset(phone for letter, phone in PHONE_OF_LETTER.items() if letter in "AIOQWYəɐᵊᵻɪiɛæaɑɒɔʊuʌɜɚeo")
STRESS_MARKS = MappingProxyType({1: "ˈ", 2: "ˌ"})


def letters_to_phones(letters: str) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Phones of a word's letters, and the position of each phone's first letter.

    əɹ is one phone (ɚ) unless a vowel follows; ɜɹ is always one (ɝ). Stress marks and length signs are skipped.
    """
    candidates = [(PHONE_OF_LETTER[letter], at) for at, letter in enumerate(letters) if letter in PHONE_OF_LETTER]
    phones: list[str] = []
    places: list[int] = []
    for number, (phone, at) in enumerate(candidates):
        follows = candidates[number + 1][0] if number + 1 < len(candidates) else ""
        is_rhotic = phone == "ɹ" and phones and phones[-1] in RHOTIC_VOWELS
        if is_rhotic and (phones[-1] != "ə" or follows not in VOWELS):
            phones[-1] = RHOTIC_VOWELS[phones[-1]]
            continue
        phones.append(phone)
        places.append(at)
    return tuple(phones), tuple(places)


def segments_to_letters(segments: Sequence[Segment]) -> str:
    """Letters of phones in the voice's alphabet; a phone that the alphabet lacks is replaced by the nearest one.

    Raises
    ------
    InputError
        `segments` is empty.
    """
    if not segments:
        raise InputError("a spoken word needs at least one phone")
    letters = ""
    for segment in segments:
        for phone in nearest_phones(segment.phone, LETTERS_OF_PHONE.keys()):
            letters += STRESS_MARKS.get(segment.stress, "") + LETTERS_OF_PHONE[phone]
    return letters
