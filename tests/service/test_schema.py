"""The OpenAPI description holds: requests made from it get documented answers and no server error."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.service.conftest import RunningService

# Meaning is checked after form: a text may be empty, so that requests of the right form may be refused.
OPTIONS = (
    "--max-examples",
    "12",
    "--request-timeout",
    "60",
    "--no-color",
    "--exclude-checks",
    "positive_data_acceptance",
)


# Clips at the limits of the schema take minutes to draw.
@pytest.mark.parametrize(
    "chosen", [("--exclude-path", "/v1/clips"), ("--include-path", "/v1/clips", "--phases", "examples")]
)
def test_requests_made_from_the_schema_get_documented_answers(
    service: RunningService, tmp_path: Path, chosen: tuple[str, ...]
) -> None:
    command = [sys.executable, "-m", "schemathesis.cli", "run", f"{service.url}/openapi.json", *OPTIONS, *chosen]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout[-6000:]
