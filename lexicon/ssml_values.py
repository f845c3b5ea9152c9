"""Values of SSML's attributes: lengths of breaks, speeds, loudness; and checks that all elements share."""

import re
from collections.abc import Mapping
from types import MappingProxyType

from lexicon.errors import InputError

Attributes = Mapping[str, str]
LONGEST_ATTRIBUTE = 10_000  # characters: a text belongs between tags
_PERCENT = re.compile(r"([+-]?)([0-9]{1,6}(?:\.[0-9]{1,9})?)%")
_FACTOR = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,9})?")
_DECIBEL = re.compile(r"([+-]?[0-9]{1,6}(?:\.[0-9]{1,9})?)\s*dB", re.IGNORECASE)
# Strengths in seconds: from a pause of read speech at a comma (0.2-0.4 s) to one between paragraphs (1 s).
BREAKS_S = MappingProxyType({"none": 0.0, "x-weak": 0.1, "weak": 0.2, "medium": 0.4, "strong": 0.7, "x-strong": 1.0})
NAMED_RATES = MappingProxyType({"x-slow": 0.5, "slow": 0.75, "medium": 1.0, "default": 1.0, "fast": 1.3, "x-fast": 1.7})
NAMED_VOLUMES = MappingProxyType(
    {"silent": 0.0, "x-soft": 0.35, "soft": 0.6, "medium": 1.0, "default": 1.0, "loud": 1.4, "x-loud": 2.0}
)


def primary_of(tag: str) -> str:
    """Primary subtag of a language tag: de of de-CH."""
    return tag.strip().replace("_", "-").partition("-")[0].lower()


def check_lengths(element: str, attributes: Attributes) -> None:
    """Refuse attributes longer than `LONGEST_ATTRIBUTE`.

    Raises
    ------
    InputError
        One is; the message names it.
    """
    for name, value in attributes.items():
        if len(value) > LONGEST_ATTRIBUTE or len(name) > LONGEST_ATTRIBUTE:
            raise InputError(
                f"the attribute {name[:40]} of <{element}> has {len(value)} characters, and at most "
                f"{LONGEST_ATTRIBUTE} are read; put a text between tags"
            )


def only(element: str, attributes: Attributes, *known: str) -> Attributes:
    """The attributes, where all of them are known.

    Raises
    ------
    InputError
        One is not; the message names it.
    """
    for name in attributes:
        if name not in known:
            raise InputError(f"<{element}> has no attribute {name[:40]!r} here; choose {', '.join(known)}")
    return attributes


def choice(what: str, value: str, values: Mapping[str, float]) -> float:
    """The value of a word.

    Raises
    ------
    InputError
        There is no such word.
    """
    if value not in values:
        raise InputError(f"there is no {what} {value[:40]!r}; choose {', '.join(values)}")
    return values[value]


def speed(written: str) -> float:
    """A factor of speed: a word, a share (80%), a change (-20%), or a number."""
    value = written.strip()
    if match := _PERCENT.fullmatch(value):
        share = float(match[2]) / 100
        return {"": share, "+": 1 + share, "-": 1 - share}[match[1]]
    if _FACTOR.fullmatch(value):
        return float(value)
    return choice("rate", value, NAMED_RATES)


def loudness(written: str) -> float:
    """A factor of loudness: a word, or decibels (+6dB)."""
    if match := _DECIBEL.fullmatch(written.strip()):
        return float(10.0 ** (min(float(match[1]), 1e3) / 20))
    if written.strip() not in NAMED_VOLUMES:
        raise InputError(f"cannot read the volume {written[:40]!r}; write +6dB, or one of {', '.join(NAMED_VOLUMES)}")
    return NAMED_VOLUMES[written.strip()]
