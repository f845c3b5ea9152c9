"""A builder of talkers that does what the name of the talker says."""

import json
import sys
import time
from pathlib import Path

from corpus_tools.build_process import BuildOrder
from tests.model_files.made import write_made_talker


def main() -> None:
    order = BuildOrder(**json.loads(sys.stdin.readline()))
    sys.stdout.write(json.dumps({"stage": "reading recordings", "done": 1, "of": 2}) + "\n")
    sys.stdout.flush()
    if order.name == "dies":
        sys.exit(9)
    if order.name == "sleeps":
        time.sleep(600)
    checked = Path(order.folder) / "checked"
    checked.mkdir()
    write_made_talker(checked / "content", has_face=False)
    (checked / "description.json").write_text("{}")
    result = {
        "n_kept": 6,
        "minutes": 0.1,
        "refused": [["a", "too dark"]],
        "warnings": [["b", f"weakness {number}"] for number in range(30)],
        "notes": ["record more"],
    }
    sys.stdout.write(json.dumps(result) + "\n")


if __name__ == "__main__":
    main()
