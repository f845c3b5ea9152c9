"""Rendering of one segment with the sessions of this process."""

import time
from dataclasses import replace
from pathlib import Path

from tts2face.batch.fit import Fit, Limits, fit_speech
from tts2face.batch.render_recording import excerpt_of, fit_recording
from tts2face.batch.segment import ALPHA_MOVIE, FILE_PREFIX, TRACK, Segment
from tts2face.batch.segment_result import SegmentResult
from tts2face.clock import exact_rate
from tts2face.exports.writer import ExportWriter, plan_exports
from tts2face.render.encode import MKV, ClipWriter
from tts2face.render.own_face import OwnFaceRenderer
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.request import Request
from tts2face.session import Session
from tts2face.session_cache import SessionCache
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.temporary import Temporary
from tts2face.types import frame_count


class SegmentRenderer:
    """Renders segments with one session at a time: work comes sorted by its models."""

    def __init__(self) -> None:
        self._sessions = SessionCache()

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        """Render a segment into a file, which appears when it is complete.

        Raises
        ------
        InputError, DataError, BackendError
            As `Session.write`.
        """
        began = time.perf_counter()
        session = self._sessions.get(segment.models)
        if segment.medium.startswith(FILE_PREFIX):
            return replace(_write_file(session, segment, out), took_s=round(time.perf_counter() - began, 3))
        with excerpt_of(segment, Request(**segment.request)) as request:
            fitted, result = _fit(session, request, segment)
            with _writer(session, segment, fitted, (out, result.n_frames)) as writer:
                for clip in session.stream_to_length(fitted, result.n_frames):
                    writer.add(clip)
        return replace(result, took_s=round(time.perf_counter() - began, 3))


def _write_file(session: Session, segment: Segment, out: Path) -> SegmentResult:
    """Write a whole clip in the format of a segment's medium."""
    request, seconds = Request(**segment.request), 0.0
    format = segment.medium.removeprefix(FILE_PREFIX)
    with translate_disk_errors(out), Temporary(out) as temporary:
        with temporary.path.open("wb") as file:
            for chunk in session.stream_file(request, format, picture=Picture(**segment.picture)):
                file.write(chunk.content)
                seconds += chunk.seconds
        temporary.replace(out)
    fps = float(exact_rate(request.fps))
    return SegmentResult(frame_count(max(seconds, 1e-3), fps), fps, request.rate, round(seconds, 4))


def _writer(
    session: Session, segment: Segment, request: Request, target: tuple[Path, int]
) -> ClipWriter | ExportWriter:
    """Writer of the medium of a segment into a path, for a number of frames."""
    out, n_frames = target
    if segment.medium == TRACK:
        return ExportWriter(plan_exports([out], format=TRACK))
    renderer: FrameRenderer = session.renderer(Picture(**segment.picture), has_gestures=request.has_gestures)
    if isinstance(renderer, OwnFaceRenderer):
        renderer = replace(renderer, n_returning=n_frames)
    return ClipWriter(out, renderer, kind=MKV if segment.medium == ALPHA_MOVIE else None)


def _fit(session: Session, request: Request, segment: Segment) -> tuple[Request, SegmentResult]:
    """The request with its fitted text and rate, and the length of the segment."""
    fps = exact_rate(request.fps)
    window_s = float(segment.window_frames / fps)
    if request.idle is not None:
        return request, SegmentResult(segment.slot_frames or segment.window_frames, float(fps))
    heard: list[str] = []
    if request.audio is not None:
        request, spoken, heard = fit_recording(session, request, segment)
        spoken = min(spoken, window_s) if segment.audio_begin is not None else spoken
        fit = Fit(request.text, 1.0, spoken, max(0.0, spoken - window_s), 1)
    else:
        slot_s = None if segment.slot_frames is None else float(segment.slot_frames / fps)
        limits = Limits(window_s, slot_s, request.rate, segment.max_rate, segment.overflow)
        fit = fit_speech(
            request.text, limits, lambda text, rate: session.measure_speech(replace(request, text=text, rate=rate))
        )
        request = replace(request, text=fit.text, rate=fit.rate)
    n_frames, warnings = _length(segment, fit, float(fps))
    cut = max(0.0, fit.speech_s - n_frames / float(fps))
    if cut > 0:
        warnings.append(f"the last {cut:.2f} s of the speech are cut off by the next cue")
    result = SegmentResult(
        n_frames,
        float(fps),
        fit.rate,
        round(fit.speech_s, 4),
        round(fit.overflow_s, 4),
        round(cut, 4),
        (*heard, *warnings),
    )
    return request, result


def _length(segment: Segment, fit: Fit, fps: float) -> tuple[int, list[str]]:
    """Frames of a segment, and warnings of its fit."""
    warnings = []
    if fit.overflow_s > 1.0 / fps:
        warnings.append(f"the speech is {fit.overflow_s:.2f} s longer than its cue at rate {fit.rate:.2f}")
    if fit.rate > segment.max_rate + 1e-6:
        warnings.append(f"the rate {fit.rate:.2f} exceeds {segment.max_rate:g}, as the next cue begins")
    if segment.fills_slot and segment.slot_frames is not None:
        return segment.slot_frames, warnings
    return max(segment.window_frames, frame_count(max(fit.speech_s, 1e-3), fps)), warnings
