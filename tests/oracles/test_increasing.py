"""The longest increasing part of a series, against all its parts."""

from itertools import combinations

import numpy as np
import pytest

from tts2face.numeric.arrays import longest_increasing


@pytest.mark.parametrize("seed", range(40))
def test_no_increasing_part_is_longer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 9, rng.integers(0, 9)).astype(np.float64)
    found = longest_increasing(values)
    assert (np.diff(values[found]) > 0).all()
    longest = max(
        n for n in range(len(values) + 1) if any((np.diff(part) > 0).all() for part in combinations(values, n))
    )
    assert found.sum() == longest
