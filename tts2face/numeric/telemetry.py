"""Switch for ONNX Runtime's telemetry, which would send data and write to the user's home folder."""

import importlib
import os

VARIABLE = "ORT_DISABLE_TELEMETRY"  # read when the native library is loaded


def disable_telemetry() -> None:
    """Switch ONNX Runtime's telemetry off; call this before every import of the library.

    By default, ONNX Runtime writes a device id and an event database under ``~/.cache/Microsoft`` and uploads events.
    The environment variable acts if the library is not loaded yet, the library's own function if it is. Without ONNX
    Runtime the call has no effect.
    """
    os.environ[VARIABLE] = "1"
    try:
        runtime = importlib.import_module("onnxruntime")
    except ImportError:
        return
    disable = getattr(runtime, "disable_telemetry_events", None)  # missing in some builds
    if disable is not None:
        disable()
