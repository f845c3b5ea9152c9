"""Colours of hair and eyes that have a name."""

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError

HAIR_COLOURS: Mapping[str, str] = {
    "black": "14100e", "dark-brown": "2e1d14", "brown": "5c402e", "light-brown": "926f50", "auburn": "74341f",
    "red": "a84a20", "dark-blond": "b2926b", "blond": "d2bfa0", "grey": "a8a29d", "white": "d6d0ca",
}  # fmt: skip  # sRGB, as hair is seen
EYE_COLOURS: Mapping[str, str] = {
    "dark-brown": "3a281f", "brown": "58402f", "hazel": "6a5a3e", "green": "67705a", "grey": "6d7274", "blue": "60788c",
}  # fmt: skip


def parse_hair_colour(colour: str) -> NDArray[np.float64]:
    """Hair colour (3,), sRGB in [0, 1], of a name of `HAIR_COLOURS` or #rrggbb.

    Raises
    ------
    InputError
        There is no such colour.
    """
    return _parsed(colour, "hair", HAIR_COLOURS)


def parse_eye_colour(colour: str) -> NDArray[np.float64]:
    """Colour (3,) of an iris, as `parse_hair_colour` of `EYE_COLOURS`."""
    return _parsed(colour, "eye", EYE_COLOURS)


def _parsed(colour: str, kind: str, names: Mapping[str, str]) -> NDArray[np.float64]:
    digits = names.get(colour, colour.removeprefix("#"))
    if not re.fullmatch(r"[0-9a-fA-F]{6}", digits):
        raise InputError(f"there is no {kind} colour {colour!r}; give #rrggbb or one of {', '.join(names)}")
    return np.array([int(digits[at : at + 2], 16) for at in (0, 2, 4)]) / 255.0
