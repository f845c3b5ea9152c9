"""Checks of numbers against their limits."""

import pytest

from lexicon.errors import InputError
from lexicon.values.checks import check_limits


@pytest.mark.parametrize(("value", "shown"), [(10**400, "a number of more than 60 digits"), (10**20, "1" + "0" * 20)])
def test_a_number_of_any_size_outside_its_limits_is_named(value: int, shown: str) -> None:
    with pytest.raises(InputError, match=f"x must lie between 0 and 1 s, not {shown} s"):
        check_limits("x", value, (0, 1), " s")
