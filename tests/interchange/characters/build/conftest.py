"""Characters are imported with few directions of light: no picture of them is judged."""

from collections.abc import Iterator
from functools import partial

import pytest

from tts2face.interchange.characters import importing
from tts2face.picture.occlusion import bake_occlusion

N_DIRECTIONS = 8


@pytest.fixture(scope="module", autouse=True)  # of a package it would last as long as the session
def few_directions() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importing, "bake_occlusion", partial(bake_occlusion, n_directions=N_DIRECTIONS))
        yield
