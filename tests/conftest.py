"""What all tests share: the way to real recordings, which are not part of the project."""

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def shared_recordings() -> Path:
    """Folder of real recordings that lies beside the project; absent outside the founders' machines."""
    folder = SHARED / "recordings"
    if not folder.is_dir():
        pytest.skip(f"needs the recordings in {folder}, which are not part of the project")
    return folder
