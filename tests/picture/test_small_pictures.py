"""Small pictures of heads with lamps are the means of large ones, but for the edges that their few samples miss."""

import numpy as np
import pytest
from PIL import Image

from tts2face.models.face_loading import load_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw

MOST_OFF = 14  # pixels that are more than 60 of 255 off; 20 to 60 where pixels without all their samples had holes


@pytest.mark.parametrize("person", [None, pytest.param("mei", marks=pytest.mark.nightly)])
def test_small_pictures_are_the_means_of_large_ones(person: str | None) -> None:
    face = load_face("head", person)
    opened = np.zeros(len(face.shape_names), np.float32)
    opened[face.shape_names.index("jawOpen")] = 0.5
    large = Image.fromarray(draw(face, opened, picture=Picture(size="320x320")))
    for side in (48, 64, 80):
        small = draw(face, opened, picture=Picture(size=f"{side}x{side}")).astype(int)
        off = np.abs(small - np.asarray(large.resize((side, side), Image.Resampling.BOX))).max(axis=2)
        assert (off > 60).sum() <= MOST_OFF, side
        assert off.mean() < 4, side
