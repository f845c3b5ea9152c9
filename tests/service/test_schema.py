"""The OpenAPI description holds: requests made from it get documented answers and no server error."""

import subprocess
import sys
from pathlib import Path

from tests.service.conftest import RunningService


def test_requests_made_from_the_schema_get_documented_answers(service: RunningService, tmp_path: Path) -> None:
    done = subprocess.run(
        [
            sys.executable, "-m", "schemathesis.cli", "run", f"{service.url}/openapi.json", "--max-examples", "12", "--request-timeout", "60",
            # Meaning is checked after form: an empty text has the right form.
            "--exclude-checks", "positive_data_acceptance", "--no-color",
        ],
        capture_output=True, text=True, timeout=500, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-6000:]
