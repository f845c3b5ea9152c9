"""A builder of talkers that does what the name of the talker says."""

import os
import time
from pathlib import Path
from typing import Any

from corpus_tools.tools.talker import BuildOrder
from tests.models.made import write_made_talker
from tts2face.processes.child import Call


def build(call: Call) -> dict[str, Any]:
    order = BuildOrder(**call.content)
    call.stage("reading recordings")(1, 2)
    if order.name == "dies":
        os._exit(9)
    if order.name == "sleeps":
        time.sleep(600)
    checked = Path(order.folder) / "checked"
    checked.mkdir()
    write_made_talker(checked / "content", has_face=False)
    (checked / "description.json").write_text("{}")
    return {
        "n_kept": 6,
        "minutes": 0.1,
        "refused": [["a", "too dark"]],
        "warnings": [["b", f"weakness {number}"] for number in range(30)],
        "notes": ["record more"],
    }


HANDLERS = {"talker": build}
