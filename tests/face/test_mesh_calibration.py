"""Calibration on the mesh: a mouth that moves as the default head's reads as it, and shut lips may smile."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.face.landmarks import landmark_motion
from tts2face.face.lip_constraints import OVERLAP, SPEECH_SHAPE_PREFIXES, build_lip_constraints
from tts2face.face.mesh_calibration import calibrate_on_mesh, equivalent_weights
from tts2face.face.shape_transfer import default_head
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face

GAP_MM = 0.1  # weights of gaps are finite
SCORE = 0.02  # of a score, which is 0 to 1


@cache
def lips_alone() -> Face:
    """The shapes of the default head that move its mouth, on the vertices of its landmarks."""
    head = default_head()
    numbers, where = np.unique(head.landmark_vertices, return_inverse=True)
    kept = np.array([name.startswith(SPEECH_SHAPE_PREFIXES) for name in head.shape_names])
    triangles = np.arange(3, dtype=np.int32)[None]
    return replace(
        head, vertices=head.vertices[numbers], shapes=head.shapes[kept][:, numbers], limits=head.limits[kept],
        shape_names=tuple(np.array(head.shape_names)[kept].tolist()), triangles=triangles,
        parts=(replace(head.parts[0], first=0, count=1, texture=-1, cutout=False),), textures=(), uv=None,
        eyes=(), tangents=None, hairdo=None, occlusion=None, scores=None, colours=head.colours[numbers],
        landmark_vertices=where.reshape(head.landmark_vertices.shape).astype(np.int32),
    )  # fmt: skip


def read(face: Face, weights: dict[str, float]) -> np.ndarray:
    assert face.scores is not None
    return face.scores.scores(np.array([[weights.get(name, 0.0) for name in face.scores.inputs]]))[0]


@pytest.mark.parametrize("name", ["jawOpen", "mouthPucker", "mouthSmileLeft", "mouthLowerDownRight", "jawLeft"])
@pytest.mark.parametrize(("size", "gain"), [(1.0, 1.0), (0.3, 1.0), (25.0, 0.5), (1.0, 1.8)])
def test_a_mouth_of_any_size_and_strength_reads_as_the_head(name: str, size: float, gain: float) -> None:
    face = lips_alone()
    other = replace(face, vertices=face.vertices * np.float32(size), shapes=face.shapes * np.float32(size * gain))
    found = calibrate_on_mesh(other)
    assert read(found, {name: 0.6 / gain}) == pytest.approx(read(default_head(), {name: 0.6}), abs=SCORE)


def test_a_viseme_reads_as_the_shapes_that_it_sums() -> None:
    face, parts = lips_alone(), {"jawOpen": 0.5, "mouthFunnel": 0.6}
    summed = sum(np.float32(w) * face.shapes[face.shape_names.index(name)] for name, w in parts.items())
    kept = [at for at, name in enumerate(face.shape_names) if name not in parts]
    own = replace(
        face, shape_names=(*(face.shape_names[at] for at in kept), "mouthViseme_O"),
        shapes=np.concatenate([face.shapes[kept], summed[None]]), limits=face.limits[[*kept, 0]],
    )  # fmt: skip
    assert read(calibrate_on_mesh(own), {"mouthViseme_O": 1.0}) == pytest.approx(read(default_head(), parts), abs=0.05)
    equal = equivalent_weights(own, default_head())[:, -1]
    names = [name for name in default_head().shape_names if name.startswith(SPEECH_SHAPE_PREFIXES)]
    assert {names[at] for at in np.argsort(-equal)[:2]} == set(parts)


def test_opposite_shapes_do_not_lift_a_jaw_together() -> None:
    equal = equivalent_weights(lips_alone(), default_head())
    names = [name for name in default_head().shape_names if name.startswith(SPEECH_SHAPE_PREFIXES)]
    sideways = equal[[names.index(name) for name in ("jawLeft", "jawRight", "mouthLeft", "mouthRight")]]
    assert ((sideways > 1e-6).sum(axis=1) == 1).all()


def test_a_source_without_scores_is_refused() -> None:
    with pytest.raises(DataError, match="has none; calibrate it"):
        calibrate_on_mesh(lips_alone(), lips_alone())


@pytest.mark.parametrize("tolerance", [0.0, 0.3])
def test_lips_that_touch_follow_a_gesture_by_the_tolerance(tolerance: float) -> None:
    """A weak smile acts alone; a strong one changes the gaps by no more than the tolerances."""
    face = replace(lips_alone(), lip_tolerance_mm=tolerance)
    mouth = build_lip_constraints(face).with_gesture_cost()
    smile = np.isin(face.shape_names, ("mouthSmileLeft", "mouthSmileRight")).astype(np.float64)
    shut = np.zeros((2, len(smile)))
    added = np.outer([0.08, 0.9], smile)
    own = added @ mouth.gaps.T
    assert np.abs(own[0]).max() < 0.3 < np.abs(own[1]).max()
    weak, strong = mouth.combine(shut, added)
    np.testing.assert_allclose(mouth.gaps @ strong, np.clip(own[1], -OVERLAP * tolerance, tolerance), atol=GAP_MM)
    if tolerance:
        np.testing.assert_allclose(weak, added[0], atol=2e-3)
    else:
        np.testing.assert_allclose(mouth.gaps @ weak, 0.0, atol=GAP_MM)


def test_the_tolerance_is_a_share_of_the_mouth_and_kept_in_the_file(tmp_path: Path) -> None:
    face = lips_alone()
    found = calibrate_on_mesh(face)
    large = calibrate_on_mesh(replace(face, vertices=face.vertices * 2, shapes=face.shapes * 2))
    assert large.lip_tolerance_mm == pytest.approx(2 * found.lip_tolerance_mm)
    write_face(tmp_path / "found.face", found)
    again = read_face(tmp_path / "found.face")
    assert again.lip_tolerance_mm == pytest.approx(found.lip_tolerance_mm)
    assert again.scores is not None
    write_face(tmp_path / "wrong.face", replace(found, lip_tolerance_mm=-1.0))
    with pytest.raises(DataError, match=r"lip_tolerance_mm"):
        read_face(tmp_path / "wrong.face")


def test_motion_is_compared_in_the_axes_of_the_source() -> None:
    """A head that looks up by 20 degrees, as many models do at rest, reads as one that looks ahead."""
    face, angle = lips_alone(), np.radians(20.0)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    turned = replace(
        face, vertices=(face.vertices @ turn.T).astype(np.float32), shapes=(face.shapes @ turn.T).astype(np.float32)
    )
    assert np.abs(landmark_motion(turned, np.arange(3)) - landmark_motion(face, np.arange(3))).max() > 1.0
    straight, looking_up = calibrate_on_mesh(face), calibrate_on_mesh(turned)
    assert read(looking_up, {"jawOpen": 0.5}) == pytest.approx(read(straight, {"jawOpen": 0.5}), abs=SCORE)
