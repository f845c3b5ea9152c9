"""A tracked character speaks as the face that it was made of: lips part as far, meet as firmly, and do not frown."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.interchange.characters.made import head_without_mouth, write_character_file
from tts2face import Session
from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.face.shape_transfer import eye_distance
from tts2face.interchange.characters.importing import import_face
from tts2face.lips.retargeting import BILABIALS
from tts2face.models.face import Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER

TEXT = "Maybe people buy more apples before they leave. What a beautiful morning."
OPENING = 0.15  # share of the opening of the original
FROWN = 0.05  # of a weight, beyond which a neutral face is seen to frown
SHUT_MM = 0.5  # landmarks are read in pictures


@cache
def spoken(face: Face) -> tuple[float, float, float]:
    """Widest gap of the lips over the distance of the eyes, mean frown, and widest gap of a bilabial, mm."""
    session = Session(face=face)
    clip = session.clip(TEXT)
    weights, times = clip.motion.values.astype(float), clip.motion.times
    names = list(clip.motion.channels)
    motion = scatter_landmarks(session.mesh, landmark_motion(session.mesh, np.arange(len(names))))
    gaps = weights @ (motion[list(INNER_LIP_UPPER), 1] - motion[list(INNER_LIP_LOWER), 1]).T
    frown = weights[:, [names.index("mouthFrownLeft"), names.index("mouthFrownRight")]].mean()
    phones = clip.speech.phones
    shut = [
        gaps[(times >= start) & (times <= end)].max(axis=1).min()
        for phone, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True)
        if phone in BILABIALS
    ]
    assert len(shut) > 6
    return float(gaps.max()) / eye_distance(face), float(frown), float(max(shut))


@pytest.mark.usefixtures("face_model")
def test_a_tracked_head_speaks_as_the_original(tmp_path: Path) -> None:
    original = head_without_mouth()
    imported = import_face(write_character_file(tmp_path / "head.glb", face=original)).face
    assert spoken(imported)[0] == pytest.approx(spoken(original)[0], rel=OPENING)
    assert spoken(imported)[1] < FROWN
    assert spoken(imported)[2] < SHUT_MM
