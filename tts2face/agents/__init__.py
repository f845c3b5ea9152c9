"""Faces for voice agents of LiveKit (extra ``[livekit]``) and Pipecat (``[pipecat]``), loaded when they are used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lexicon.errors import import_of_extra

if TYPE_CHECKING:
    from tts2face.agents.livekit_avatar import LiveKitAvatar as LiveKitAvatar
    from tts2face.agents.pipecat_face import PipecatFace as PipecatFace

__all__ = ["LiveKitAvatar", "PipecatFace"]

_PLACES = {  # module, package and extra of each
    "LiveKitAvatar": ("livekit_avatar", "livekit-agents", "livekit"),
    "PipecatFace": ("pipecat_face", "pipecat-ai", "pipecat"),
}


def __getattr__(name: str) -> Any:
    """Class of a name; a missing package is a `BackendError`."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    module, package, extra = _PLACES[name]
    with import_of_extra(f"{name} needs the package {package}; run: pip install 'tts2face[{extra}]'"):
        return getattr(import_module(f"tts2face.agents.{module}"), name)
