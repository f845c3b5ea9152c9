"""Names of gestures, as texts, timelines and services write them, and their directions.

How each moves the face is `tts2face.gestures.movements`. A new gesture: a row here, and its keys there.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

SIDES = MappingProxyType({"left": (0.0, 15.0), "right": (0.0, -15.0)})  # degrees down, and to the person's own left
DIRECTIONS = MappingProxyType({**SIDES, "up": (-12.0, 0.0), "down": (12.0, 0.0)})
_SEPARATORS = re.compile(r"[\s_-]+")


@dataclass(frozen=True, slots=True)
class GestureName:
    """Movement that a gesture shows, its usual seconds, and its directions: none, a side, or any."""

    shown: str
    seconds: float
    directions: Literal["none", "side", "any"] = "none"


GESTURES: Mapping[str, GestureName] = MappingProxyType({
    "nod": GestureName("the head goes down and up again", 0.55),
    "shake": GestureName("the head turns from side to side", 1.35),
    "tilt": GestureName("the head leans to a side", 1.85, "side"),
    "look_away": GestureName("eyes and head turn away from the viewer", 1.7, "any"),
    "look_at": GestureName("eyes and head turn to the viewer, or where a direction says", 2.45, "any"),
    "wink": GestureName("one eye shuts, with the cheek below it", 1.1, "side"),
    "blink": GestureName("both eyes shut and open", 0.32),
    "brows_up": GestureName("the brows rise", 0.8),
    "brows_together": GestureName("the brows come together and down", 1.35),
    "smile": GestureName("a smile, of lips, cheeks and eyes", 2.5),
    "frown": GestureName("the brows come together, the corners of the mouth go down", 2.1),
    "laugh": GestureName("a laugh without sound: mouth, cheeks, lids and head", 2.4),
    "sigh": GestureName("a deep breath: head and lids rise and sink", 2.9),
    "surprise": GestureName("the brows rise, the lids open wide, the jaw drops a little", 1.4),
    "think": GestureName("the eyes go up and aside, the brows together", 2.2, "any"),
    "listen": GestureName("the head tilts and nods a little, the eyes on the viewer", 3),
})  # fmt: skip


def gesture_name(written: str) -> str | None:
    """The name of `GESTURES` that is written with spaces, hyphens or underscores, in any case; None for other words."""
    name = _SEPARATORS.sub("_", written.strip()).casefold()
    return name if name in GESTURES else None
