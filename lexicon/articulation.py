"""Visible articulation of phones: targets of lips, jaw and tongue, from the features of the phone table."""

import functools
from dataclasses import dataclass, fields
from types import MappingProxyType

from lexicon.phones import HEIGHTS, PHONES, Phone, look_up_phone

# Rounding of rounded vowels: the closer the vowel, the smaller and further forward the mouth (Laver 1994, ch. 10).
_ROUNDING_OF_CLOSE_VOWEL, _ROUNDING_OF_OPEN_VOWEL = 1.0, 0.5
_PROTRUDED_VOWEL_ROUNDING = 0.3  # r-coloured vowels
# Spreading of unrounded front vowels; open ones are shaped by the jaw.
_SPREADING = MappingProxyType(
    {"close": 1.0, "near-close": 0.7, "close-mid": 0.6, "mid": 0.4, "open-mid": 0.2, "near-open": 0.1}
)
_ROUNDING_OF_PROTRUDED_APPROXIMANT = 0.7
_SPREADING_OF_SIBILANT = 0.45
_SPREADING_OF_PALATAL_APPROXIMANT = 0.7
_OPENING_FROM, _OPENING_OF_ROUNDED_VOWEL = 0.4, 0.5  # height above which a vowel is open; factor of rounded vowels
_TONGUE_TIP_PLACES = frozenset({"alveolar", "retroflex", "dental"})
_TONGUE_TIP_MANNERS = frozenset({"plosive", "implosive", "affricate", "nasal", "lateral", "tap", "trill", "click"})
_SIBILANT_PLACES = frozenset({"alveolar", "alveolo-palatal"})
_RAISED_BY_MANNER = MappingProxyType({"tap": 0.8, "trill": 0.8})


@dataclass(frozen=True, slots=True)
class VisibleTarget:
    """Visible target of a phone or of one half of it; each from 0 to 1, None where neighbouring phones determine it.

    Parameters
    ----------
    rounding
        Narrowing and protrusion of the lips.
    flare
        Outward turn of rounded lips, as in /ʃ/.
    spreading
        Widening of the mouth.
    opening
        Opening of an open vowel.
    lip_contact
        Contact of both lips.
    incisor_contact
        Contact of the lower lip with the upper incisors.
    tongue_out, tongue_up
        Tip of the tongue between the teeth, and at the ridge behind the upper ones.
    """

    rounding: float | None = None
    flare: float | None = None
    spreading: float | None = None
    opening: float | None = None
    lip_contact: float = 0.0
    incisor_contact: float = 0.0
    tongue_out: float = 0.0
    tongue_up: float = 0.0


TARGET_NAMES = tuple(field.name for field in fields(VisibleTarget))


@functools.cache
def visible_targets(label: str) -> tuple[VisibleTarget, VisibleTarget]:
    """Targets of a phone's first and last half; they differ for diphthongs.

    Raises
    ------
    InputError
        The label is not in the phone table.
    """
    phone = look_up_phone(label)
    if phone.kind == "diphthong":
        return _vowel_target(PHONES[phone.parts[0]]), _vowel_target(PHONES[phone.parts[-1]])
    if phone.kind == "silence":
        target = VisibleTarget(0.0, 0.0, 0.0, 0.0)
    elif phone.is_vowel:
        target = _vowel_target(phone)
    else:
        target = _consonant_target(phone)
    return target, target


def _vowel_target(phone: Phone) -> VisibleTarget:
    height = HEIGHTS[phone.height]
    opening = max(0.0, height - _OPENING_FROM) / (1.0 - _OPENING_FROM)
    if phone.rounding == "rounded":
        rounding = _ROUNDING_OF_CLOSE_VOWEL + height * (_ROUNDING_OF_OPEN_VOWEL - _ROUNDING_OF_CLOSE_VOWEL)
        return VisibleTarget(rounding, height, 0.0, _OPENING_OF_ROUNDED_VOWEL * opening)
    if phone.rounding == "protruded":
        return VisibleTarget(_PROTRUDED_VOWEL_ROUNDING, 0.5, 0.0, 0.0)
    is_front = phone.backness in {"front", "near-front"}
    spreading = _SPREADING.get(phone.height, 0.0) if is_front else 0.0
    return VisibleTarget(0.0, 0.0, spreading, 0.0 if phone.height == "mid" else opening)


def _consonant_target(phone: Phone) -> VisibleTarget:
    # closed lips hide the tongue
    if phone.place == "bilabial":
        return VisibleTarget(opening=0.0, lip_contact=1.0)
    out, up = _tongue_tip(phone)
    rounding, spreading = _consonant_lips(phone)
    is_free = rounding is None  # the lips are those of the neighbouring phones
    return VisibleTarget(
        rounding=rounding,
        flare=None if is_free else float(phone.rounding == "protruded"),
        spreading=spreading,
        opening=None if is_free else 0.0,
        # the lower lip touches the teeth in /f v/, but not in the approximant ʋ
        incisor_contact=float(phone.place == "labiodental" and phone.manner != "approximant"),
        tongue_out=out,
        tongue_up=up,
    )


def _consonant_lips(phone: Phone) -> tuple[float | None, float | None]:
    """Rounding and spreading of a consonant's own lip shape; None without one."""
    if phone.rounding:
        is_full = phone.rounding == "rounded" or phone.manner in {"sibilant", "affricate"}
        return (1.0 if is_full else _ROUNDING_OF_PROTRUDED_APPROXIMANT), 0.0
    if phone.manner == "sibilant" or (phone.manner == "affricate" and phone.place in _SIBILANT_PLACES):
        return 0.0, _SPREADING_OF_SIBILANT
    if phone.place == "palatal" and phone.manner == "approximant":
        return 0.0, _SPREADING_OF_PALATAL_APPROXIMANT
    return (0.0, 0.0) if phone.place == "labiodental" else (None, None)


def _tongue_tip(phone: Phone) -> tuple[float, float]:
    """Weights of the tip between the teeth and of the raised tip."""
    if phone.place == "dental" and phone.manner == "fricative":
        return 1.0, 0.0
    if phone.place in _TONGUE_TIP_PLACES and phone.manner in _TONGUE_TIP_MANNERS:
        return 0.0, _RAISED_BY_MANNER.get(phone.manner, 1.0)
    return 0.0, 0.0
