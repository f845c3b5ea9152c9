"""Words of other languages in English text, as English speakers read them: Acuña, Wrocław, Citroën, Ronaldinho.

The letters tell the language (``foreign_spellings.tsv``): by accents, and by endings of names for which CMUdict, as far
as it has such names, is nearer to this reading than to the English one. Most languages are read by espeak-ng, and their
phones replaced by English ones; the others letter by letter, with vowels as in Italian and the stress on the last
syllable but one.
"""

import functools
import re
import unicodedata
from collections.abc import Sequence
from types import MappingProxyType

from lexicon.g2p import segments_by_rules
from lexicon.ipa import IpaPhone
from lexicon.phones import ARPABET, PHONES, nearest_phones
from lexicon.pinyin import read_pinyin
from lexicon.written_forms import read_table

BY_LETTERS = "letters"  # in place of a language
PENULTIMATE = frozenset({"hr", "cs"})  # languages whose names English speakers stress on the last syllable but one
_INVENTORY = frozenset(ARPABET.values())
# Phones of other languages in English mouths, where the nearest of the table is another.
_ENGLISH = MappingProxyType({
    "r": "ɹ", "ɾ": "ɹ", "ʁ": "ɹ", "ʀ": "ɹ", "r̝": "ʒ", "β": "b", "ɣ": "ɡ", "x": "h", "χ": "h", "ç": "k", "ɲ": "n j",
    "ʎ": "l j", "ʝ": "j", "ɟ": "dʒ", "c": "tʃ", "ts": "t s", "dz": "d z", "tɕ": "tʃ", "dʑ": "dʒ", "ɕ": "ʃ", "ʂ": "ʃ",
    "ʑ": "ʒ", "ʐ": "ʒ", "ʈʂ": "tʃ", "ɖʐ": "dʒ", "pf": "f", "ɫ": "l", "ʋ": "v", "q": "k", "ɥ": "w", "ɦ": "h", "ɸ": "f",
    "ɧ": "ʃ", "ʔ": "", "ð": "d", "y": "u", "ʏ": "u", "ʉ": "u", "ø": "ɝ", "œ": "ɝ", "ɵ": "ɝ", "ɜ": "ɝ", "ɨ": "ɪ",
    "ɯ": "ɪ", "ɐ": "ə", "ɤ": "ə", "ɒ": "ɑ", "ɑ̃": "ɑ n", "ã": "ɑ n", "ɐ̃": "ɑ n", "ɛ̃": "æ n", "æ̃": "æ n", "ẽ": "eɪ n",
    "ĩ": "i n", "ɔ̃": "oʊ n", "õ": "oʊ n", "œ̃": "ʌ n", "ũ": "u n", "ai": "aɪ", "au": "aʊ", "ei": "eɪ", "ɛɪ": "eɪ",
    "ɛi": "eɪ", "ɔø": "ɔɪ", "ɔʏ": "ɔɪ", "œy": "ɔɪ", "oi": "ɔɪ", "oɪ": "ɔɪ", "ɔi": "ɔɪ", "ou": "oʊ", "ʌʊ": "oʊ",
    "ɐ̃ʊ̃": "aʊ", "ie": "i ɛ", "iɛ": "i ɛ", "ia": "i a", "uɔ": "w ɔ", "uo": "w o", "ua": "w a", "æi": "aɪ",
})  # fmt: skip
# Vowels in a stressed open syllable, a stressed or last closed one, at the end of the word, and elsewhere.
_VOWELS = MappingProxyType({
    "a": ("ɑ", "ɑ", "ə", "ə"), "ɑ": ("ɑ", "ɑ", "ə", "ə"), "e": ("eɪ", "ɛ", "eɪ", "ɛ"), "ɛ": ("ɛ", "ɛ", "eɪ", "ɛ"),
    "i": ("i", "i", "i", "i"), "o": ("oʊ", "oʊ", "oʊ", "oʊ"), "ɔ": ("ɔ", "ɔ", "oʊ", "ɔ"), "u": ("u", "u", "u", "u"),
})  # fmt: skip
_OPEN, _CLOSED, _LAST, _WEAK = range(4)
_BEFORE_R = MappingProxyType({"ɛ": "ɝ", "eɪ": "ɝ", "ə": "ɑ", "u": "ʊ", "oʊ": "ɔ"})  # before /ɹ/ that ends a syllable
_GRAPHEMES = MappingProxyType({
    "tsch": "tʃ", "tch": "tʃ", "sch": "ʃ", "cch": "k", "dzh": "dʒ", "ch": "tʃ", "sh": "ʃ", "zh": "ʒ", "th": "θ",
    "ph": "f", "kh": "k", "gh": "ɡ", "bh": "b", "dh": "d", "ck": "k", "qu": "k w", "tz": "t s", "dj": "dʒ",
    "nh": "n j", "ñ": "n j", "zz": "t s", "nk": "ŋ k", "ng": "ŋ ɡ", "ŋ": "ŋ", "b": "b", "c": "k", "d": "d", "f": "f",
    "g": "ɡ", "h": "h", "j": "dʒ", "k": "k", "l": "l", "m": "m", "n": "n", "p": "p", "q": "k", "r": "ɹ", "s": "s",
    "t": "t", "v": "v", "w": "w", "x": "k s", "y": "j", "z": "z", "ai": "aɪ", "ay": "aɪ", "ei": "eɪ", "ey": "eɪ",
    "au": "aʊ", "ao": "aʊ", "oi": "ɔɪ", "oy": "ɔɪ", "oo": "u", "ee": "i", "ou": "u", "aa": "ɑ", "ii": "i", "uu": "u",
    "a": "a", "e": "e", "i": "i", "o": "o", "u": "u",
})  # fmt: skip
_GRAPHEME = re.compile("|".join(sorted(_GRAPHEMES, key=len, reverse=True)))
# Steps before the letters are read: gue and que, soft c, silent h, the x of names, yes and my, final ng.
_STEPS = (
    (re.compile(r"gu(?=[ei])"), "g"), (re.compile(r"qu(?=[ei])"), "k"),
    (re.compile(r"^hu(?=a)"), "w"),
    (re.compile(r"c(?=[eiy])"), "s"), (re.compile(r"h$|(?<=[aeiou])h(?![aeiou])"), ""), (re.compile(r"^x"), "z"),
    (re.compile(r"(?<=i)y(?=[aeiou])"), ""), (re.compile(r"y(?![aeiou])"), "i"), (re.compile(r"ng$"), "ŋ"),
)  # fmt: skip


@functools.cache
def _patterns() -> tuple[tuple[re.Pattern[str], str], ...]:
    """Patterns of spellings, and the language in which they are read; the first that fits counts."""
    rows = read_table("foreign_spellings.tsv").items()
    return tuple((re.compile(pattern), language) for pattern, (language, _) in rows)


def spelling_language(word: str) -> str:
    """Code of the language of which a word has the letters, or `BY_LETTERS`; empty if they tell none."""
    written = unicodedata.normalize("NFC", word.lower())
    return next((language for pattern, language in _patterns() if pattern.search(written)), "")


def read_foreign_spelling(word: str) -> tuple[IpaPhone, ...]:
    """English phones of a word with the spelling of another language; none if its letters do not tell one."""
    chinese = read_pinyin(word)
    language = "" if chinese else spelling_language(word)
    if not language:
        return chinese
    if language == BY_LETTERS:
        return english_phones(_letter_phones(word))
    (said,) = segments_by_rules([word], language)
    pairs = [(segment.phone, segment.stress) for segment in said]
    has_stress = any(stress == 1 for _, stress in pairs) and language not in PENULTIMATE
    return english_phones(pairs if has_stress else _stressed([phone for phone, _ in pairs]))


def _letter_phones(word: str) -> list[tuple[str, int]]:
    plain = unicodedata.normalize("NFC", word.lower())
    plain = plain.replace("gü", "gw")
    plain = "".join(c if c == "ñ" else unicodedata.normalize("NFD", c)[0] for c in plain)
    for pattern, replacement in _STEPS:
        plain = pattern.sub(replacement, plain)
    phones: list[str] = []
    for part in _GRAPHEME.findall(plain):
        phones += _GRAPHEMES[part].split()
    return _stressed(phones)


def _stressed(phones: Sequence[str]) -> list[tuple[str, int]]:
    """Phones with the stress on the last vowel but one."""
    vowels = [at for at, phone in enumerate(phones) if PHONES[phone].is_vowel]
    main = vowels[max(len(vowels) - 2, 0)] if vowels else -1
    return [(phone, int(at == main)) for at, phone in enumerate(phones)]


def english_phones(pairs: Sequence[tuple[str, int]]) -> tuple[IpaPhone, ...]:
    """English phones of a foreign word.

    Parameters
    ----------
    pairs
        Phones of the table and their stress.
    """
    phones, doubled, stresses = _in_english(pairs)
    is_vowel = [PHONES[phone].is_vowel for phone in phones]
    vowels = [at for at, vowel in enumerate(is_vowel) if vowel]
    main = next((at for at in vowels if stresses[at] == 1), vowels[0] if vowels else 0)
    found: list[IpaPhone] = []
    for at, phone in enumerate(phones):
        if not is_vowel[at]:
            is_said = phone == "ɹ" and found and found[-1].phone in {"ɝ", "ɚ"}
            is_lost = phone == "j" and not any(is_vowel[at + 1 : at + 2])  # gn and ñ before a consonant
            found += [] if is_said or is_lost else [IpaPhone(own) for own in nearest_phones(phone, _INVENTORY)]
            continue
        n_before = vowels.index(main) - vowels.index(at)
        stress = 1 if at == main else 2 if n_before > 0 and n_before % 2 == 0 else 0
        found.append(_english_vowel(phones, is_vowel, at, doubled, stress))
    return tuple(found)


def _in_english(pairs: Sequence[tuple[str, int]]) -> tuple[list[str], set[int], list[int]]:
    """Phones of which equal neighbours are one, the indices of these, and the stress of each."""
    phones: list[str] = []
    stresses: list[int] = []
    doubled: set[int] = set()
    for phone, stress in pairs:
        for number, part in enumerate(_ENGLISH.get(phone, phone).split()):
            if phones and phones[-1] == part:
                doubled.add(len(phones) - 1)
                continue
            phones.append(part)
            stresses.append(stress if number == 0 else 0)
    return phones, doubled, stresses


def _english_vowel(
    phones: Sequence[str], is_vowel: Sequence[bool], at: int, doubled: set[int], stress: int
) -> IpaPhone:
    after = is_vowel[at + 1 : at + 3]
    is_closed = after in ([False], [False, False]) or at + 1 in doubled
    is_last = not any(is_vowel[at + 1 :])
    place = _LAST if at + 1 == len(phones) else _WEAK if not stress and not (is_last and is_closed) else _OPEN
    place = _CLOSED if is_closed and place == _OPEN else place
    own = _VOWELS[phones[at]][place] if phones[at] in _VOWELS else phones[at]
    if phones[at + 1 : at + 2] == ["ɹ"] and is_closed:
        own = _BEFORE_R.get(own, own)
    if own == "ɝ" and not stress:
        own = "ɚ"
    return IpaPhone(own if own in _INVENTORY else nearest_phones(own, _INVENTORY)[0], stress, is_syllabic=True)
