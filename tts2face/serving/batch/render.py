"""Rendering of one segment with the sessions of this process.

Requests for the recordings of segments: the words where the recording contains them, else the sound alone.
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any

import numpy as np

from lexicon.errors import DataError
from tts2face.interchange.exports.writer import ExportWriter, plan_exports
from tts2face.picture.film import MKV, ClipWriter
from tts2face.picture.options import Picture
from tts2face.picture.own_face import OwnFaceRenderer
from tts2face.picture.renderer import FrameRenderer
from tts2face.processes.child import Call, Handler
from tts2face.request import IDLE_LIMITS_S, Request
from tts2face.serving.batch.render_process import RENDER
from tts2face.serving.batch.segment import (
    ALPHA_MOVIE,
    FILE_PREFIX,
    TRACK,
    Segment,
    SegmentResult,
    open_track,
    segment_from_json,
)
from tts2face.serving.batch.windows import Fit, Limits, fit_speech
from tts2face.session.functions import SessionCache
from tts2face.session.session import Session
from tts2face.sound.pauses import speech_onset
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.temporary import Temporary
from tts2face.types import SOUND_RATE, Waveform, exact_rate, first_sample, frame_count

ONSET_S = 60  # of a recording of a cue, within which its first sound lies


@contextmanager
def excerpt_of(segment: Segment, request: Request) -> Iterator[Request]:
    """The request of a segment, with its lead, or with its part of a recording as a temporary file."""
    fps = exact_rate(request.fps)
    if request.audio is None:
        yield request if segment.lead_frames is None else replace(request, lead=float(segment.lead_frames / fps))
        return
    if segment.audio_begin is None and segment.lead_frames is None:
        yield request
        return
    track = open_track(request.audio)
    begin, end = segment.audio_begin, segment.audio_end
    if begin is None:
        heard = Waveform(track.read(0, min(track.n_samples, ONSET_S * SOUND_RATE)) / np.float32(32768), SOUND_RATE)
        begin = round(speech_onset(heard) * SOUND_RATE) - first_sample(segment.lead_frames or 0, SOUND_RATE, fps)
        end = track.n_samples
        if not heard.samples.any():  # it is refused by its name
            yield request
            return
    with TemporaryDirectory(prefix="tts2face-") as folder:
        path = Path(folder) / f"{request.audio.stem}.wav"
        track.write_excerpt(path, begin, end)
        yield replace(request, audio=path)


def fit_recording(session: Session, request: Request, segment: Segment) -> tuple[Request, float, list[str]]:
    """A request that can be synthesised, seconds of its sound, and warnings.

    An excerpt of a dubbing track may contain other words than the subtitles, or none: then lips follow the sound, or
    rest.

    Raises
    ------
    InputError, DataError, BackendError
        As `Session.stream`; of an excerpt only where the recording cannot be read.
    """
    try:
        pieces = list(session.stream(request))
    except DataError as wrong:
        if segment.audio_begin is None:
            raise
        if request.text.strip():
            return _without_words(session, request, segment)
        seconds = segment.window_frames / float(exact_rate(request.fps))
        idle = replace(request, audio=None, idle=max(seconds, IDLE_LIMITS_S[0]))
        return idle, 0.0, [f"the recording has no speech here ({_reason(wrong)})"]
    found = [f"{' '.join(one.words)!r}" for piece in pieces for one in piece.mismatches]
    if found and segment.audio_begin is not None:
        return _without_words(session, request, segment)
    warnings = [f"the recording probably does not contain {', '.join(found)}"] if found else []
    return request, sum(piece.clip.speech.waveform.duration for piece in pieces), warnings


def _without_words(session: Session, request: Request, segment: Segment) -> tuple[Request, float, list[str]]:
    words = request.text
    wordless, seconds, warnings = fit_recording(session, replace(request, text=""), segment)
    if wordless.idle is None:
        warnings = [f"the recording contains other words than {words[:40]!r}; lips follow its sound", *warnings]
    return wordless, seconds, warnings


def _reason(error: DataError) -> str:
    """A reason without the path of the temporary file."""
    return "it is silent" if "silent" in str(error) else str(error).rpartition("/")[2]


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
        round(max(fit.speech_s - (segment.lead_frames or 0) / float(fps), 0.0), 4),
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


@lru_cache(maxsize=1)
def _renderer() -> "SegmentRenderer":

    return SegmentRenderer()


def _render(call: Call) -> dict[str, Any]:
    return _renderer().render(segment_from_json(call.content["segment"]), Path(call.content["out"])).as_json()


HANDLERS: Mapping[str, Handler] = MappingProxyType({RENDER: _render})
