"""The phones: articulatory features and ARPABET names, from the table `phones.tsv`, and their articulatory distance."""

import functools
import math
import operator
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from importlib import resources
from types import MappingProxyType

from lexicon.errors import DataError, InputError

KINDS = (
    "silence", "vowel", "diphthong", "stop", "affricate", "fricative", "nasal", "approximant", "lateral", "tap",
    "trill", "click",
)  # fmt: skip
PLACES = MappingProxyType({
    "bilabial": 0.0, "labiodental": 0.0, "dental": 0.1, "alveolar": 0.2, "postalveolar": 0.35, "retroflex": 0.3,
    "alveolo-palatal": 0.4, "palatal": 0.5, "labial-palatal": 0.5, "velar": 0.75, "labial-velar": 0.75, "uvular": 0.85,
    "pharyngeal": 0.95, "glottal": 1.0,
})  # fmt: skip  # position of the constriction from lips (0) to glottis (1); the lips have separate features
MANNERS = (
    "plosive", "implosive", "affricate", "fricative", "sibilant", "nasal", "approximant", "lateral", "tap", "trill",
    "click",
)  # fmt: skip
HEIGHTS = MappingProxyType({
    "close": 0.0, "near-close": 1 / 6, "close-mid": 2 / 6, "mid": 3 / 6, "open-mid": 4 / 6, "near-open": 5 / 6,
    "open": 1.0,
})  # fmt: skip
BACKNESSES = MappingProxyType({"front": 0.0, "near-front": 0.25, "central": 0.5, "near-back": 0.75, "back": 1.0})
ROUNDINGS = MappingProxyType({"unrounded": 0.0, "": 0.0, "protruded": 0.5, "rounded": 1.0})
VOICINGS = ("voiced", "voiceless")
# Weight of each feature in `phone_distance`. Lips and jaw have the largest weights: the distance is for faces, where
# visible features matter more than audible ones (order of Fisher 1968's viseme classes: lips, rounding, opening, teeth,
# rest).
ARTICULATORY_WEIGHTS = MappingProxyType({
    "silence": 10.0,  # no phone is similar to a pause
    "vowel": 2.0,  # vowels replace vowels, consonants consonants
    "labial": 2.5,  # articulated with the lips
    "bilabial": 2.0,  # lip against lip
    "labiodental": 2.0,  # lower lip against teeth
    "rounding": 1.5,
    "opening": 1.2,  # jaw and lips: 0 closed, 1 as in /a/
    "dental": 0.6,  # tongue between the teeth
    "sibilance": 0.5,  # teeth together
    "lateral": 0.3,
    "tongue": 0.8,  # from front to back
    "closure": 0.3,  # complete closure of the oral tract
    "nasality": 0.2,
    "trill": 0.1,
    "voicing": 0.1,
    "click": 0.1,
})  # fmt: skip
_LABIALITY = MappingProxyType({"bilabial": 1.0, "labiodental": 1.0, "labial-velar": 0.5, "labial-palatal": 0.5})
_OPENING_OF_CLOSE_VOWEL = 0.3  # of the way from closed lips to /a/
_OPENINGS = MappingProxyType({
    "plosive": 0.05, "implosive": 0.05, "affricate": 0.05, "nasal": 0.05, "click": 0.05, "sibilant": 0.05,
    "fricative": 0.15, "tap": 0.1, "trill": 0.1, "lateral": 0.2, "approximant": 0.25,
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Phone:
    """One line of the phone table; a field that does not apply is empty.

    Parameters
    ----------
    symbol
        IPA, NFC: the label inside tts2face.
    arpabet
        ARPABET name without stress digit; ``AH0`` and ``ER0`` name the reduced vowels.
    kind, place, manner, voicing, height, backness, rounding, nasality
        Phonetic features; `rounding` of a consonant describes its own lip shape.
    parts
        Of a diphthong its two vowels, of an affricate its stop and its fricative.
    aliases
        Other spellings of the symbol.
    example
        A word with this phone.
    """

    symbol: str
    arpabet: str
    kind: str
    place: str
    manner: str
    voicing: str
    height: str
    backness: str
    rounding: str
    nasality: str
    parts: tuple[str, ...]
    aliases: tuple[str, ...]
    example: str

    @property
    def is_vowel(self) -> bool:
        """Whether the phone is a vowel or diphthong, the nucleus of a syllable."""
        return self.kind in {"vowel", "diphthong"}

    @property
    def is_voiced(self) -> bool:
        """Whether the vocal folds vibrate."""
        return self.voicing == "voiced"


def _parse_row(line: str, where: str) -> Phone:
    cells = line.split("\t")
    if len(cells) != 13:
        raise DataError(f"{where}: {len(cells)} cells instead of 13; separate the cells by tabs")
    symbol, arpabet, kind, place, manner, voicing, height, backness, rounding, nasality, parts, aliases, example = cells
    phone = Phone(
        symbol=symbol,
        arpabet=arpabet,
        kind=kind,
        place=place,
        manner=manner,
        voicing=voicing,
        height=height,
        backness=backness,
        rounding=rounding,
        nasality=nasality,
        parts=tuple(parts.split()),
        aliases=tuple(aliases.split()),
        example=example,
    )
    allowed: tuple[tuple[str, Collection[str]], ...] = (
        (phone.kind, KINDS),
        (phone.place, (*PLACES, "")),
        (phone.manner, (*MANNERS, "")),
        (phone.voicing, VOICINGS),
        (phone.height, (*HEIGHTS, "")),
        (phone.backness, (*BACKNESSES, "")),
        (phone.rounding, ROUNDINGS),
        (phone.nasality, ("", "nasal")),
    )
    for value, words in allowed:
        if value not in words:
            raise DataError(
                f"{where}: {phone.symbol} has the value {value!r}; use one of {', '.join(filter(None, words))}"
            )
    return phone


def read_phones(text: str) -> dict[str, Phone]:
    """Phones by symbol, from the text of `phones.tsv`."""
    phones: dict[str, Phone] = {}
    for number, line in enumerate(text.splitlines()[1:], start=2):
        phone = _parse_row(line, f"phones.tsv, line {number}")
        if phone.symbol in phones:
            raise DataError(f"phones.tsv, line {number}: {phone.symbol} occurs twice; remove one line")
        phones[phone.symbol] = phone
    for phone in phones.values():
        for part in phone.parts:
            if part not in phones:
                raise DataError(f"phones.tsv: {phone.symbol} has the part {part}, which has no line of its own; add it")
    return phones


PHONES: Mapping[str, Phone] = MappingProxyType(
    read_phones(resources.files("lexicon").joinpath("phones.tsv").read_text(encoding="utf-8"))
)
SILENCE = next(symbol for symbol, phone in PHONES.items() if phone.kind == "silence")  # as in lexicon.sequence
ARPABET: Mapping[str, str] = MappingProxyType({p.arpabet: p.symbol for p in PHONES.values() if p.arpabet})


def look_up_phone(label: str) -> Phone:
    """Row of the phone table for a label.

    Raises
    ------
    InputError
        The label is not in the table.
    """
    try:
        return PHONES[label]
    except KeyError as missing:
        hint = f"; did you mean {ARPABET[label]}, its IPA symbol?" if label in ARPABET else ""
        raise InputError(f"{label!r} is not a phone of the table lexicon/phones.tsv{hint}") from missing


def arpabet_to_ipa(name: str) -> str:
    """IPA symbol of an ARPABET name, with or without stress digit: AH1 and AH are ʌ, AH0 is ə.

    Raises
    ------
    InputError
        There is no such name.
    """
    if name in ARPABET:
        return ARPABET[name]
    base = name[:-1] if name[-1:] in {"0", "1", "2"} else name
    if base not in ARPABET or (base != name and not PHONES[ARPABET[base]].is_vowel):
        raise InputError(
            f"{name!r} is not an ARPABET name; use one of {' '.join(ARPABET)}, vowels with a stress 0, 1 or 2"
        )
    return ARPABET[base]


def ipa_to_arpabet(label: str, stress: int | None = None) -> str:
    """ARPABET name of an English phone; a vowel carries its stress digit when `stress` is given."""
    phone = look_up_phone(label)
    if not phone.arpabet:
        raise InputError(f"ARPABET has no name for {label}; it covers English phones only")
    if stress not in {None, 0, 1, 2}:
        raise InputError(f"stress must be 0, 1 or 2, not {stress}")
    name = phone.arpabet.removesuffix("0")
    if stress is None or not phone.is_vowel:
        return phone.arpabet
    return f"{name}{stress}"


def _articulatory_features(phone: Phone) -> dict[str, float]:
    is_nasal = phone.kind == "nasal" or phone.nasality == "nasal"
    tongue = PLACES.get(phone.place, 0.0)
    opening = _OPENINGS.get(phone.manner, 0.0)
    if phone.kind == "vowel":
        # vowels lie between the palate (.5) and the uvula (.85) of `PLACES`
        tongue = 0.5 + 0.35 * BACKNESSES[phone.backness]
        opening = _OPENING_OF_CLOSE_VOWEL + (1 - _OPENING_OF_CLOSE_VOWEL) * HEIGHTS[phone.height]
    return {
        "silence": float(phone.kind == "silence"),
        "vowel": float(phone.kind == "vowel"),
        "labial": _LABIALITY.get(phone.place, 0.0),
        "bilabial": float(phone.place == "bilabial"),
        "labiodental": float(phone.place == "labiodental"),
        "rounding": ROUNDINGS[phone.rounding],
        "opening": opening,
        "dental": float(phone.place == "dental"),
        "sibilance": float(phone.manner == "sibilant"),
        "lateral": float(phone.manner == "lateral"),
        "tongue": tongue,
        "closure": float(phone.manner in {"plosive", "implosive", "nasal", "click"}),
        "nasality": float(is_nasal),
        "trill": float(phone.manner in {"tap", "trill"}),
        "voicing": float(phone.is_voiced),
        "click": float(phone.manner in {"click", "implosive"}),
    }


@functools.cache
def phone_features(label: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Articulatory features, named by `ARTICULATORY_WEIGHTS`, of a phone's first and last half.

    Both halves of a simple phone are equal.

    Raises
    ------
    InputError
        The label is not in the table.
    """
    phone = look_up_phone(label)
    parts = phone.parts or (label,)
    first, last = (_articulatory_features(PHONES[part]) for part in (parts[0], parts[-1]))
    return tuple(first[name] for name in ARTICULATORY_WEIGHTS), tuple(last[name] for name in ARTICULATORY_WEIGHTS)


@functools.cache
def _weighted_halves(label: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Weighted features of a phone's first and last half."""
    first, last = (tuple(map(operator.mul, half, ARTICULATORY_WEIGHTS.values())) for half in phone_features(label))
    return first, last


def phone_distance(a: str, b: str) -> float:
    """Articulatory distance of two phones, weighted by visibility; 0 for equal features.

    Raises
    ------
    InputError
        A label is not in the table.

    Notes
    -----
    Euclidean over the features times `ARTICULATORY_WEIGHTS`, averaged over first and last half (a
    diphthong's vowels, an affricate's stop and fricative), hence symmetric and within the triangle inequality.
    """
    (first_a, last_a), (first_b, last_b) = _weighted_halves(a), _weighted_halves(b)
    return math.sqrt((math.dist(first_a, first_b) ** 2 + math.dist(last_a, last_b) ** 2) / 2)


def _nearest_phone(label: str, available: Collection[str]) -> str:
    # sorted: of equally near phones always the same one, whatever the order of a set
    return min(sorted(available), key=lambda other: phone_distance(label, other))


def nearest_phones(label: str, available: Collection[str]) -> tuple[str, ...]:
    """Available phones that replace a phone: itself, the nearest one, or those nearest to its parts in order.

    The parts of a diphthong or affricate are used if they are closer than any available phone.

    Raises
    ------
    InputError
        A label is not in the table, or nothing is available.
    """
    phone = look_up_phone(label)
    if label in available:
        return (label,)
    candidates = {look_up_phone(other).symbol for other in available} - {SILENCE}
    if not candidates:
        raise InputError(f"no phone can replace {label}: no phone is available; add at least one sounding phone")
    whole = _nearest_phone(label, candidates)
    if not phone.parts:
        return (whole,)
    # a part of a diphthong is replaced by a single phone, if there is one
    simple = {other for other in candidates if not PHONES[other].parts} or candidates
    parts = tuple(_nearest_phone(part, simple) for part in phone.parts)
    apart = math.hypot(*(phone_distance(part, own) for part, own in zip(parts, phone.parts, strict=True))) / math.sqrt(
        2
    )
    return parts if apart < phone_distance(label, whole) and len(set(parts)) > 1 else (whole,)


def vowel_symbols() -> tuple[str, ...]:
    """Symbols of all vowels and diphthongs, in the table's order."""
    return tuple(symbol for symbol, phone in PHONES.items() if phone.is_vowel)
