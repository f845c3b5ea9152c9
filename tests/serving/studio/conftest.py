"""Services with the studio, one of each kind for each process of the tests, and a browser.

`closed` is in the process of the test and has keys; `studio_service` is a running one with the harness.
"""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from starlette.testclient import TestClient

from tests.conftest import SHARED
from tests.packages import needs
from tests.running import RunningService
from tests.serving.service.in_process import SessionProcess, service_client
from tests.serving.studio.chromium import Browser, open_browser
from tests.serving.studio.fake_camera import write_fake_media

needs("nicegui")

SPOKEN = SHARED / "recordings" / "grid_s1" / "clips" / "bbaf2n.mkv"  # "bin blue at f two now"


@pytest.fixture(scope="session")
def keys(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Secrets of keys, and their file."""
    from tts2face.serving.service.keys import add_key

    path = tmp_path_factory.mktemp("keys") / "keys.toml"
    return {"ann": add_key(path, "ann", ["speak"]), "bob": add_key(path, "bob", ["speak"]), "file": str(path),
            "eva": add_key(path, "eva", ["speak", "build"]), "reader": add_key(path, "reader", ["admin"])}  # fmt: skip


@pytest.fixture(scope="session")
def closed(keys: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Client of a service with keys and the studio; NiceGUI takes one for each process."""
    from tts2face.serving.service.settings import ServiceSettings
    from tts2face.serving.studio.app import STUDIO
    from tts2face.serving.studio.requests import TASKS
    from tts2face.session.session_cache import SessionCache

    settings = ServiceSettings(
        data=tmp_path_factory.mktemp("closed"), keys=Path(keys["file"]), workers=0, warm_studio=False
    )
    with service_client(settings, SessionProcess(SessionCache(1), TASKS), [STUDIO]) as client:
        yield client


@pytest.fixture(scope="module")
def studio_service(service: RunningService) -> Iterator[RunningService]:
    """The service of the run, with the harness; the tests of a file leave no traceback in its log."""
    begin = len(service.lines)
    yield service
    assert not [event for event in service.events()[begin:] if "traceback" in event]


@pytest.fixture
def studio(studio_service: RunningService) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=f"{studio_service.url}/studio", timeout=120.0) as made:
        yield made


@pytest.fixture
def data(studio_service: RunningService) -> Path:
    """Data folder of the service."""
    return Path(studio_service.data.name)


@pytest.fixture(scope="session")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A window whose camera and microphone play a recording of GRID, if there is one."""
    arguments = write_fake_media(SPOKEN, tmp_path_factory.mktemp("camera")) if SPOKEN.is_file() else []
    with open_browser(arguments=arguments) as opened:
        yield opened


@pytest.fixture
def browser(window: Browser) -> Iterator[Browser]:
    """The window; the test's pages write no errors to its console."""
    window.errors()
    yield window
    try:
        assert window.errors() == []
    finally:
        window.open("about:blank")  # a page that stays draws its face in one core
