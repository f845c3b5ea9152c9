"""Report of a plan: its speakers, and for each line the rate and what of it ends late or is not spoken."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.serving.batch.lines import LineSettings, write_lines
from tts2face.serving.batch.output import Plan, PlannedLine
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.speakers import Casting, shown_name, spoken_voice
from tts2face.serving.batch.store import Store
from tts2face.session.named_models import Models
from tts2face.types import Progress

CHANGED = 0.005  # of the rate, from which it is another one


@dataclass(frozen=True, slots=True)
class PlannedSpeaker:
    """Lines of one speaker that are spoken, and how; `role` is the number in the cast, None without one.

    `n_silent` counts lines that are not spoken, besides.
    """

    name: str
    n_lines: int
    role: int | None
    face: str
    voice: str
    n_silent: int = 0


def planned_speakers(plan: Plan) -> tuple[PlannedSpeaker, ...]:
    """Speakers of a plan, those with most lines first, also those who are silent."""
    found: dict[tuple[str, int | None, str, str], list[bool]] = {}
    for line in plan.lines:
        key = (
            shown_name(line.speaker, line.casting),
            line.casting.role,
            shown_face(line.casting.models),
            _voice(line.casting),
        )
        found.setdefault(key, []).append(line.segment is not None)
    speakers = [
        PlannedSpeaker(name, sum(spoken), role, face, voice, len(spoken) - sum(spoken))
        for (name, role, face, voice), spoken in found.items()
    ]
    return tuple(sorted(speakers, key=lambda speaker: -speaker.n_lines))


def shown_face(models: Models) -> str:
    """Face of a speaker, with its identity if it has one."""
    return f"{models.face} {models.identity}" if models.identity else models.face


def _voice(casting: Casting) -> str:
    return spoken_voice(casting.models, casting.request).described


def measure_plan(
    plan: Plan, store: Store | None = None, on_progress: Progress | None = None
) -> dict[str, SegmentResult]:
    """Fits of the lines of a plan by the addresses of their segments: stored ones, else speech is made and measured.

    Nothing is drawn or written. A segment that cannot be made is missing; it fails when it is rendered.
    """
    from tts2face.serving.batch.render import SegmentRenderer

    renderer, found = SegmentRenderer(), dict[str, SegmentResult]()
    segments = {line.segment.address: line.segment for line in plan.lines if line.segment is not None}
    # by models: a renderer holds one session at a time
    for done, segment in enumerate(sorted(segments.values(), key=lambda segment: repr(segment.models)), start=1):
        result = _fit_of(segment, store, renderer)
        if result is not None:
            found[segment.address] = result
        if on_progress:
            on_progress(done, len(segments))
    return found


def _fit_of(segment: Segment, store: Store | None, renderer: Any) -> SegmentResult | None:
    stored = None if store is None else store.result(segment.address)
    if stored is not None:
        return stored
    try:
        fit: SegmentResult = renderer.measure(segment)
    except Tts2faceError:
        return None
    return fit


@dataclass(frozen=True, slots=True)
class RateSummary:
    """Numbers of lines: spoken, faster and slower than asked for, ending late, sounding on, and cut."""

    n_lines: int
    n_faster: int
    n_slower: int
    n_over_limit: int
    n_overlapping: int
    n_cut: int


def summarise(plan: Plan, results: Mapping[str, SegmentResult]) -> RateSummary:
    """Numbers of the lines of a plan whose fits are known."""
    rated = [
        (result, line.casting.usual_rate, max(line.segment.max_rate, line.settings.rate or 0.0))
        for line, result in fitted_lines(plan, results)
        if line.segment is not None
    ]
    return RateSummary(
        len(rated),
        sum(result.rate > rate + CHANGED for result, rate, _ in rated),
        sum(result.rate < rate - CHANGED for result, rate, _ in rated),
        sum(result.rate > max(rate, limit) + CHANGED for result, rate, limit in rated),
        sum(result.overlap_s > 0.0 for result, _, _ in rated),
        sum(result.cut_s > 0.0 for result, _, _ in rated),
    )


def fitted_lines(plan: Plan, results: Mapping[str, SegmentResult]) -> Iterator[tuple[PlannedLine, SegmentResult]]:
    """Spoken lines whose fits are known."""
    for line in plan.lines:
        if line.segment is not None and line.segment.address in results:
            yield line, results[line.segment.address]


def line_notes(line: PlannedLine, result: SegmentResult) -> list[str]:
    """Notes of what is unusual with a line: its rate, what a table sets, and warnings of its fit."""
    is_set, offset = line.settings.rate is not None, line.settings.offset_s
    notes = [f"offset {offset:+g} s", *result.warnings] if offset else list(result.warnings)
    if notes or is_set or abs(result.rate - line.casting.usual_rate) >= CHANGED:
        notes.insert(0, f"rate {result.rate:.2f}" + " from the table of lines" * is_set)
    return notes


def write_table(path: Path, plan: Plan, results: Mapping[str, SegmentResult]) -> None:
    """Write the table of the lines of a plan with their fits; errors as `write_lines`."""
    write_lines(path, line_rows(plan, results))


def line_rows(plan: Plan, results: Mapping[str, SegmentResult]) -> Iterator[dict[str, Any]]:
    """Rows of the table of lines: what was set for each, and how it is spoken."""
    for line in plan.lines:
        row: dict[str, Any] = {
            "file": line.file,
            "cue": line.number,
            "part": line.part or "",
            "begin_s": f"{line.begin_s:.3f}",
            "end_s": f"{line.end_s:.3f}",
            "speaker": line.speaker,
            "text": line.text,
            **_set(line.settings),
            "face": shown_face(line.casting.models),
            "used_voice": _voice(line.casting),
        }
        if line.segment is not None and (result := results.get(line.segment.address)) is not None:
            fit = ("speech_s", "overflow_s", "overlap_s", "cut_s")
            row |= {"used_rate": f"{result.rate:.3f}", **{name: f"{getattr(result, name):.3f}" for name in fit}}
        yield row


def _set(settings: LineSettings) -> dict[str, str]:
    """Cells of the settings of a line, as they are read."""
    spoken = {None: "", True: "yes", False: "no"}[settings.is_spoken]
    rate = "" if settings.rate is None else f"{settings.rate:g}"
    offset = f"{settings.offset_s:g}" if settings.offset_s else ""
    return {"spoken": spoken, "rate": rate, "voice": settings.voice or "", "offset_s": offset}
