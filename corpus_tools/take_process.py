"""Work on one take of a person for the service and the studio, in a process with limits and without a network.

``python -m corpus_tools.take_process``, started by `tts2face.service.uploads.tool_process`: standard input holds one
line of JSON, an order, and ends with the parent process; lines of JSON on standard output tell the progress (``stage``,
``done``, ``of``) and at last the result, or the ``error`` and its ``message``. A take is a video, a Live Link Face
table, or a photo.

``{"kind": "check", "take", "cache"}`` gives ``seconds`` and ``findings``, objects with ``severity`` and ``message``,
refusals first. ``{"kind": "style", "take", "cache", "base", "name", "out"}`` writes the palette `base` with a style of
this name. ``{"kind": "capture", "take", "table", "sound"}`` writes a video as a Live Link table, and its sound if it
has any (``has_sound``). ``{"kind": "film", "take", "sound", "out"}`` renders a table with its sound, or null.
``{"kind": "avatar", "take", "out", "max_bytes"}`` makes a head of the person in a photo, beside which is what is stated
of it, checks it as an upload, and writes it into the folder `out`.
"""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from corpus_tools.build_palette import StyleSource, build_style
from corpus_tools.decomposition.gesture_take import check_gesture_take
from corpus_tools.dense.photo_avatar import build_avatar
from corpus_tools.message_lines import line_progress, write_line
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, Tts2faceError
from tts2face.child_process import received_order
from tts2face.jobs.refused_file import RefusedFileError
from tts2face.jobs.resource_check import FACE, check_resource, read_statement
from tts2face.limited_process import ProcessLimits, limit_process
from tts2face.models.palette import load_palette
from tts2face.types import Progress

LIMITS = ProcessLimits(memory_bytes=6 << 30, cpu_s=1800, file_bytes=1 << 30, n_files=256)
LOW_PRIORITY = 10
NO_PROVENANCE = {"sources": "a take recorded in the studio"}

Stages = Callable[[str], Progress]


def work(order: Mapping[str, Any], stages: Stages) -> dict[str, Any]:
    """Result of an order; errors as those of what it asks for."""
    return _KINDS[order["kind"]](order, stages)


def _check(order: Mapping[str, Any], stages: Stages) -> dict[str, Any]:
    progress = stages("checking the take")
    found = check_gesture_take(Path(order["take"]), _options(order), lambda share: progress(round(100 * share), 100))
    return {
        "seconds": round(found.seconds, 2),
        "findings": [{"severity": one.severity, "message": one.message} for one in found.findings],
    }


def _style(order: Mapping[str, Any], stages: Stages) -> dict[str, Any]:
    take = Path(order["take"])
    stated = take.with_name("provenance.json")
    stated.write_text(json.dumps(NO_PROVENANCE), encoding="utf-8")
    built = build_style(
        StyleSource(recordings=take, provenance=stated), order["name"], Path(order["out"]),
        base=load_palette(order["base"]), run_options=_options(order), stages=stages,
    )  # fmt: skip
    return {"seconds": round(60 * built.minutes, 2)}


def _capture(order: Mapping[str, Any], stages: Stages) -> dict[str, Any]:
    from tts2face.session import Session
    from tts2face.synthesis.performance import Performance

    exports = [order["table"], order["sound"]]
    written = Session(palette=None).write_performance(
        Performance(take=Path(order["take"])), None, exports=exports, stages=stages
    )
    if written.is_silent:
        Path(order["sound"]).unlink()
    return {"seconds": round(written.seconds, 2), "has_sound": not written.is_silent}


def _film(order: Mapping[str, Any], stages: Stages) -> dict[str, Any]:
    from tts2face.session import Session
    from tts2face.synthesis.performance import Performance

    sound = None if order["sound"] is None else Path(order["sound"])
    written = Session(palette=None).write_performance(
        Performance(take=Path(order["take"]), audio=sound), order["out"], stages=stages
    )
    return {"seconds": round(written.seconds, 2)}


def _avatar(order: Mapping[str, Any], stages: Stages) -> dict[str, Any]:
    photo, folder = Path(order["take"]), Path(order["out"])
    stated, made, notes = read_statement(photo), photo.with_name("avatar.face"), list[str]()
    progress = stages("making the head")
    progress(0, 2)
    built = build_avatar([photo], made, consent=stated["consent"], name=stated["name"], on_warning=notes.append)
    progress(1, 2)
    try:
        check_resource(FACE, made, folder, order["max_bytes"])
    except RefusedFileError as refused:
        raise DataError(f"the head cannot be used: {refused}") from refused
    return {"look": built.look.summary(), "notes": notes}


_KINDS: Mapping[str, Callable[[Mapping[str, Any], Stages], dict[str, Any]]] = {
    "check": _check, "style": _style, "capture": _capture, "film": _film, "avatar": _avatar,
}  # fmt: skip


def _options(order: Mapping[str, Any]) -> RunOptions:
    return RunOptions(Path(order["cache"]), 1)


def main() -> None:
    """Work on one order."""
    order, out = received_order()
    limit_process(replace(LIMITS, cpu_s=int(order.get("cpu_s", LIMITS.cpu_s))))
    os.nice(LOW_PRIORITY)  # streams go first
    try:
        result = work(order, lambda stage: line_progress(out, stage))
    except Tts2faceError as error:
        folder = str(Path(order["take"]).parent)
        message = " ".join(str(error).replace(f"{folder}/", "").split())
        result = {"error": type(error).__name__, "message": message}
    write_line(out, {"is_result": True, **result})
    os._exit(0)  # the thread that waits for the parent does not end


if __name__ == "__main__":
    main()
