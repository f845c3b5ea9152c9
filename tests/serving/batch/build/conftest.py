"""Batches that are rendered show the made face."""

from functools import partial

import pytest

from tests.serving.batch.conftest import Planner
from tests.world import World
from tts2face.session.named_models import Models


@pytest.fixture
def plan_of(plan_of: Planner, world: World) -> Planner:
    """Plan of subtitles with batch options by name, on the made models."""
    models = Models(str(world.talker_file), str(world.face_file), palette=str(world.palette_file))
    return partial(plan_of, models=models)
