"""Sessions of the doors: on the made world, or on the shipped models where these are the subject."""

from pathlib import Path

import pytest

from tests.world import World
from tts2face.session.session import Session


@pytest.fixture(scope="module")
def session(world: World) -> Session:
    return world.session()


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, in which commands run."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
