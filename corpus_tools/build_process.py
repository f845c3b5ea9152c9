"""Building of a talker from an uploaded recording, in a process with limits and without a network.

``python -m corpus_tools.build_process``, started by `tts2face.jobs.talker_job`: standard input holds one line of JSON,
fields of `BuildOrder`, and ends with the parent process; lines of JSON on standard output tell the progress (``stage``,
``done``, ``of``) and at last the result (``n_kept``, ``minutes``, ``refused``, ``warnings``, ``notes``) or the
``error`` and its ``message``.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from corpus_tools.build_talker import PROVENANCE, BuiltTalker, build_talker
from corpus_tools.message_lines import line_progress, write_line
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, Tts2faceError
from tts2face.child_process import received_order
from tts2face.jobs.refused_file import RefusedFileError
from tts2face.jobs.resource_check import TALKER, check_resource
from tts2face.limited_process import ProcessLimits, limit_process
from tts2face.models.consent import consent_record


@dataclass(frozen=True, slots=True)
class BuildOrder:
    """What is to be built.

    Parameters
    ----------
    folder
        Folder with the folder ``recordings``; gets ``made.talker``, the folder ``checked`` and perhaps ``report.html``.
    name, provenance
        Name of the talker, and fields of `corpus_tools.build_talker.read_provenance`.
    consent
        Statement of the person shown; with it the talker gets an own face.
    max_bytes
        Largest size of the talker.
    limits
        Of `ProcessLimits`.
    """

    folder: str
    name: str
    provenance: Mapping[str, str]
    consent: str | None
    with_appearance: bool
    with_report: bool
    max_bytes: float
    limits: Mapping[str, int]


def build(order: BuildOrder, out: TextIO) -> None:
    """Build a talker, then check and draw it as an upload; the progress is written to `out`."""
    folder = Path(order.folder)
    recordings = folder / "recordings"
    (recordings / PROVENANCE).write_text(json.dumps(dict(order.provenance)), encoding="utf-8")
    try:
        consent = consent_record(order.name, order.consent) if order.with_appearance else None
        built = build_talker(
            recordings,
            folder / "made.talker",
            name=order.name,
            consent=consent,
            report=folder / "report.html" if order.with_report else None,
            run_options=RunOptions(folder / "cache", 1),
            stages=lambda name: line_progress(out, name),
        )
        (folder / "checked").mkdir()
        check_resource(TALKER, folder / "made.talker", folder / "checked", order.max_bytes)
    except RefusedFileError as refused:
        write_line(out, {"error": DataError.__name__, "message": f"the talker cannot be used: {refused}"})
    except Tts2faceError as error:
        message = " ".join(str(error).replace(f"{recordings}/", "").split())
        write_line(out, {"error": type(error).__name__, "message": message})
    else:
        write_line(out, _result(built))


def _result(built: BuiltTalker) -> dict[str, Any]:
    return {
        "n_kept": built.n_kept,
        "minutes": round(built.minutes, 2),
        "refused": [[refusal.name, refusal.reason] for refusal in built.refused],
        "warnings": [[warning.name, warning.message] for warning in built.warnings],
        "notes": built.notes,
    }


def main() -> None:
    """Build one talker."""
    received, out = received_order()
    order = BuildOrder(**received)
    limit_process(ProcessLimits(**order.limits))
    build(order, out)
    os._exit(0)  # the thread that waits for the parent does not end


if __name__ == "__main__":
    main()
