"""Cheaper shadows for tests of pictures that judge no light."""

from collections.abc import Iterator

import pytest

from tts2face.picture import occlusion

N_DIRECTIONS = 16


@pytest.fixture(scope="module")
def few_directions() -> Iterator[None]:
    """Faces without an occlusion of their own have shadows from 16 directions instead of 128."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(occlusion, "N_DIRECTIONS", N_DIRECTIONS)
        yield
