"""Weights of shapes that correct combinations of others."""

import numpy as np
import pytest

from tts2face.face.combinations import combination_name, with_combinations
from tts2face.types import Trajectory

SMILE_OPEN = combination_name(["mouthSmileLeft", "jawOpen"])


def motion(**weights: float) -> Trajectory:
    names = [*weights, SMILE_OPEN]
    return Trajectory(tuple(names), np.array([[*weights.values(), 0.0]] * 2, np.float32), 30.0)


@pytest.mark.parametrize(
    ("jaw", "smile", "expected"), [(0.5, 0.4, 0.2), (1.0, 1.0, 1.0), (0.0, 0.9, 0.0), (1.4, 0.5, 0.5), (-0.2, 0.5, 0.0)]
)
def test_a_combination_has_the_product_of_its_parts(jaw: float, smile: float, expected: float) -> None:
    given = motion(jawOpen=jaw, mouthSmileLeft=smile)
    found = with_combinations(given)
    assert found.values[:, -1] == pytest.approx([expected] * 2)
    np.testing.assert_array_equal(found.values[:, :-1], given.values[:, :-1])


def test_without_its_parts_a_combination_stays_still() -> None:
    given = motion(jawOpen=0.5)
    assert with_combinations(given) is given


def test_names_do_not_depend_on_the_order_of_the_parts() -> None:
    assert combination_name(["jawOpen", "mouthSmileLeft"]) == SMILE_OPEN == "combination*jawOpen*mouthSmileLeft"
