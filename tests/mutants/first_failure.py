"""A plugin of pytest that notes the first failure of a run: which test it is, and whether its assertion failed.

The environment variable `NOTE` names the file that it writes. A fault that breaks an import, a fixture or a kernel's
compilation is an error and no failed assertion: nothing is known then about what the test demands.
"""

import json
import os
from pathlib import Path
from typing import Any

import pytest

NOTE = "TTS2FACE_FIRST_FAILURE"


def pytest_exception_interact(call: Any, report: Any) -> None:
    """Note a failure if it is the first one."""
    note = Path(os.environ[NOTE])
    if note.exists():
        return
    asserted = (AssertionError, pytest.fail.Exception)
    is_assertion = getattr(report, "when", "collect") == "call" and isinstance(call.excinfo.value, asserted)
    text = f"{call.excinfo.typename}: {call.excinfo.value}"
    note.write_text(json.dumps({"test": report.nodeid, "is_assertion": is_assertion, "text": text}), encoding="utf-8")
