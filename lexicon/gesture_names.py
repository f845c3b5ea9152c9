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
    """What a gesture shows, and which directions it has: none, a side, or any."""

    shown: str
    directions: Literal["none", "side", "any"] = "none"


GESTURES: Mapping[str, GestureName] = MappingProxyType({
    "nod": GestureName("the head goes down and up again"),
    "shake": GestureName("the head turns from side to side"),
    "tilt": GestureName("the head leans to a side", "side"),
    "look_away": GestureName("eyes and head turn away from the viewer", "any"),
    "look_at": GestureName("eyes and head turn to the viewer, or where a direction says", "any"),
    "wink": GestureName("one eye shuts, with the cheek below it", "side"),
    "blink": GestureName("both eyes shut and open"),
    "brows_up": GestureName("the brows rise"),
    "brows_together": GestureName("the brows come together and down"),
    "smile": GestureName("a smile, of lips, cheeks and eyes"),
    "frown": GestureName("the brows come together, the corners of the mouth go down"),
    "laugh": GestureName("a laugh without sound: mouth, cheeks, lids and head"),
    "sigh": GestureName("a deep breath: head and lids rise and sink"),
    "surprise": GestureName("the brows rise, the lids open wide, the jaw drops a little"),
    "think": GestureName("the eyes go up and aside, the brows together", "any"),
    "listen": GestureName("the head tilts and nods a little, the eyes on the viewer"),
})  # fmt: skip


def gesture_name(written: str) -> str | None:
    """The name of `GESTURES` that is written with spaces, hyphens or underscores, in any case; None for other words."""
    name = _SEPARATORS.sub("_", written.strip()).casefold()
    return name if name in GESTURES else None
