"""The OpenAPI description holds: requests made from it get documented answers and no server error."""

import subprocess
import sys
from pathlib import Path

from tests.service.conftest import RunningService


def test_requests_made_from_the_schema_get_documented_answers(service: RunningService, tmp_path: Path) -> None:
    options = ["--max-examples", "12", "--request-timeout", "120", "--no-color"]
    options += ["--exclude-checks", "positive_data_acceptance"]  # meaning is checked after form: a text may be empty
    command = [sys.executable, "-m", "schemathesis.cli", "run", f"{service.url}/openapi.json", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout[-6000:]
