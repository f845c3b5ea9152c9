"""A builder of talkers that does what the name of the talker says; the talker lies beside the folder of the order."""

import json
import os
import shutil
import time
from pathlib import Path
from typing import Any

from tts2face.processes.child import Call

MADE, ORDER = "made.talker", "order.json"  # files beside the folder


def build(call: Call) -> dict[str, Any]:
    order, folder = call.content, Path(call.content["folder"])
    (folder.parent / ORDER).write_text(json.dumps(order))
    call.stage("reading recordings")(1, 2)
    if order["name"] == "dies":
        os._exit(9)
    if order["name"] == "sleeps":
        time.sleep(600)
    (folder / "checked").mkdir()
    shutil.copyfile(folder.parent / MADE, folder / "checked" / "content")
    (folder / "checked" / "description.json").write_text("{}")
    return {
        "n_kept": 6,
        "minutes": 0.1,
        "refused": [["a", "too dark"]],
        "warnings": [["b", f"weakness {number}"] for number in range(30)],
        "notes": ["record more"],
    }


HANDLERS = {"talker": build}
