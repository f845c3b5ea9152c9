"""What a synthesis process is asked to make."""

import queue
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

Inputs = queue.SimpleQueue[Any]


@dataclass(frozen=True, slots=True)
class Work:
    """What a task makes; all values are JSON.

    Parameters
    ----------
    kind
        Name of one of `TASKS`.
    models
        Fields of `tts2face.session_cache.Models` that differ from their defaults.
    request, picture
        Fields of `Request` and `Picture` that differ from their defaults.
    format
        Format of `Session.stream_file`.
    owner
        For whom finished sentences are kept in memory (`SessionCache.get`); empty: none are.
    affinity
        Works of equal affinity run in the same process if it is free, which keeps their sentences; empty: any.
    """

    kind: str = "file"
    models: Mapping[str, Any] = field(default_factory=dict)
    request: Mapping[str, Any] = field(default_factory=dict)
    picture: Mapping[str, Any] = field(default_factory=dict)
    format: str = "mp4"
    owner: str = ""
    affinity: str = ""

    def as_json(self) -> dict[str, Any]:
        """JSON object from which `work_from_json` makes the work again."""
        return asdict(self)


def work_from_json(content: Mapping[str, Any]) -> Work:
    """The work of `Work.as_json`."""
    return Work(**content)
