"""The drawn characters are told apart by their outlines alone, and as small pictures."""

from itertools import combinations

import numpy as np
import pytest

from tests.face.people import DRAWN
from tts2face.models.face_loading import load_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw

MOST_SHARED = 0.87  # of the pixels that either outline covers
LEAST_APART = 25.0  # of 255, mean over a picture of 64 px


@pytest.mark.build
def test_each_has_an_outline_and_colours_of_its_own() -> None:
    pictures = {}
    for name in DRAWN:
        face = load_face(name)
        still = np.zeros(len(face.shape_names), np.float32)
        pictures[name] = draw(face, still, picture=Picture(size="64x64", background="transparent")).astype(int)
    for one, other in combinations(DRAWN, 2):
        covered = [pictures[name][:, :, 3] > 127 for name in (one, other)]
        shared = np.logical_and(*covered).sum() / np.logical_or(*covered).sum()
        assert shared <= MOST_SHARED, (one, other)
        assert np.abs(pictures[one] - pictures[other])[:, :, :3].mean() >= LEAST_APART, (one, other)
