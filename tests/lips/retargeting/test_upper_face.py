"""Brows and wide eyes are read from landmarks as they are drawn, alike on both sides, and from rest as rest."""

import numpy as np

from tts2face.face.landmarks import moved_landmarks, rest_landmarks
from tts2face.lips.performer import build_performer_retargeter
from tts2face.lips.upper_face import GROUPS, MEASURES, READ_SHAPES, read_upper_face, upper_face_measures
from tts2face.models.face_loading import load_face
from tts2face.types import Trajectory
from tts2face.video.blendshapes import BLENDSHAPES

HEAD = load_face("head")
REST = rest_landmarks(HEAD)


def drawn(**weights: float) -> np.ndarray:
    """Landmarks (1, 478, 3) of the head with weights of its shapes."""
    values = np.zeros((1, len(HEAD.shape_names)), np.float32)
    for name, weight in weights.items():
        values[0, HEAD.shape_names.index(name)] = weight
    return moved_landmarks(HEAD, Trajectory(HEAD.shape_names, values, 30.0))


def test_rest_is_read_as_rest() -> None:
    assert not read_upper_face(np.repeat(REST[None], 3, axis=0), REST).any()


def test_measures_are_displacements_over_the_width_of_the_eyes() -> None:
    moved = REST + np.array([2.0, -3.0, 5.0])
    width = np.linalg.norm(REST[33] - REST[263])
    found = upper_face_measures(moved[None], REST)
    assert found.shape == (1, len(MEASURES))
    np.testing.assert_allclose(found[0, : len(GROUPS)], 2.0 / width, rtol=1e-6)
    np.testing.assert_allclose(found[0, len(GROUPS) :], -3.0 / width, rtol=1e-6)
    np.testing.assert_allclose(upper_face_measures(2 * moved[None], 2 * REST), found, rtol=1e-6)


def test_both_sides_are_read_alike() -> None:
    for name, mirrored in (("browDownLeft", "browDownRight"), ("browOuterUpLeft", "browOuterUpRight")):
        at, opposite = READ_SHAPES.index(name), READ_SHAPES.index(mirrored)
        both = [read_upper_face(drawn(**{shape: 1.0}), REST)[0] for shape in (name, mirrored)]
        assert both[0][at] > 2 * both[0][opposite]
        assert abs(both[0][at] - both[1][opposite]) < 0.15  # the head's landmarks are not symmetrical


def test_a_performer_s_brows_follow_landmarks_where_scores_are_full_at_rest() -> None:
    raised = np.concatenate([drawn()] * 6 + [drawn(browInnerUp=1.0)] * 2 + [drawn(jawOpen=0.6)] * 2)
    scores = np.zeros((len(raised), len(BLENDSHAPES)), np.float32)
    scores[:, BLENDSHAPES.index("browInnerUp")] = 0.99  # as of drawn faces, whatever they do
    seen = Trajectory(BLENDSHAPES, scores, 30.0)
    weights = build_performer_retargeter(raised, seen, HEAD).weights(raised, seen)
    up = weights.values[:, weights.channels.index("browInnerUp")]
    assert up[6:8].min() > 0.4
    assert max(up[:6].max(), up[8:].max()) < 0.1
