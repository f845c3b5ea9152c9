"""Phones of English words: CMUdict, spelled initialisms, and the parts of compounds and inflected words."""

import unicodedata
from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

from lexicon.dictionary import cmudict_lookup, named_pronunciation, own_pronunciation, word_set
from lexicon.ipa import IpaPhone
from lexicon.misaki import misaki_lookup
from lexicon.phones import ARPABET, PHONES, nearest_phones
from lexicon.word_parts import Lookup, add_s, beginning, read_parts

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
# Short words that are never initialisms; a capital neighbour is none either.
CAPITALISED_WORDS = word_set(
    "THE AND NOT YOU ARE FOR BUT ALL NO YES SO GO OF TO IN ON IS BE AT AN AS BY DO HE ME MY WE IF UP WAS CAN HIS HER "
    "OUR NEW NOW ONE TWO SIX TEN WHO WHY HOW GET GOT SEE SAY SHE HIM ITS LET MAN MEN DAY WAY OLD BIG BAD RED TOP WIN "
    "WON RUN HOT OUT OFF TOO ANY END FUN HI OH AH HEY WOW BYE MOM DAD SIR"
)
# letters that are not those without their marks: Peña is no Pena
_ACCENTS_WITH_SOUND = frozenset("ñłøćčšžśźżńęąřěůğışőűășțđðþãõ")


def fold_to_arpabet(segments: tuple[IpaPhone, ...]) -> tuple[IpaPhone, ...]:
    """A word in CMUdict's inventory: 39 ARPABET phones and the reduced vowels."""
    result: list[IpaPhone] = []
    for segment in segments:
        phone, stress = segment.phone, segment.stress
        if phone == "ɹ" and result and result[-1].phone in {"ɹ", "ɚ", "ɝ"}:
            continue  # espeak-ng writes a linking r twice: ɑːɹ ɹ, ɚɹ
        phones = (phone,) if phone in _INVENTORY else _FOLDED_PHONES.get(phone) or nearest_phones(phone, _INVENTORY)
        if segment.is_syllabic and not PHONES[phone].is_vowel:
            result.append(IpaPhone("ə", stress, is_syllabic=True))
            stress = 0
        for at, own_phone in enumerate(phones):
            is_vowel = PHONES[own_phone].is_vowel
            own_stress = stress if is_vowel and at == 0 else 0
            by_stress = (
                _FULL_VOWELS.get(own_phone, own_phone) if own_stress else _REDUCED_VOWELS.get(own_phone, own_phone)
            )
            result.append(IpaPhone(by_stress, own_stress, is_syllabic=is_vowel))
    return tuple(result)


def _spell_letters(letters: str) -> tuple[IpaPhone, ...] | None:
    """Concatenated names of letters; the last one has the primary stress."""
    # "a" is the article in CMUdict, "a." the letter
    names = [cmudict_lookup("a." if letter in "Aa" else letter) for letter in letters]
    if None in names:
        return None
    *others, last = [name for name in names if name]
    return (*(segment for name in others for segment in _demote_stress(name)), *last)


def _demote_stress(segments: Sequence[IpaPhone]) -> tuple[IpaPhone, ...]:
    """Phones with secondary in place of primary stress, and none in place of secondary stress."""
    lower = {0: 0, 1: 2, 2: 0}
    return tuple(replace(segment, stress=lower[segment.stress]) for segment in segments)


def _join_compound(parts: Sequence[str], spoken: Sequence[tuple[IpaPhone, ...]]) -> tuple[IpaPhone, ...]:
    """Phones of a compound with hyphens: of the parts with primary stress the lighter half loses it.

    After a single letter (X-ray), the other part loses it. These are the rules of misaki, by whose phones the neural
    voice was trained.
    """
    stressed = [at for at, segments in enumerate(spoken) if any(segment.stress == 1 for segment in segments)]
    by_weight = sorted(stressed, key=lambda at: (sum(1 + bool(PHONES[s.phone].parts) for s in spoken[at]), at))
    demoted = set(by_weight[: len(stressed) // 2])
    # T-shirt, X-ray: the letter keeps the stress
    if len(parts) == 2 and len(parts[0]) == 1:
        demoted = {1}
    return tuple(
        segment
        for at, segments in enumerate(spoken)
        for segment in (_demote_stress(segments) if at in demoted else segments)
    )


def is_read_by_letters(word: str) -> bool:
    """Whether CMUdict reads a word as the names of its letters: FBI, TV."""
    found, letters = cmudict_lookup(word), _spell_letters(word) if word.isascii() and word.isalpha() else None
    return found is not None and letters is not None and [s.phone for s in found] == [s.phone for s in letters]


def is_acronym(word: str) -> bool:
    """Whether a word in capitals is an abbreviation that is read as a word (NASA)."""
    return word in _ACRONYMS


def is_initialism(word: str) -> bool:
    """Whether a word in capitals is spelled letter by letter."""
    if not (word.isascii() and word.isalpha() and word.isupper()) or word in _ACRONYMS:
        return False
    if len(word) <= MAX_SPELLED_LETTERS:
        return True
    return not (set(word) & set("AEIOUY") or cmudict_lookup(word) or named_pronunciation(word))


def _listed(word: str) -> tuple[IpaPhone, ...] | None:
    """Phones of a word in the product's own table, CMUdict, or the table of names."""
    return own_pronunciation(word) or cmudict_lookup(word) or named_pronunciation(word)


def _look_up_without_accents(word: str) -> tuple[IpaPhone, ...] | None:
    """Phones of a word without its accents, where these only show how it is read in its language."""
    plain = "".join(letter for letter in unicodedata.normalize("NFD", word) if not unicodedata.combining(letter))
    if plain == word:
        return None
    has_own_sound = _ACCENTS_WITH_SOUND & set(unicodedata.normalize("NFC", word.lower()))
    named = own_pronunciation(plain) or named_pronunciation(plain)
    return named or (None if has_own_sound else cmudict_lookup(plain) or misaki_lookup(plain))


def look_up_word(word: str, *, is_letter: bool, own: Lookup) -> tuple[IpaPhone, ...] | None:
    """Phones of an English word from the user's entries, CMUdict or its parts; None if spelling rules are needed.

    Parameters
    ----------
    is_letter
        A single capital is the name of a letter (plan A), not the article.
    own
        Lookup in the user's dictionary, which takes precedence for the whole word and for its parts.
    """
    entry = own(word)
    if entry is None and ((len(word) == 1 and is_letter) or (len(word) > 1 and is_initialism(word))):
        return _spell_letters(word)
    # DVDs, TVs
    if entry is None and word[-1:] == "s" and len(word) > 2 and is_initialism(word[:-1]):
        letters = _spell_letters(word[:-1])
        return None if letters is None else add_s(letters)
    stem = word[:-2] if word[-2:] in {"'s", "'S"} else ""
    own_stem = own_pronunciation(stem)
    entry = entry or (add_s(own_stem) if own_stem else _listed(word)) or _look_up_without_accents(word)
    if entry is None and "-" in word:
        parts = [part for part in word.split("-") if part]
        # re-elected, co-own: not the note re, nor the company
        prefix = beginning(parts[0]) if len(parts) > 1 and own(parts[0]) is None and parts[0].islower() else None
        spoken = [look_up_word(part, is_letter=part.isupper(), own=own) for part in parts]
        spoken[:1] = [prefix or spoken[0]] if spoken else []
        known = [segments for segments in spoken if segments]
        entry = _join_compound(parts, known) if known and len(known) == len(parts) else None
    if entry is None and stem:
        base = look_up_word(stem, is_letter=False, own=own)
        return add_s(base) if base else None
    return entry or misaki_lookup(word) or read_parts(word, lambda part: _look_up_part(part, own))


def _look_up_part(part: str, own: Lookup) -> tuple[IpaPhone, ...] | None:
    if len(part) > 1 and is_initialism(part):
        return _spell_letters(part)
    return own(part) or _listed(part) or misaki_lookup(part)
