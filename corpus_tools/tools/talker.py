"""Building of a talker from an uploaded recording."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from corpus_tools.build_talker import build_talker
from corpus_tools.recordings.provenance import PROVENANCE
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError
from tts2face.models.consent import consent_record
from tts2face.processes.child import Call
from tts2face.serving.work.resource_check import TALKER, RefusedFileError, check_resource


@dataclass(frozen=True, slots=True)
class BuildOrder:
    """Order of a build.

    Parameters
    ----------
    folder
        Folder with the folder ``recordings``; gets ``made.talker``, the folder ``checked`` and, where matplotlib
        is, ``report.html``.
    name, provenance
        Name of the talker, and fields of `corpus_tools.recordings.provenance.read_provenance`.
    consent
        Statement of the person shown; with it the talker gets an own face.
    max_bytes
        Largest size of the talker.
    """

    folder: str
    name: str
    provenance: Mapping[str, str]
    consent: str | None
    with_appearance: bool
    max_bytes: float


def build(call: Call) -> dict[str, Any]:
    """Build a talker of a `BuildOrder`, then check and draw it as an upload.

    Returns
    -------
    dict
        ``n_kept``, ``minutes``, ``refused``, ``warnings``, and ``notes``.

    Raises
    ------
    InputError, DataError, BackendError
        As `build_talker`, or the talker cannot be used.
    """
    order = BuildOrder(**call.content)
    folder = Path(order.folder)
    recordings = folder / "recordings"
    call.hide(recordings)
    (recordings / PROVENANCE).write_text(json.dumps(dict(order.provenance)), encoding="utf-8")
    built = build_talker(
        recordings,
        folder / "made.talker",
        name=order.name,
        consent=consent_record(order.name, order.consent) if order.with_appearance else None,
        report=folder / "report.html" if find_spec("matplotlib") is not None else None,
        run_options=RunOptions(folder / "cache", 1),
        stages=call.stage,
    )
    (folder / "checked").mkdir()
    try:
        check_resource(TALKER, folder / "made.talker", folder / "checked", order.max_bytes)
    except RefusedFileError as refused:
        raise DataError(f"the talker cannot be used: {refused}") from refused
    return {
        "n_kept": built.n_kept,
        "minutes": round(built.minutes, 2),
        "refused": [[refusal.name, refusal.reason] for refusal in built.refused],
        "warnings": [[warning.name, warning.message] for warning in built.warnings],
        "notes": built.notes,
    }
