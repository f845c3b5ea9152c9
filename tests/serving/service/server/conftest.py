"""A service in the process of the test with five keys, and functions that ask it as one of them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from tests.serving.service.in_process import decoding_here
from tests.serving.service.resource_requests import Ask, asking
from tts2face.serving.service.keys import add_key
from tts2face.serving.service.settings import ServiceSettings


@pytest.fixture(scope="module")
def decoding() -> Iterator[None]:
    """Uploads are checked in this process."""
    with decoding_here():
        yield


@pytest.fixture
def settings(tmp_path: Path) -> ServiceSettings:
    return ServiceSettings(processes=1, data=tmp_path / "data", keys=tmp_path / "keys.toml")


@pytest.fixture
def keys(tmp_path: Path) -> dict[str, str]:
    """Secrets of five keys."""
    path = tmp_path / "keys.toml"
    return {
        "ann": add_key(path, "ann", ["speak", "build"]),
        "bob": add_key(path, "bob", ["speak", "build"], resources=2, resources_mb=0.0001),
        "eve": add_key(path, "eve", ["speak", "build"], photos_per_day=0),
        "reader": add_key(path, "reader", ["speak"]),
        "boss": add_key(path, "boss", ["speak", "build", "admin"]),
    }


@pytest.fixture
def ask(settings: ServiceSettings, keys: dict[str, str]) -> Iterator[Ask]:
    """Function that sends one request as a key."""
    with asking(settings, keys) as ask_as:
        yield ask_as


@pytest.fixture
def ask_with_photos(settings: ServiceSettings, keys: dict[str, str]) -> Iterator[Ask]:
    """As `ask`, of a service that makes faces of photos."""
    with asking(replace(settings, photos=True, upload_pixels=200_000), keys) as ask_as:
        yield ask_as
