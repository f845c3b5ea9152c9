"""Skin around the eyes stays outside the eyeballs for sums of shapes, for every shipped person."""

from dataclasses import replace

import numpy as np
import pytest

from tests.face.people import PEOPLE, load_plain
from tests.face.posing import posed_vertices
from tts2face.face.deformation import build_rig, eye_rotations
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face

BOTH = ("Left", "Right")
SMILE = {"eyeSquint": 0.8, "cheekSquint": 1.0, "mouthSmile": 1.0}
MOODS = (SMILE, {"browDown": 1.0, "eyeSquint": 0.5, "noseSneer": 0.5, "cheekSquint": 0.3}, {"eyeWide": 1.0}, {})
GAZES = ({}, {"eyeLookDown": 1.0}, {"eyeLookUp": 1.0}, {"eyeLookOut": 1.0}, {"eyeLookIn": 1.0})
TOLERANCE_MM = 0.05  # the profile of an eyeball is interpolated between its vertices


def pose(face: Face, mood: dict[str, float], gaze: dict[str, float], blink: float) -> np.ndarray:
    weights = np.zeros(len(face.shape_names), np.float32)
    for name, weight in (mood | gaze | {"eyeBlink": blink}).items():
        for side in BOTH:
            weights[face.shape_names.index(name + side)] = weight
    return weights


def depths(face: Face, vertices: np.ndarray, weights: np.ndarray, eye_turns: np.ndarray) -> np.ndarray:
    """(V, 2) depth of vertices in each eyeball, mm, by its own vertices; negative outside."""
    found = []
    for eye, turn in zip(face.eyes, eye_rotations(eye_turns, weights), strict=True):
        ball = slice(eye.first, eye.first + eye.count)
        centre = eye.centre + np.tensordot(weights, face.shapes[:, ball].mean(axis=1), axes=1)
        rest = face.vertices[ball] - eye.centre
        size = np.linalg.norm(rest, axis=1)
        order = np.argsort(np.arccos(rest[:, 2] / size))
        off = vertices - centre
        distance = np.linalg.norm(off, axis=1)
        angle = np.arccos(np.clip(off @ turn[:, 2] / distance, -1, 1))
        found.append(np.interp(angle, np.arccos(rest[order, 2] / size[order]), size[order]) - distance)
    return np.stack(found, axis=1)


@pytest.mark.parametrize(("name", "person"), PEOPLE)
def test_no_sum_of_shapes_moves_skin_into_an_eyeball(name: str, person: str | None) -> None:
    face = load_plain(name, person)
    skin = np.unique(face.triangles[: face.parts[0].count])
    assert face.parts[0].kind == "skin"
    rig, still = build_rig(face), np.zeros(len(face.shape_names), np.float32)
    centres = np.stack([eye.centre for eye in face.eyes])
    outside = (depths(face, face.vertices, still, rig.eye_turns)[skin] < 0) & (
        face.vertices[skin, None, 2] > centres[:, 2]
    )
    deepest, uncorrected = 0.0, 0.0
    for mood in MOODS:
        for gaze in GAZES:
            for blink in (0.0, 0.5, 1.0):
                weights = pose(face, mood, gaze, blink)
                deepest = max(deepest, depths(face, rig.pose(weights), weights, rig.eye_turns)[skin][outside].max())
                plain = posed_vertices(face, weights)
                uncorrected = max(uncorrected, depths(face, plain, weights, rig.eye_turns)[skin][outside].max())
    assert deepest < TOLERANCE_MM
    assert uncorrected > 0.3  # the shapes alone


@pytest.mark.smoke
def test_lashes_follow_the_lids() -> None:
    face = load_face("head", hair="bald")
    rig = build_rig(face)
    weights = pose(face, {"eyeWide": 0.3}, {"eyeLookUp": 1.0}, 0.5)
    moved = np.linalg.norm(rig.pose(weights) - posed_vertices(face, weights), axis=1)
    lashes = next(part for part in face.parts if part.name == "lashes")
    used = np.unique(face.triangles[lashes.first : lashes.first + lashes.count])
    assert 0.3 < moved[used].max() <= moved.max() + 1e-3
    others = [part for part in face.parts if part.kind in ("eye", "plain") and part.name != "wet"]
    for part in others:
        assert moved[np.unique(face.triangles[part.first : part.first + part.count])].max() < 1e-3


def test_rest_and_faces_without_skin_parts_are_unchanged() -> None:
    face = load_face("head", hair="bald")
    rest = np.zeros(len(face.shape_names), np.float32)
    np.testing.assert_allclose(build_rig(face).pose(rest), face.vertices, atol=1e-4)
    plain = replace(face, parts=tuple(replace(part, kind="plain") for part in face.parts))
    weights = pose(face, SMILE, {"eyeLookDown": 1.0}, 0.0)
    np.testing.assert_allclose(build_rig(plain).pose(weights), posed_vertices(face, weights), atol=1e-3)
    assert np.abs(build_rig(face).pose(weights) - posed_vertices(face, weights)).max() > 0.5
