"""A plugin of pytest that notes the first failure of a run: the test, its error, and whether the test could run at all.

The environment variable `NOTE` names the file that it writes. Code that cannot be imported or compiled, and a fixture
that fails, say nothing about what the test demands.
"""

import json
import os
from pathlib import Path
from typing import Any

NOTE = "TTS2FACE_FIRST_FAILURE"
BROKEN = (ImportError, SyntaxError, NameError)  # and all errors of numba: code that fails whatever a test demands


def pytest_exception_interact(call: Any, report: Any) -> None:
    """Note a failure if it is the first one."""
    note, error = Path(os.environ[NOTE]), call.excinfo.value
    if note.exists():
        return
    is_in_test = getattr(report, "when", "collect") == "call"
    is_broken = isinstance(error, BROKEN) or type(error).__module__.startswith("numba.")
    found = {
        "test": report.nodeid,
        "could_run": is_in_test and not is_broken,
        "text": f"{call.excinfo.typename}: {error}",
    }
    note.write_text(json.dumps(found), encoding="utf-8")
