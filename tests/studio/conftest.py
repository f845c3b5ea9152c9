"""A running service with the studio, one for each process of the tests."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from tests.service.conftest import RunningService

pytest.importorskip("nicegui", reason="needs `pip install 'tts2face[studio]'`")


@pytest.fixture(scope="session")
def studio_service() -> Iterator[RunningService]:
    running = RunningService()
    try:
        running.wait_until_ready()
        yield running
    finally:
        running.close()


@pytest.fixture
def studio(studio_service: RunningService) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=f"{studio_service.url}/studio", timeout=120.0) as made:
        yield made


@pytest.fixture
def data(studio_service: RunningService) -> Path:
    """Data folder of the service."""
    return Path(studio_service.data.name)
