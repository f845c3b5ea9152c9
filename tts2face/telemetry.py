"""ONNX Runtime without telemetry: nothing is sent, and nothing is written to the user's home folder."""

import importlib
import os

VARIABLE = "ORT_DISABLE_TELEMETRY"  # read when its library is loaded


def disable_telemetry() -> None:
    """Switch ONNX Runtime's telemetry off; called right before anything that imports it.

    By default, ONNX Runtime writes a device id and an event database under ``~/.cache/Microsoft`` and uploads events.
    The environment variable acts where the library is not loaded yet, the function where it is. Does nothing where ONNX
    Runtime is not installed.
    """
    os.environ[VARIABLE] = "1"
    try:
        runtime = importlib.import_module("onnxruntime")
    except ImportError:
        return
    disable = getattr(runtime, "disable_telemetry_events", None)  # missing in some builds
    if disable is not None:
        disable()
