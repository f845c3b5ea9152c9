"""The drawn head, evaluated by an independent network: MediaPipe's blendshape scores (Kartynnik et al. 2019)."""

import numpy as np
import pytest

from lexicon.errors import Tts2faceError
from tests.face.people import LIT
from tts2face.models.face_loading import load_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.video.blendshapes import BLENDSHAPES

SET = {
    "jawOpen": ({"jawOpen": 0.8}, ("jawOpen",)),
    "mouthSmile": ({"mouthSmileLeft": 0.9, "mouthSmileRight": 0.9}, ("mouthSmileLeft", "mouthSmileRight")),
    "mouthPucker": ({"mouthPucker": 1.0}, ("mouthPucker",)),
    "eyeBlink": ({"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}, ("eyeBlinkLeft", "eyeBlinkRight")),
    "browInnerUp": ({"browInnerUp": 1.0, "browOuterUpLeft": 1.0, "browOuterUpRight": 1.0}, ("browInnerUp",)),
}


@pytest.fixture(scope="module")
def networks():
    from tts2face.video.blendshapes import BlendshapeReader
    from tts2face.video.tracking import FaceTracker

    try:
        return FaceTracker(), BlendshapeReader()
    except Tts2faceError as missing:
        pytest.skip(f"the outside check cannot run: {missing}")


@pytest.fixture(scope="module", params=["head", *LIT])
def scores(request, networks):
    """Function from shape weights to the network's scores by name."""
    tracker, reader = networks
    face = load_face(request.param)
    renderer = mesh_renderer(face, Picture(size="640x640"))

    def scored(weights):
        vector = np.array([weights.get(name, 0.0) for name in face.shape_names], np.float32)
        points, found = tracker.read(renderer.draw(vector))
        assert found > 0.5
        return dict(zip(BLENDSHAPES, reader.blendshape_scores(points).tolist(), strict=True))

    return scored


@pytest.mark.parametrize("name", SET)
def test_a_shape_that_is_set_is_found(scores, name):
    weights, expected = SET[name]
    rest, shown = scores({}), scores(weights)
    for shape in expected:
        assert shown[shape] > min(rest[shape] + 0.25, 0.95), (
            f"{shape}: {rest[shape]:.2f} at rest, {shown[shape]:.2f} when set"
        )


def test_the_resting_mouth_is_closed_and_the_eyes_are_open(scores):
    rest = scores({})
    assert rest["jawOpen"] - rest["mouthClose"] < 0.1  # a long chin is read as a lowered jaw behind closed lips
    assert rest["eyeBlinkLeft"] < 0.4
    assert rest["eyeBlinkRight"] < 0.4


def test_the_default_head_neither_smiles_nor_frowns_at_rest(networks):
    tracker, reader = networks
    face = load_face("head")
    at_rest = np.zeros(len(face.shape_names), np.float32)
    views = [mesh_renderer(face, Picture(size="640x640", camera=f"{yaw},3")).draw(at_rest) for yaw in (-8, 0, 8)]
    read = np.mean([reader.blendshape_scores(tracker.read(view)[0]) for view in views], axis=0)
    found = dict(zip(BLENDSHAPES, read.tolist(), strict=True))
    for side in ("Left", "Right"):
        assert found[f"mouthSmile{side}"] <= 0.08
        assert found[f"mouthFrown{side}"] <= 0.05
