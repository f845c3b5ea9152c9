"""The edits and elements of a timeline as a JavaScript module, which the components of the pages import.

``python -m tts2face.serving.studio.protocol`` writes it.
"""

import json
from pathlib import Path
from typing import Any

from lexicon.gesture_names import DIRECTIONS, GESTURES
from lexicon.marked_text import GESTURE_SIZE_LIMITS
from tts2face.gestures.elements import CHANNEL_OFFSET_LIMITS, EXPRESSION_WEIGHT_LIMITS, GAIN_LIMITS, GAZE_LIMITS_DEG
from tts2face.gestures.kinds import KINDS
from tts2face.models.palette import EXPRESSIONS, FEATURES
from tts2face.serving.studio.editing import EDITS, MIN_PHONE_S
from tts2face.types import HEAD_CHANNELS

MODULE = Path(__file__).parent / "components" / "protocol.js"
LIMITS = {  # of the values of elements: of keys, of both angles of the gaze, of the size of a gesture
    "strengths": GAIN_LIMITS, "curves": EXPRESSION_WEIGHT_LIMITS, "edits": CHANNEL_OFFSET_LIMITS,
    "gaze": GAZE_LIMITS_DEG, "gestures": GESTURE_SIZE_LIMITS,
}  # fmt: skip
HEAD = """// Edits and elements of a timeline as the server has them, made of its tables by
// `python -m tts2face.serving.studio.protocol`: change those, and run it again.
"""


def protocol_module() -> str:
    """Text of the module."""
    names = {
        "FEATURES": FEATURES,
        "EXPRESSIONS": EXPRESSIONS,
        "HEAD_CHANNELS": HEAD_CHANNELS,
        "GESTURES": {name: gesture.directions for name, gesture in GESTURES.items()},
        "DIRECTIONS": DIRECTIONS,
        "LEAST_PHONE_S": MIN_PHONE_S,
    }
    constants = "".join(f"export const {name} = {json.dumps(value, default=dict)};\n" for name, value in names.items())
    kinds = "".join(f"  {name}: {_object(_element_kind(name))},\n" for name in KINDS)
    edits = "".join(f"  {name}: {_maker(name)},\n" for name in EDITS)
    return (
        f"{HEAD}\n{constants}\n"
        "/** Elements: shape, field that names a lane, edits that add and remove one, limits of values. */\n"
        f"export const KINDS = {{\n{kinds}}};\n\n"
        "/** Edits of their fields. */\n"
        f"export const EDITS = {{\n{edits}}};\n"
    )


def _element_kind(name: str) -> dict[str, Any]:
    adding = next((edit for edit, kind in EDITS.items() if kind.adds == name), None)
    removing = next((edit for edit, kind in EDITS.items() if kind.removes == name), None)
    found = {"shape": KINDS[name].shape, "owner": KINDS[name].owner, "add": adding, "remove": removing}
    return found | ({"limits": LIMITS[name]} if name in LIMITS else {})


def _object(values: dict[str, Any]) -> str:
    return "{ " + ", ".join(f"{name}: {json.dumps(value)}" for name, value in values.items()) + " }"


def _maker(edit: str) -> str:
    """Function that makes an edit of its fields."""
    fields = ", ".join(EDITS[edit].fields)
    return f"({{ {fields} }}) => ({{ kind: {json.dumps(edit)}, {fields} }})"


if __name__ == "__main__":
    MODULE.write_text(protocol_module(), encoding="utf-8")
