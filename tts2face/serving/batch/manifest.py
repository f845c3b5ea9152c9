"""The manifest of a batch: every output with its cues, duration, fit, warnings, hash and time of work."""

import csv
import json
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from lexicon.errors import DataError
from lexicon.values.json_text import parse_json
from tts2face import __version__
from tts2face.serving.batch.content_address import file_hash
from tts2face.serving.batch.output import Output, Plan
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.storage.files import write_atomically
from tts2face.storage.signing import Signer

JSON_NAME, CSV_NAME = "manifest.json", "manifest.csv"
FORMAT = 1
SIGNED_BY = "signed_by"  # SHA-256 of the certificate in an entry
COLUMNS = (
    "file", "status", "source", "cues", "begin_s", "duration_s", "n_frames", "fps", "rate", "overflow_s", "cut_s",
    "overlap_s", "warnings", "sha256", "bytes", "took_s",
)  # fmt: skip


def read_manifest(folder: Path) -> dict[str, dict[str, Any]]:
    """Entries of a manifest by the name of their output; empty without one or if it is damaged."""
    try:
        content = parse_json((folder / JSON_NAME).read_text(encoding="utf-8"), JSON_NAME)
    # a damaged manifest is as none: outputs are joined again from stored segments
    except (OSError, UnicodeDecodeError, DataError):
        return {}
    entries = content.get("outputs") if isinstance(content, dict) else None
    if not isinstance(entries, list):
        return {}
    return {str(entry["file"]): entry for entry in entries if isinstance(entry, dict) and "file" in entry}


def read_segments(folder: Path) -> set[str]:
    """Addresses of all segments that the batch of a manifest uses."""
    path = folder / JSON_NAME
    try:
        content = parse_json(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as broken:
        raise DataError(f"cannot read {path} ({broken}); run the batch again, which writes it anew") from broken
    segments = content.get("segments") if isinstance(content, dict) else None
    if not isinstance(segments, list):
        raise DataError(f"{path} does not list its segments; run the batch again, which writes it anew")
    return set(map(str, segments))


def is_current(entry: Mapping[str, Any] | None, output: Output, folder: Path, signer: Signer | None = None) -> bool:
    """Whether a file is what the plan would make: its entry has the same address and signer, and the file its size."""
    # a failed output is tried again
    if entry is None or entry.get("address") != output.address or entry.get("status") != "done":
        return False
    if signed_entry(signer) != {name: entry[name] for name in (SIGNED_BY,) if name in entry}:
        return False
    files = {output.name: entry.get("bytes")} if output.suffix else {}
    files |= {
        str(export.get("file")): export.get("bytes") for export in entry.get("exports", ()) if isinstance(export, dict)
    }
    if not set(output.names) <= set(files):
        return False
    return all((folder / name).is_file() and (folder / name).stat().st_size == size for name, size in files.items())


def signed_entry(signer: Signer | None) -> dict[str, str]:
    """Part of the entry of an output that says who signed it; empty for nobody."""
    return {} if signer is None else {SIGNED_BY: signer.fingerprint}


def done_entry(
    output: Output, folder: Path, results: Sequence[SegmentResult], exports: Sequence[Path] = ()
) -> dict[str, Any]:
    """Entry of a finished output, whose files are in a folder."""
    n_frames = sum(result.n_frames for result in results)
    path = folder / output.name
    spoken = [(cue, results[cue.segment]) for cue in output.cues if cue.segment is not None]
    warnings = [f"cue {cue.number}: {text}" for cue, result in spoken for text in result.warnings]
    return _entry(output) | {
        "status": "done",
        "duration_s": round(n_frames / output.fps, 4),
        "n_frames": n_frames,
        "rate": max((result.rate for _, result in spoken), default=1.0),
        "overflow_s": max((result.overflow_s for _, result in spoken), default=0.0),
        "cut_s": max((result.cut_s for _, result in spoken), default=0.0),
        "overlap_s": max((result.overlap_s for _, result in spoken), default=0.0),
        "warnings": warnings,
        "sha256": file_hash(path),
        "bytes": path.stat().st_size,
        "took_s": round(sum(result.took_s for result in results), 3),
        **({"exports": [_file_entry(path) for path in exports]} if exports else {}),
        "cues": [
            _cue_entry(cue)
            | {name: getattr(result, name) for name in ("rate", "speech_s", "overflow_s", "cut_s", "overlap_s")}
            for cue, result in spoken
        ],
    }


def _file_entry(path: Path) -> dict[str, Any]:
    return {"file": path.name, "sha256": file_hash(path), "bytes": path.stat().st_size}


def failed_entry(output: Output, reason: str) -> dict[str, Any]:
    """Entry of an output that could not be made."""
    return _entry(output) | {"status": "failed", "reason": reason, "cues": [_cue_entry(cue) for cue in output.cues]}


def write_manifest(folder: Path, plan: Plan, entries: Mapping[str, Mapping[str, Any]]) -> None:
    """Write manifest.json and manifest.csv, with the outputs in the order of the plan."""
    ordered = [entries[output.name] for output in plan.outputs if output.name in entries]
    content = {
        "format": FORMAT,
        "program": f"tts2face {__version__}",
        "outputs": ordered,
        "n_cues": plan.n_cues,
        "n_silent_cues": plan.n_silent,
        "warnings": [
            {"file": warning.file, "line": warning.line, "message": warning.message} for warning in plan.warnings
        ],
        "segments": sorted(plan.segments),
    }
    if plan.notes:
        content["notes"] = [{"file": note.file, "line": note.line, "message": note.message} for note in plan.notes]
    write_atomically(folder / JSON_NAME, json.dumps(content, ensure_ascii=False, indent=1).encode())
    table = StringIO(newline="")
    rows = csv.writer(table)
    rows.writerow(COLUMNS)
    rows.writerows([_cell(name, entry.get(name, "")) for name in COLUMNS] for entry in ordered)
    write_atomically(folder / CSV_NAME, table.getvalue().encode())


def _cell(name: str, value: Any) -> Any:
    if name == "cues":
        return " ".join(str(cue["number"]) for cue in value)
    return "; ".join(map(str, value)) if isinstance(value, list) else value


def _entry(output: Output) -> dict[str, Any]:
    return {
        "file": output.name,
        "address": output.address,
        "source": list(output.source),
        "begin_s": round(output.begin_s, 4),
        "fps": output.fps,
    }


def _cue_entry(cue: Any) -> dict[str, Any]:
    return {
        "number": cue.number,
        "line": cue.line,
        "speaker": cue.speaker,
        "text": cue.text,
        "begin_s": round(cue.begin_s, 4),
        "end_s": round(cue.end_s, 4),
    }
