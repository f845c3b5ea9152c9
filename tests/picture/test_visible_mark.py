"""A visible mark changes the lower right corner of clips, and nothing else."""

import numpy as np
import pytest

from tts2face.picture.options import Picture
from tts2face.session.session import Session


@pytest.mark.parametrize("background", ["studio", "transparent"])
def test_the_corner_of_every_picture_says_that_it_is_synthetic(background: str) -> None:
    session = Session(face="head")
    clip = session.clip("Hello.", fps=5, gestures="none")
    size = {"size": "160x120", "background": background}
    plain = np.array(list(session.renderer(Picture(**size)).frames(clip)))
    renderer = session.renderer(Picture(**size, visible_mark=True))
    marked = np.array(list(renderer.frames(clip)))
    assert renderer.picture.visible_mark
    changed = (plain != marked).any(axis=3)
    rows, columns = np.flatnonzero(changed.any(axis=(0, 2))), np.flatnonzero(changed.any(axis=(0, 1)))
    assert rows.min() > 95
    assert columns.min() > 75
    assert changed.all(axis=0).sum() > 200  # in every picture
    assert marked[..., -30:, -75:, :3].max() > 180
    np.testing.assert_array_equal(renderer.frame(clip, 1), marked[1])
