"""Phones of English words: CMUdict, spelled initialisms, and the parts of compounds and inflected words."""

from collections.abc import Callable
from types import MappingProxyType

from lexicon.dictionary import cmudict_lookup
from lexicon.ipa import Segment
from lexicon.phones import ARPABET, PHONES, nearest_phones

_INVENTORY = frozenset(ARPABET.values())
# espeak-ng's finer English phones in the inventory of CMUdict; phones that are not listed map to the nearest one.
_FOLDED_PHONES = MappingProxyType({
    "ɜ": ("ɝ",), "ɐ": ("ə",), "ɾ": ("t",), "ʔ": ("t",), "ɒ": ("ɑ",), "a": ("æ",), "e": ("ɛ",), "o": ("oʊ",),
    "r": ("ɹ",), "ɫ": ("l",), "x": ("k",), "əʊ": ("oʊ",), "iə": ("i", "ə"), "ɪə": ("ɪ", "ə"), "eə": ("ɛ", "ə"),
    "ʊə": ("ʊ", "ə"),
})  # fmt: skip
_REDUCED_VOWELS = MappingProxyType({"ʌ": "ə", "ɝ": "ɚ"})
_FULL_VOWELS = MappingProxyType({reduced: full for full, reduced in _REDUCED_VOWELS.items()})
MAX_SPELLED_LETTERS = 3  # letters; longer capitals are a word (NASA) if CMUdict has it or it contains vowels
_ACRONYMS = frozenset({"AIDS", "SIM", "RAM", "ROM", "PIN", "GIF", "LED", "ZIP", "LAN", "WAN", "NATO", "NASA"})
CAPITALISED_WORDS = frozenset({
    "THE", "AND", "NOT", "YOU", "ARE", "FOR", "BUT", "ALL", "NO", "YES", "SO", "GO", "OF", "TO", "IN", "ON", "IS", "BE",
    "AT", "AN", "AS", "BY", "DO", "HE", "ME", "MY", "WE", "IF", "UP", "WAS", "CAN", "HIS", "HER", "OUR", "NEW", "NOW",
})  # fmt: skip  # short words that are never initialisms; a capital neighbour is none either
_VOICELESS_ENDINGS = frozenset({"p", "t", "k", "f", "θ"})
_SIBILANTS = frozenset({"s", "z", "ʃ", "ʒ", "tʃ", "dʒ"})


def fold_to_arpabet(segments: tuple[Segment, ...]) -> tuple[Segment, ...]:
    """A word in CMUdict's inventory: 39 ARPABET phones and the reduced vowels."""
    result: list[Segment] = []
    for segment in segments:
        phone, stress = segment.phone, segment.stress
        if phone == "ɹ" and result and result[-1].phone == "ɹ":
            continue  # espeak-ng writes a linking r twice: ɑːɹ ɹ
        phones = (phone,) if phone in _INVENTORY else _FOLDED_PHONES.get(phone) or nearest_phones(phone, _INVENTORY)
        if segment.is_syllabic and not PHONES[phone].is_vowel:
            result.append(Segment("ə", stress, is_syllabic=True))
            stress = 0
        for at, one in enumerate(phones):
            is_vowel = PHONES[one].is_vowel
            own_stress = stress if is_vowel and at == 0 else 0
            by_stress = _FULL_VOWELS.get(one, one) if own_stress else _REDUCED_VOWELS.get(one, one)
            result.append(Segment(by_stress, own_stress, is_syllabic=is_vowel))
    return tuple(result)


def _spell_letters(letters: str) -> tuple[Segment, ...] | None:
    """Concatenated names of letters; each name keeps its stress."""
    result: list[Segment] = []
    for letter in letters:
        name = cmudict_lookup("a." if letter in "Aa" else letter)
        if name is None:
            return None
        result += name
    return tuple(result)


def _add_s(base: tuple[Segment, ...]) -> tuple[Segment, ...]:
    last = base[-1].phone
    if last in _SIBILANTS:
        return (*base, Segment("ɪ", is_syllabic=True), Segment("z"))
    return (*base, Segment("s" if last in _VOICELESS_ENDINGS else "z"))


def _is_initialism(word: str) -> bool:
    if not (word.isascii() and word.isalpha() and word.isupper()) or word in _ACRONYMS:
        return False
    return len(word) <= MAX_SPELLED_LETTERS or (cmudict_lookup(word) is None and not set(word) & set("AEIOUY"))


Lookup = Callable[[str], tuple[Segment, ...] | None]


def look_up_word(word: str, *, is_letter: bool, own: Lookup) -> tuple[Segment, ...] | None:
    """Phones of an English word from the user's entries, CMUdict or its parts; None if spelling rules are needed.

    Parameters
    ----------
    is_letter
        A single capital is the name of a letter (plan A), not the article.
    own
        Lookup in the user's dictionary, which takes precedence for the whole word and for its parts.
    """
    entry = own(word)
    if entry is not None:
        return entry
    if (len(word) == 1 and is_letter) or (len(word) > 1 and _is_initialism(word)):
        return _spell_letters(word)
    if word[-1:] == "s" and len(word) > 2 and _is_initialism(word[:-1]):
        letters = _spell_letters(word[:-1])
        return None if letters is None else _add_s(letters)
    entry = cmudict_lookup(word)
    if entry is not None:
        return entry
    if "-" in word:
        parts = [look_up_word(part, is_letter=False, own=own) for part in word.split("-") if part]
        return None if None in parts else tuple(segment for part in parts for segment in part or ())
    stem = word[:-2] if word[-2:] in {"'s", "'S"} else ""
    base = look_up_word(stem, is_letter=False, own=own) if stem else None
    return _add_s(base) if base else None
