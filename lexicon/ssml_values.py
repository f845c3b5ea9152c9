"""Values of SSML attributes (break durations, rates, volumes), and checks common to all elements."""

import re
from collections.abc import Mapping
from types import MappingProxyType

from lexicon.errors import InputError

Attributes = Mapping[str, str]
MAX_ATTRIBUTE_CHARACTERS = 10_000  # longer text belongs between tags
_PERCENT = re.compile(r"([+-]?)([0-9]{1,6}(?:\.[0-9]{1,9})?)%")
_FACTOR = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,9})?")
_DECIBEL = re.compile(r"([+-]?[0-9]{1,6}(?:\.[0-9]{1,9})?)\s*dB", re.IGNORECASE)
# Seconds by strength: from pauses of read speech at commas (0.2-0.4 s) to those between paragraphs (1 s).
BREAKS_S = MappingProxyType({"none": 0.0, "x-weak": 0.1, "weak": 0.2, "medium": 0.4, "strong": 0.7, "x-strong": 1.0})
NAMED_RATES = MappingProxyType({"x-slow": 0.5, "slow": 0.75, "medium": 1.0, "default": 1.0, "fast": 1.3, "x-fast": 1.7})
NAMED_VOLUMES = MappingProxyType(
    {"silent": 0.0, "x-soft": 0.35, "soft": 0.6, "medium": 1.0, "default": 1.0, "loud": 1.4, "x-loud": 2.0}
)


def primary_subtag(tag: str) -> str:
    """Primary subtag of a language tag: de of de-CH."""
    return tag.strip().replace("_", "-").partition("-")[0].lower()


def check_lengths(element: str, attributes: Attributes) -> None:
    """Refuse attributes longer than `MAX_ATTRIBUTE_CHARACTERS`.

    Raises
    ------
    InputError
        An attribute is longer; the message names it.
    """
    for name, value in attributes.items():
        if len(value) > MAX_ATTRIBUTE_CHARACTERS or len(name) > MAX_ATTRIBUTE_CHARACTERS:
            raise InputError(
                f"the attribute {name[:40]} of <{element}> has {len(value)} characters, but the maximum is "
                f"{MAX_ATTRIBUTE_CHARACTERS}; put the text between tags"
            )


def check_attributes(element: str, attributes: Attributes, *known: str) -> Attributes:
    """The attributes, after a check that all of them are known.

    Raises
    ------
    InputError
        An attribute is unknown; the message names it.
    """
    for name in attributes:
        if name not in known:
            raise InputError(f"<{element}> does not support the attribute {name[:40]!r}; use {', '.join(known)}")
    return attributes


def look_up_value(what: str, value: str, values: Mapping[str, float]) -> float:
    """Value of a named setting.

    Raises
    ------
    InputError
        The name does not exist.
    """
    if value not in values:
        raise InputError(f"there is no {what} {value[:40]!r}; use {', '.join(values)}")
    return values[value]


def parse_rate(written: str) -> float:
    """Factor of the speaking rate from a name, a percentage (80%), a change (-20%), or a number."""
    value = written.strip()
    if match := _PERCENT.fullmatch(value):
        share = float(match[2]) / 100
        return {"": share, "+": 1 + share, "-": 1 - share}[match[1]]
    if _FACTOR.fullmatch(value):
        return float(value)
    return look_up_value("rate", value, NAMED_RATES)


def parse_volume(written: str) -> float:
    """Factor of the volume from a name or decibels (+6dB)."""
    if match := _DECIBEL.fullmatch(written.strip()):
        return float(10.0 ** (min(float(match[1]), 1e3) / 20))
    if written.strip() not in NAMED_VOLUMES:
        raise InputError(
            f"cannot read the volume {written[:40]!r}; use decibels such as +6dB, or one of {', '.join(NAMED_VOLUMES)}"
        )
    return NAMED_VOLUMES[written.strip()]
