"""Lines of the skin are softened; brows, lashes and the skin itself are not."""

import numpy as np
import pytest

from corpus_tools.dense.texels import Texels
from corpus_tools.dense.texture import soften_lines

SIDE = 160
SKIN = np.array([200.0, 150.0, 120.0])


@pytest.fixture(scope="module")
def texels() -> Texels:
    rows, columns = (one.ravel() for one in np.mgrid[:SIDE, :SIDE])
    return Texels(rows, columns, np.zeros((SIDE**2, 3), np.int64), np.zeros((SIDE**2, 3)))


def softened(texels: Texels, columns: slice, value: float, shown: slice = slice(None)) -> np.ndarray:
    """Skin with a dark stripe, softened in the columns that a picture shows."""
    share = np.zeros((SIDE, SIDE))
    share[:, shown] = 1.0
    picture = np.tile(SKIN, (SIDE, SIDE, 1))
    picture[:, columns] *= value
    found = soften_lines(picture.reshape(-1, 3), share.ravel(), texels, SIDE)
    return found.reshape(SIDE, SIDE, 3)


def test_a_wrinkle_becomes_fainter_and_skin_stays(texels: Texels) -> None:
    found = softened(texels, slice(78, 82), 0.85)
    assert 0.92 * SKIN[0] < found[80, 80, 0] < 0.97 * SKIN[0]
    np.testing.assert_allclose(found[80, 10], SKIN, atol=1.0)
    np.testing.assert_allclose(found[80, 80] / found[80, 80, 0], SKIN / SKIN[0], atol=1e-6)


@pytest.mark.parametrize(("columns", "value"), [(slice(60, 100), 0.35), (slice(79, 81), 0.25)])
def test_brows_and_lashes_stay(texels: Texels, columns: slice, value: float) -> None:
    found = softened(texels, columns, value)
    np.testing.assert_allclose(found[80, 80], value * SKIN, rtol=0.03)


def test_what_the_picture_does_not_show_stays(texels: Texels) -> None:
    np.testing.assert_allclose(softened(texels, slice(78, 82), 0.85, slice(90, None))[80, 80], 0.85 * SKIN)
