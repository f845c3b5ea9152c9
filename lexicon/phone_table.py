"""Schema of the phone table `phones.tsv`, one phone a line: its columns and their allowed values."""

from collections.abc import Collection
from dataclasses import dataclass
from types import MappingProxyType

from lexicon.errors import DataError

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
