"""Every shipped person: lips, teeth, gums, tongue and eyes."""

import numpy as np
import pytest

from tests.face.build.test_shipped_faces import landmarks
from tests.face.people import PEOPLE
from tests.face.posing import posed_vertices
from tests.face.test_mouth import FRONT_Z, part_vertices, uncovered, weights
from tts2face.models.face_file import read_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, LOWER_LIP_INNER_MID
from tts2face.storage.shipped import find_file

CLOSED = (
    {},
    {"mouthPress": 1.0},
    {"mouthPucker": 1.0},
    {"mouthPress": 1.0, "mouthRollUpper": 1.0, "mouthRollLower": 1.0},
    {"mouthRollUpper": 1.0},
    {"mouthRollLower": 1.0},
    {"mouthShrugLower": 1.0},
    {"jawOpen": 0.3, "mouthClose": 0.3},
    {"mouthSmile": 1.0},
    {"cheekPuff": 1.0},
)  # lips that are closed, as for /p b m/
DRAWN_BACK = (
    {"jawOpen": 0.15, "mouthSmile": 0.6},
    {"jawOpen": 0.3, "mouthSmile": 1.0},
    {"jawOpen": 0.15, "mouthStretch": 1.0},
    {"jawOpen": 0.15, "mouthFunnel": 1.0},
    {"jawOpen": 0.7},
    {"jawOpen": 1.0},
    {"jawOpen": 0.7, "mouthSmile": 0.7},
    {"jawOpen": 1.0, "mouthSmile": 0.7},
    {"jawOpen": 1.0, "mouthSmile": 1.0},
)


@pytest.mark.parametrize(("name", "person"), PEOPLE)
def test_no_tooth_or_gum_comes_through_closed_lips(name: str, person: str | None) -> None:
    face = read_face(find_file(name, "face"), person)
    inner = part_vertices(face, "teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue")
    inner = inner[face.vertices[inner, 2] > FRONT_Z][::3]
    for shown in CLOSED:
        seen = uncovered(face, posed_vertices(face, weights(face, shown)), inner)
        assert seen.mean() < (0.01 if shown else 1e-9), f"{shown}: {seen.sum()} of {len(seen)} vertices"


@pytest.mark.parametrize(("name", "person"), PEOPLE)
def test_lower_gums_stay_inside_when_a_smile_draws_the_lip_back(name: str, person: str | None) -> None:
    face = read_face(find_file(name, "face"), person)
    inner = part_vertices(face, "teeth_lower", "gums_lower")
    inner = inner[face.vertices[inner, 2] > FRONT_Z]
    for shown in DRAWN_BACK:
        posed = posed_vertices(face, weights(face, shown))
        lip = np.einsum("lk,lkd->ld", face.landmark_weights, posed[face.landmark_vertices])[LOWER_LIP_INNER_MID]
        below = inner[posed[inner, 1] < lip[1] - 4]
        assert not uncovered(face, posed, below).any(), shown


@pytest.mark.parametrize(("name", "person"), PEOPLE)
def test_lips_meet_along_their_whole_width(name: str, person: str | None) -> None:
    face = read_face(find_file(name, "face"), person)
    rest = landmarks(face, face.vertices)
    gap = rest[list(INNER_LIP_UPPER), 1] - rest[list(INNER_LIP_LOWER), 1]
    assert gap.max() <= 0.15  # mm
    assert gap.min() >= -0.32  # soft lips press each other a little


@pytest.mark.parametrize(("name", "person"), PEOPLE)
def test_the_eyes_stay_in_their_sockets(name: str, person: str | None) -> None:
    face = read_face(find_file(name, "face"), person)
    for eye in face.eyes:
        front = face.vertices[eye.first : eye.first + eye.count, 2].max()
        radius = np.linalg.norm(face.vertices[eye.first] - eye.centre)
        assert front - eye.centre[2] < 1.1 * radius
