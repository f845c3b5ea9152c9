"""Text becomes a talking face.

Examples
--------
>>> import tts2face
>>> session = tts2face.Session()  # doctest: +SKIP
>>> session.write("Hello there.", "hello.mp4", style="delighted")  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lexicon.errors import BackendError, DataError, InputError, Tts2faceError
    from tts2face.api import write_clip
    from tts2face.models.face import Face
    from tts2face.models.face_file import load_face
    from tts2face.models.palette import Palette, load_palette
    from tts2face.models.talker import Talker, load_talker
    from tts2face.render.picture import Picture
    from tts2face.request import Request
    from tts2face.session import Session
    from tts2face.types import Clip, Speech, Trajectory, Waveform

__version__ = "0.1.0"

__all__ = [
    "BackendError",
    "Clip",
    "DataError",
    "Face",
    "InputError",
    "Palette",
    "Picture",
    "Request",
    "Session",
    "Speech",
    "Talker",
    "Trajectory",
    "Tts2faceError",
    "Waveform",
    "load_face",
    "load_palette",
    "load_talker",
    "write_clip",
]

_HOMES = {
    "BackendError": "lexicon.errors",
    "Clip": "tts2face.types",
    "DataError": "lexicon.errors",
    "Face": "tts2face.models.face",
    "InputError": "lexicon.errors",
    "Palette": "tts2face.models.palette",
    "Picture": "tts2face.render.picture",
    "Request": "tts2face.request",
    "Session": "tts2face.session",
    "Speech": "tts2face.types",
    "Talker": "tts2face.models.talker",
    "Trajectory": "tts2face.types",
    "Tts2faceError": "lexicon.errors",
    "Waveform": "tts2face.types",
    "load_face": "tts2face.models.face_file",
    "load_palette": "tts2face.models.palette",
    "load_talker": "tts2face.models.talker",
    "write_clip": "tts2face.api",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'tts2face' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names, whether imported already or not."""
    return sorted({*globals(), *__all__})
