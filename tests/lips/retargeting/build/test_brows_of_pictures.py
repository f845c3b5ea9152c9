"""Brows and lids of a drawn face that taught nothing are read in its pictures: rest as rest, full as full."""

from pathlib import Path

import numpy as np
import pytest

from tts2face.lips.performer import build_performer_retargeter
from tts2face.models.face_loading import load_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.types import Trajectory
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.pose import remove_pose
from tts2face.video.tracking import FaceTracker

BLINK = {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}
POSES = [{}, {}, {"browInnerUp": 1.0}, {}, BLINK, {}, {"browOuterUpLeft": 1.0}, {}, {"browDownLeft": 1.0}, {}, {}]


def test_a_drawn_face_is_read_in_its_pictures(face_model: Path) -> None:
    face = load_face("ben")
    values = np.zeros((len(POSES), len(face.shape_names)), np.float32)
    for row, pose in zip(values, POSES, strict=True):
        for name, weight in pose.items():
            row[face.shape_names.index(name)] = weight
    renderer, reader = mesh_renderer(face, Picture(size="512x512")), BlendshapeReader(face_model)
    pictures = [renderer.draw(row) for row in values]
    points = FaceTracker(face_model).track(lambda: pictures, 25.0).points
    scores = Trajectory(BLENDSHAPES, np.array([reader.blendshape_scores(found) for found in points]), 25.0)
    landmarks = remove_pose(points, 25.0).landmarks
    read = build_performer_retargeter(landmarks, scores, face).weights(landmarks, scores)
    at_rest = [number for number, pose in enumerate(POSES) if not pose]
    for number, pose in enumerate(POSES):
        for name, weight in pose.items():
            shown = read.values[:, read.channels.index(name)]
            assert shown[number] == pytest.approx(weight, abs=0.5)
            assert shown[at_rest].max() < 0.15
    # its scores say raised brows whatever the brows do; of shut eyes, of which no white is left, they say a little less
    risen = scores.columns(["browInnerUp"])[:, 0]
    assert risen[[pose is not BLINK for pose in POSES]].min() > 0.9
    assert risen.min() > 0.8
