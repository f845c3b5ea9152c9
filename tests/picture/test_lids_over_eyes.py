"""Nothing of an eyeball is seen beside its lids' opening, in blinks with any gaze and mood, from three cameras."""

import numpy as np
import pytest

from tests.picture.posed_eyes import FACES, gazing, seen_eyes
from tts2face.models.face_loading import load_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

CAMERAS, SIDE, N_POSES = ("front", "30,5", "-30,10"), 320, 16
BLINKS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.0)
MOODS = ("eyeSquint", "cheekSquint", "eyeWide", "mouthSmile", "browDown", "mouthFrown")
LEAST_SEEN = 0.002  # of the ball's disc: one pixel beside the polygon of the lids' landmarks


@pytest.mark.parametrize("name", FACES)
def test_eyeballs_stay_behind_their_lids(name: str) -> None:
    face, rng = load_face(name), np.random.default_rng(5)
    renderer = mesh_renderer(face, Picture(size="64x64"))
    n_shut = 0
    for number in range(N_POSES):
        shapes = {"eyeBlinkLeft": BLINKS[number % len(BLINKS)], "eyeBlinkRight": BLINKS[-1 - number % len(BLINKS)]}
        for mood in MOODS:
            if rng.random() < 0.4:
                shapes |= dict.fromkeys((f"{mood}Left", f"{mood}Right"), rng.random())
        weights = gazing(face, *rng.uniform(-1, 1, 2), **shapes)
        for camera in CAMERAS:
            for share, is_shut in seen_eyes(renderer, weights, camera, SIDE):
                assert share < LEAST_SEEN, (shapes, camera)
                n_shut += is_shut
    assert n_shut > 10
