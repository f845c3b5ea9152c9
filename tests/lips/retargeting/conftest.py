"""The starter talker and its exemplars."""

import pytest

from tts2face.lips.exemplar import ExemplarModel, build_exemplar_model
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker


@pytest.fixture(scope="session")
def talker() -> Talker:
    return load_talker("grid_s1")


@pytest.fixture(scope="session")
def exemplars(talker: Talker) -> ExemplarModel:
    return build_exemplar_model(talker)
