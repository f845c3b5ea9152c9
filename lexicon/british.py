"""British English (southern, General British): phones of the dictionary of misaki, and /ɹ/ between words (far away).

Words that it lacks are those of American English in British phones; context decides as it does there, on readings of
one spelling, spelled letters and the forms of function words.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from lexicon.dictionary import Dictionary, word_key
from lexicon.english import is_initialism
from lexicon.function_words import is_function_word
from lexicon.homographs import is_homograph
from lexicon.ipa import IpaPhone
from lexicon.misaki import DEFAULT, has_dictionary, letter_segments, misaki_readings
from lexicon.phones import PHONES
from lexicon.word_parts import add_s

LANGUAGE = "en-gb"
Segments = tuple[IpaPhone, ...]
_ZED = "zˈɛd"  # the dictionary has the American name of the letter
BEFORE_PAUSE = "None"  # part of speech of misaki for function words there
# Letters of its alphabet, of which two-letter vowels are written as digits first, as phones of the table.
_PAIRS = (("ɛː", "1"), ("ɪə", "2"), ("iə", "2"), ("ʊə", "3"), ("ː", ""))
_PHONE_OF_LETTER = MappingProxyType({
    "1": "eə", "2": "ɪə", "3": "ʊə", "A": "eɪ", "I": "aɪ", "W": "aʊ", "Y": "ɔɪ", "Q": "əʊ", "O": "əʊ", "ʤ": "dʒ",
    "ʧ": "tʃ", "ᵊ": "ə", "ᵻ": "ɪ", "ɐ": "ə", "ə": "ə", "æ": "a", "a": "a", "ɑ": "ɑ", "ɒ": "ɒ", "ɔ": "ɔ", "ɜ": "ɜ",
    "ɛ": "ɛ", "e": "ɛ", "ɪ": "ɪ", "i": "i", "ʊ": "ʊ", "u": "u", "ʌ": "ʌ", "T": "t", "ɾ": "t", "ʔ": "t", "x": "k",
    "r": "ɹ", "ɹ": "ɹ", "ð": "ð", "θ": "θ", "ʃ": "ʃ", "ʒ": "ʒ", "ŋ": "ŋ", "j": "j", "ɡ": "ɡ", "h": "h", "b": "b",
    "d": "d", "f": "f", "k": "k", "l": "l", "m": "m", "n": "n", "p": "p", "s": "s", "t": "t", "v": "v", "w": "w",
    "z": "z",
})  # fmt: skip
# the same in both varieties, and decided by what follows
_SHARED_FORMS = frozenset({"a", "an", "am", "the", "thee", "to", "in"})
_PLAIN = MappingProxyType({"oʊ": "əʊ", "æ": "a", "ɝ": "ɜ", "ɚ": "ə"})
_BEFORE_R = MappingProxyType({
    "ɑ": "ɑ", "ɔ": "ɔ", "oʊ": "ɔ", "ɛ": "eə", "eɪ": "eə", "æ": "ɑ", "ɪ": "ɪə", "i": "ɪə", "ʊ": "ʊə", "u": "ʊə",
    "ʌ": "ɜ", "aɪ": "aɪ ə", "aʊ": "aʊ ə", "ɔɪ": "ɔɪ ə",
})  # fmt: skip
_LINKING = frozenset({"ɑ", "ɔ", "ɜ", "ə", "eə", "ɪə", "ʊə"})
_HAM = re.compile(r"^[A-Z].*[^aeiou]ham$")
_FINAL_R = re.compile(r"re?$")
_VOWEL_LETTERS = re.compile(r"[aeiouy]+w?")
_YOD_BEFORE = frozenset({"t", "d", "n"})
# stressed vowels in which the varieties differ, so that a homograph of both may be one reading
_ALIKE = (frozenset("aɑ"), frozenset("ɑɒɔ"), frozenset("ʊu"))


def has_british() -> bool:
    """Whether the dictionary is installed."""
    return has_dictionary("gb")


def british_segments(
    texts: Sequence[str], marks: Sequence[str], american: Sequence[Segments], own: Dictionary
) -> list[Segments]:
    """British phones of each word of a normalised text.

    Parameters
    ----------
    texts, marks
        Words, and the punctuation after each.
    american
        Their American phones in this context.
    own
        The user's entries, which take precedence.
    """
    found = []
    for at, (word, segments) in enumerate(zip(texts, american, strict=True)):
        is_last = bool(marks[at]) or at + 1 == len(texts)
        given = own.lookup(word)
        found.append(given if given is not None else _word(word, segments, is_last=is_last))
    for at, segments in enumerate(found[:-1]):
        following = found[at + 1]
        is_linked = not marks[at] and _FINAL_R.search(texts[at].lower()) and own.lookup(texts[at]) is None
        if is_linked and segments and following and segments[-1].phone in _LINKING and following[0].is_syllabic:
            found[at] = (*segments, IpaPhone("ɹ"))
    return found


def _word(word: str, american: Segments, *, is_last: bool) -> Segments:
    plain = in_british_phones(american, word)
    if len(word) > 1 and is_initialism(word):
        return _spelled(word) or plain
    readings = {tag: _segments(letters) for tag, letters in misaki_readings(word, "gb").items()}
    if is_homograph(word):
        same = [reading for reading in readings.values() if _is_same_reading(reading, plain)]
        return min(same, key=lambda reading: _other_stresses(reading, plain), default=plain)
    if word_key(word) in _SHARED_FORMS:
        return plain
    if is_function_word(word) and readings:
        return _stressed_as(readings[BEFORE_PAUSE if is_last and BEFORE_PAUSE in readings else DEFAULT], plain)
    return _with_weak_ham(readings.get(DEFAULT) or _of_parts(word) or plain, word)


def _with_weak_ham(segments: Segments, word: str) -> Segments:
    """Phones of a place in -ham, which the dictionary has in full for some of them: Balham, Birmingham."""
    if len(segments) < len("ham") or not _HAM.search(word):
        return segments
    *_, vowel, end = segments
    if (vowel.phone, end.phone) != ("a", "m") or vowel.stress == 1:
        return segments
    rest = segments[:-3] if segments[-3].phone == "h" else segments[:-2]
    return (*rest, IpaPhone("ə", is_syllabic=True), end)


def _of_parts(word: str) -> Segments | None:
    """Phones of a possessive, or of a word with hyphens, whose parts are in the dictionary."""
    if word[-2:] in {"'s", "'S"}:
        stem = _look_up(word[:-2])
        return add_s(stem) if stem else None
    parts = [_look_up(part) for part in word.split("-") if part]
    known = [part for part in parts if part]
    return tuple(segment for part in known for segment in part) if len(known) == len(parts) > 1 else None


def _look_up(word: str) -> Segments | None:
    readings = misaki_readings(word, "gb")
    return _segments(readings[DEFAULT]) if readings else None


def _segments(letters: str) -> Segments:
    for pair, letter in _PAIRS:
        letters = letters.replace(pair, letter)
    return letter_segments(letters, _PHONE_OF_LETTER)


def _spelled(word: str) -> Segments | None:
    """Names of letters, of which the last has the primary stress."""
    names = [_ZED if letter in "zZ" else misaki_readings(letter.upper(), "gb").get(DEFAULT) for letter in word]
    if not all(names):
        return None
    *others, last = [name or "" for name in names]
    return _segments("".join(name.replace("ˈ", "ˌ") for name in others) + last)


def _is_same_reading(british: Segments, plain: Segments) -> bool:
    """Whether a reading of the dictionary is a converted American one: vowels may differ as the varieties do."""
    vowels = [_vowels(word) for word in (british, plain)]
    return len(vowels[0]) == len(vowels[1]) and all(map(_is_alike, *vowels))


def _is_alike(a: IpaPhone, b: IpaPhone) -> bool:
    pair = {a.phone, b.phone}
    return len(pair) == 1 or any(pair <= alike for alike in _ALIKE) or not (a.stress or b.stress)


def _other_stresses(a: Segments, b: Segments) -> int:
    return sum((own.stress == 1) != (other.stress == 1) for own, other in zip(_vowels(a), _vowels(b), strict=True))


def _vowels(word: Segments) -> Segments:
    return tuple(segment for segment in word if segment.is_syllabic)


def _stressed_as(word: Segments, pattern: Segments) -> Segments:
    """A word with the stresses of another pronunciation of as many vowels."""
    if len(_vowels(word)) != len(_vowels(pattern)):
        return word
    stresses = iter([segment.stress for segment in _vowels(pattern)])
    return tuple(replace(segment, stress=next(stresses)) if segment.is_syllabic else segment for segment in word)


def in_british_phones(american: Segments, word: str) -> Segments:
    """British phones of an American pronunciation: without /ɹ/ before consonants, with the vowels of lot and goat.

    The spelling separates lot (o) from palm (a), and shows where /j/ is kept (tune, new).
    """
    return tuple(_converted(american, word))


def _converted(american: Segments, word: str) -> Iterator[IpaPhone]:
    spellings = _spellings_of_vowels(american, word)
    skipped = -1
    for at, segment in enumerate(american):
        if at == skipped:
            continue
        after = [other.phone for other in american[at + 1 : at + 3]]
        is_before_vowel = bool(after) and PHONES[after[0]].is_vowel
        if not segment.is_syllabic:
            yield segment
            continue
        if segment.phone == "u" and at and american[at - 1].phone in _YOD_BEFORE and _has_yod(spellings[at]):
            yield IpaPhone("j")
        if after[:1] == ["ɹ"] and segment.phone in _BEFORE_R and not (len(after) > 1 and PHONES[after[1]].is_vowel):
            skipped = at + 1
            first, *rest = _BEFORE_R[segment.phone].split()
            yield IpaPhone(first, segment.stress, is_syllabic=True)
            yield from (IpaPhone(phone, is_syllabic=True) for phone in rest)
            continue
        yield IpaPhone(_vowel(segment.phone, spellings[at]), segment.stress, is_syllabic=True)
        if segment.phone in {"ɝ", "ɚ"} and is_before_vowel:
            yield IpaPhone("ɹ")


def _vowel(phone: str, spelling: str) -> str:
    if phone == "ɑ" and spelling.startswith("o"):
        return "ɒ"
    return "ɒ" if phone == "ɔ" and spelling == "o" else _PLAIN.get(phone, phone)


def _has_yod(spelling: str) -> bool:
    return spelling.startswith("u") or spelling in {"ew", "eu"}


def _spellings_of_vowels(segments: Segments, word: str) -> Mapping[int, str]:
    """Vowel letters of each vowel, by its index: groups of letters in order, stretched where they are not as many."""
    groups = [group[0] for group in _VOWEL_LETTERS.finditer(word.lower())] or [""]
    vowels = [at for at, segment in enumerate(segments) if segment.is_syllabic]
    steps = max(len(vowels) - 1, 1)
    return {at: groups[round(number * (len(groups) - 1) / steps)] for number, at in enumerate(vowels)}
