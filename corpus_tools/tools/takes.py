"""Work on one take of a person: a video, a Live Link Face table, or a photo.

Orders name the ``take``. ``check`` with a ``cache`` gives ``seconds`` and ``findings``, objects with ``severity`` and
``message``, refusals first. ``style`` with ``cache``, ``base``, ``name``, ``out`` writes the palette `base` with a new
style. ``capture`` with ``table`` and ``sound`` writes a video as a Live Link table, and its sound if it has any
(``has_sound``). ``film`` with ``sound`` and ``out`` renders a table with its sound, or null. ``avatar`` with ``out``
and ``max_bytes`` makes a head of the person in a photo, beside which is what is stated of it, checks it as an upload,
and writes it into the folder `out`.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from corpus_tools.build_palette import StyleSource, build_style
from corpus_tools.decomposition.take_check import check_gesture_take
from corpus_tools.dense.avatar import build_avatar
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError
from tts2face.models.palette_file import load_palette
from tts2face.processes.child import Call, Handler
from tts2face.serving.work.resource_check import FACE, RefusedFileError, check_resource, read_statement

NO_PROVENANCE = {"sources": "a take recorded in the studio"}


def _check(order: Mapping[str, Any], call: Call) -> dict[str, Any]:
    progress = call.stage("checking the take")
    found = check_gesture_take(Path(order["take"]), _options(order), lambda share: progress(round(100 * share), 100))
    return {
        "seconds": round(found.seconds, 2),
        "findings": [{"severity": finding.severity, "message": finding.message} for finding in found.findings],
    }


def _style(order: Mapping[str, Any], call: Call) -> dict[str, Any]:
    take = Path(order["take"])
    stated = take.with_name("provenance.json")
    stated.write_text(json.dumps(NO_PROVENANCE), encoding="utf-8")
    built = build_style(
        StyleSource(recordings=take, provenance=stated), order["name"], Path(order["out"]),
        base=load_palette(order["base"]), run_options=_options(order), stages=call.stage,
    )  # fmt: skip
    return {"seconds": round(60 * built.minutes, 2)}


def _capture(order: Mapping[str, Any], call: Call) -> dict[str, Any]:
    from tts2face.session.performance import Performance
    from tts2face.session.session import Session

    exports = [order["table"], order["sound"]]
    written = Session(palette=None).write_performance(
        Performance(take=Path(order["take"])), None, exports=exports, stages=call.stage
    )
    if written.is_silent:
        Path(order["sound"]).unlink()
    return {"seconds": round(written.seconds, 2), "has_sound": not written.is_silent}


def _film(order: Mapping[str, Any], call: Call) -> dict[str, Any]:
    from tts2face.session.performance import Performance
    from tts2face.session.session import Session

    sound = None if order["sound"] is None else Path(order["sound"])
    written = Session(palette=None).write_performance(
        Performance(take=Path(order["take"]), audio=sound), order["out"], stages=call.stage
    )
    return {"seconds": round(written.seconds, 2)}


def _avatar(order: Mapping[str, Any], call: Call) -> dict[str, Any]:
    photo, folder = Path(order["take"]), Path(order["out"])
    stated, made, notes = read_statement(photo), photo.with_name("avatar.face"), list[str]()
    progress = call.stage("making the head")
    progress(0, 2)
    given = {name: stated[name] for name in ("consent", "name", "eye_color", "age_keep", "no_glasses")}
    built = build_avatar([photo], made, **given, on_warning=notes.append)
    progress(1, 2)
    try:
        check_resource(FACE, made, folder, order["max_bytes"])
    except RefusedFileError as refused:
        raise DataError(f"the head cannot be used: {refused}") from refused
    return {"look": built.look.summary(), "notes": notes}


def _options(order: Mapping[str, Any]) -> RunOptions:
    return RunOptions(Path(order["cache"]), 1)


def _of_take(work: Callable[[Mapping[str, Any], Call], dict[str, Any]]) -> Handler:
    def handle(call: Call) -> dict[str, Any]:
        call.hide(Path(call.content["take"]).parent)
        return work(call.content, call)

    return handle


HANDLERS: Mapping[str, Handler] = MappingProxyType(
    {
        "check": _of_take(_check),
        "style": _of_take(_style),
        "capture": _of_take(_capture),
        "film": _of_take(_film),
        "avatar": _of_take(_avatar),
    }
)
