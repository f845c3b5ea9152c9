"""Running a plan: segments are rendered once, outputs are joined as soon as their segments are there."""

import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from lexicon.errors import BackendError, Tts2faceError
from tts2face.serving.batch.assemble import join_segments
from tts2face.serving.batch.engine import Engine, LocalEngine
from tts2face.serving.batch.export import Exporter
from tts2face.serving.batch.manifest import (
    CSV_NAME,
    JSON_NAME,
    done_entry,
    failed_entry,
    is_current,
    read_manifest,
    signed_entry,
    write_manifest,
)
from tts2face.serving.batch.output import Output, Plan
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import Store, open_store
from tts2face.storage.output_paths import refuse_overwriting
from tts2face.storage.signing import Signer
from tts2face.storage.temporary import Temporary
from tts2face.types import Progress

SEGMENT_FOLDER = ".segments"  # in the folder of outputs
MANIFEST_INTERVAL_S = 10.0  # between two writes while the batch runs
N_READ_AT_ONCE = 8  # results read at a time, as each takes some 50 ms in a bucket


@dataclass(frozen=True, slots=True)
class BatchResult:
    """Summary of a batch: outputs made now, left as they were, and failed with their reasons."""

    n_made: int
    n_current: int
    failed: tuple[tuple[str, str], ...]
    n_rendered: int
    seconds: float
    took_s: float
    warnings: tuple[str, ...] = ()


@dataclass(slots=True)
class _Run:
    """State of a running batch."""

    plan: Plan
    folder: Path
    store: Store
    entries: dict[str, dict[str, Any]]
    results: dict[str, SegmentResult] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    waiting: dict[str, set[str]] = field(default_factory=dict)  # addresses that an output still needs
    users: dict[str, list[Output]] = field(default_factory=dict)
    n_made: int = 0
    seconds: float = 0.0
    warnings: list[str] = field(default_factory=list)
    exporter: Exporter = field(default_factory=Exporter)
    signer: Signer | None = None


def run_batch(  # noqa: PLR0913 - one parameter a part of the run
    plan: Plan,
    out: Path | str,
    *,
    store: Store | None = None,
    engine: Engine | None = None,
    on_progress: Progress | None = None,
    on_output: Callable[[dict[str, Any]], None] | None = None,
    signer: Signer | None = None,
) -> BatchResult:
    """Make the outputs of a plan in a folder; outputs that are current are left as they are.

    Parameters
    ----------
    store
        Store of the segments; None: a hidden folder in `out`.
    engine
        What renders the segments; None: this process.
    on_progress
        Called with the number of segments done and of all segments that this run needs.
    on_output
        Called with the entry of the manifest of each output that was made or has failed.
    signer
        Who signs the outputs; those that somebody else has signed, or nobody, are made anew.

    Raises
    ------
    InputError
        An output would replace an input.
    BackendError
        The folder cannot be written.
    """
    began = time.perf_counter()
    folder = Path(out)
    _prepare_folder(folder)
    check_outputs(plan, folder)
    run = _Run(plan, folder, store or open_store(folder / SEGMENT_FOLDER), read_manifest(folder), signer=signer)
    write_manifest(folder, plan, run.entries)  # its list of segments keeps them from being pruned
    stale = [output for output in plan.outputs if not is_current(run.entries.get(output.name), output, folder, signer)]
    needed = {segment.address: segment for output in stale for segment in output.needed}
    for output in stale:
        run.waiting[output.name] = {segment.address for segment in output.needed}
        for address in run.waiting[output.name]:
            run.users.setdefault(address, []).append(output)
    missing = _find_missing(run, needed, on_output)
    done, written_at = len(needed) - len(missing), time.monotonic()
    by_models = dict(sorted(missing.items(), key=lambda item: repr(item[1].models)))  # a worker holds one session
    try:
        for rendered in (engine or LocalEngine()).render(by_models, run.store):
            _finish_segment(run, rendered.address, rendered.result, rendered.reason, on_output)
            done += 1
            if on_progress:
                on_progress(done, len(needed))
            if time.monotonic() - written_at > MANIFEST_INTERVAL_S:
                write_manifest(folder, plan, run.entries)
                written_at = time.monotonic()
    finally:  # also of an interrupted batch
        write_manifest(folder, plan, run.entries)
    failed = tuple(
        (output.name, str(run.entries[output.name].get("reason", "")))
        for output in stale
        if run.entries.get(output.name, {}).get("status") == "failed"
    )
    return BatchResult(
        run.n_made,
        len(plan.outputs) - len(stale),
        failed,
        len(missing) - len(run.reasons),
        run.seconds,
        time.perf_counter() - began,
        tuple(run.warnings),
    )


def _prepare_folder(folder: Path) -> None:
    """Create the folder of the outputs, and refuse one that cannot be written, before anything is rendered."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with Temporary(folder / JSON_NAME):
            pass
    except OSError as error:
        raise BackendError(f"cannot write the folder {folder}: {error.strerror}; choose another --out") from error


def _find_missing(
    run: _Run, needed: Mapping[str, Segment], on_output: Callable[[dict[str, Any]], None] | None
) -> dict[str, Segment]:
    """Segments that are to be rendered; those that are stored are noted."""
    missing = {}
    with ThreadPoolExecutor(N_READ_AT_ONCE) as pool:
        for (address, segment), found in zip(needed.items(), pool.map(run.store.result, needed), strict=True):
            if found is None:
                missing[address] = segment
            else:
                _finish_segment(run, address, found, "", on_output)
    if missing:
        run.store.check()
    return missing


def check_outputs(plan: Plan, folder: Path) -> None:
    """Refuse outputs that would replace subtitles or recordings."""
    sources = {path for output in plan.outputs for path in output.source}
    sources |= {
        str(segment.request["audio"])
        for output in plan.outputs
        for segment in output.segments
        if "audio" in segment.request
    }
    inputs = {Path(path).resolve() for path in sources}
    for name in [name for output in plan.outputs for name in output.names] + [JSON_NAME, CSV_NAME]:
        path = folder / name
        if path.exists() and path.resolve() in inputs:
            refuse_overwriting({name: path}, {"an input of the batch": path})


def _finish_segment(
    run: _Run,
    address: str,
    result: SegmentResult | None,
    reason: str,
    on_output: Callable[[dict[str, Any]], None] | None,
) -> None:
    """Note a segment, and make the outputs that need no other one."""
    if result is None:
        run.reasons[address] = reason
    else:
        run.results[address] = result
    for output in run.users.get(address, ()):
        run.waiting[output.name].discard(address)
        if not run.waiting[output.name]:
            _finish_output(run, output)
            if on_output:
                on_output(run.entries[output.name])


def _finish_output(run: _Run, output: Output) -> None:
    """Join the segments of an output, or note why it failed."""
    reasons = [run.reasons[segment.address] for segment in output.needed if segment.address in run.reasons]
    if reasons:
        run.entries[output.name] = failed_entry(output, reasons[0])
        return
    results = [run.results[segment.address] for segment in (output.segments if output.suffix else output.tracks)]
    try:
        with TemporaryDirectory(prefix="tts2face-") as copies:
            parts = {segment.address: run.store.fetch(segment.address, Path(copies)) for segment in output.needed}
            written = []
            if output.exports:
                written = run.exporter.write(
                    output, [parts[segment.address] for segment in output.tracks], run.folder, run.signer
                )
            if output.suffix:
                path = run.folder / output.name
                segments = [parts[segment.address] for segment in output.segments]
                join_segments(segments, path, output.fps, output.sounds, run.signer)
        entry = done_entry(output, run.folder, results, written) | signed_entry(run.signer)
    except Tts2faceError as wrong:
        run.entries[output.name] = failed_entry(output, str(wrong))
        return
    run.entries[output.name] = entry
    run.n_made += 1
    run.seconds += entry["duration_s"]
    run.warnings += [f"{output.name}, {warning}" for warning in entry["warnings"]]
