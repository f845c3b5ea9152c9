"""The shipped talker and the default head, loaded once for each file of tests."""

import pytest

from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.talker import Talker, load_talker
from tts2face.session.session import Session


@pytest.fixture(scope="module")
def talker() -> Talker:
    return load_talker("grid_s1")


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("head")


@pytest.fixture(scope="module")
def session(talker: Talker, face: Face) -> Session:
    return Session(talker, face)
