"""One made talker for all tests of the room."""

import pytest

from tests.corpus_tools.similarity.steady_talker import made_talker
from tts2face.models.talker import Talker


@pytest.fixture(scope="session")
def talker() -> Talker:
    return made_talker()
