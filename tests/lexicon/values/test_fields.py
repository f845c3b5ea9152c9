"""Checks of the values of dataclasses by the types of their fields."""

import math
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.values.fields import check_fields


@dataclass(frozen=True)
class Options:
    """Fields of all types that options have."""

    text: str = ""
    count: int = 0
    factor: float = 1.0
    switch: bool = False
    file: Path | None = None

    def __post_init__(self) -> None:
        check_fields(self)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"text": 7}, "text must be a text in quotes, not 7"),
        ({"text": None}, "text must be a text in quotes, not null"),
        ({"count": 1.5}, r"count must be a whole number, not 1\.5"),
        ({"count": True}, "count must be a whole number, not true"),
        ({"count": 10**5000}, "count is too large a number; the maximum is 1.8e308"),
        ({"factor": "3"}, 'factor must be a number, not "3"'),
        ({"factor": math.inf}, "factor must be a number, not Infinity"),
        ({"switch": 1}, "switch must be true or false, not 1"),
        ({"file": 7}, "file must be a path, not 7"),
        ({"file": "a\0b"}, r"file is a path with the character U\+0000"),
        ({"text": [10**5000]}, "text must be a text in quotes, not a list"),
        ({"text": Fraction(1, 2)}, 'text must be a text in quotes, not "1/2"'),
    ],
)
def test_options_of_another_type_are_refused(given: dict[str, Any], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        Options(**given)


def test_options_of_python_users_are_taken() -> None:
    assert Options(file="a", text=Path("b")) == Options(file=Path("a"), text="b")  # type: ignore[arg-type]
    for number in (np.float32(0.5), Fraction(30_000, 1001), 2):
        assert Options(factor=number).factor == number  # type: ignore[arg-type]
    assert Options(count=np.int64(3)).count == 3  # type: ignore[arg-type]
