"""A performer's smile: scores at rest are taken out as the person's build, but for a smile that is held throughout."""

from dataclasses import replace

import numpy as np
import pytest

import tts2face
from tts2face.face.landmarks import moved_landmarks
from tts2face.lips.performer import build_performer_retargeter
from tts2face.models.score_map import SCORE_SHAPES
from tts2face.types import Trajectory
from tts2face.video.blendshapes import BLENDSHAPES

TEXT = "We were away a year ago, but Bob may move five big maps."


@pytest.fixture(scope="module")
def session() -> tts2face.Session:
    return tts2face.Session(face="head")


def mimicked(session: tts2face.Session, expression: str | None) -> tuple[Trajectory, Trajectory]:
    """Motion of the head, and that of the head by its landmarks and the scores that its score map has for it."""
    face = session.mesh
    motion = session.clip(TEXT, gain="all=0", expression=expression).motion
    motion = replace(motion, channels=face.shape_names, values=motion.values[:, : len(face.shape_names)])
    assert face.scores is not None
    read = face.scores.scores(motion.columns(face.scores.inputs))
    scores = np.zeros((len(motion), len(BLENDSHAPES)), np.float32)
    for names, score in zip(SCORE_SHAPES.values(), read.T, strict=True):
        scores[:, [BLENDSHAPES.index(name) for name in names]] = score[:, None]
    landmarks, seen = moved_landmarks(face, motion), Trajectory(BLENDSHAPES, scores, motion.fps)
    return motion, build_performer_retargeter(landmarks, seen, face).weights(landmarks, seen)


@pytest.mark.parametrize(("expression", "least", "most"), [("happy=0.7", 0.3, 0.6), (None, 0.0, 0.1)])
def test_a_smile_throughout_is_mimicked(
    session: tts2face.Session, expression: str | None, least: float, most: float
) -> None:
    given, found = mimicked(session, expression)
    for name in SCORE_SHAPES["mouthSmile"]:
        assert least <= given.columns([name]).mean() <= most
        assert least <= found.columns([name]).mean() <= most
    opened = [motion.columns(["jawOpen"])[:, 0] for motion in (given, found)]
    assert np.corrcoef(*opened)[0, 1] > 0.7
