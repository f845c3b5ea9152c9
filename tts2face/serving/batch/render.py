"""Rendering of one segment with the sessions of this process."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from lexicon.sentence_length import n_letters
from lexicon.sentences import text_prefix
from tts2face.interchange.exports.writer import ExportWriter, plan_exports
from tts2face.models.face_loading import load_face
from tts2face.picture.film import MKV, ClipWriter
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.options import Picture
from tts2face.picture.own_face import OwnFaceRenderer
from tts2face.picture.renderer import MeshRenderer, before_studio
from tts2face.processes.child import Call, Handler
from tts2face.request import DRAWN_FACE, Idle, Recorded, Request, Spoken
from tts2face.serving.batch.fit import EASY_S, RELEASE_S, Fit, Limits, Room, fit_speech, without_overlap
from tts2face.serving.batch.options import REPORT
from tts2face.serving.batch.recorded_segment import excerpt_of, fit_recording
from tts2face.serving.batch.render_process import RENDER
from tts2face.serving.batch.segment import ALPHA_MOVIE, FILE_PREFIX, TRACK, CuePart, Segment, segment_from_json
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.session.joining import Excerpt, fade_out
from tts2face.session.prepared import PreparedRequest, prepare
from tts2face.session.session import Session
from tts2face.session.session_cache import SessionCache
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.temporary import Temporary
from tts2face.types import Clip, Speech, Waveform, concatenate_clips, exact_rate, frame_count
from tts2face.video.media import read_sound


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
            fitted, result = fit_segment(session, request, segment)
            with _writer(session, segment, fitted, (out, result.n_frames)) as writer:
                for clip in session.stream_to_length(fitted, result.n_frames):
                    writer.add(clip)
                if segment.fills_slot and segment.audio_begin is None and result.speech_s > 0.0:
                    _add_overlap(session, fitted, writer, clip, _span_after(segment, result))
        return replace(result, took_s=round(time.perf_counter() - began, 3))

    def measure(self, segment: Segment) -> SegmentResult:
        """The result of `render` without a picture or motion: the fit of the speech; errors as there."""
        session = self._sessions.get(segment.models)
        with excerpt_of(segment, Request(**segment.request)) as request:
            return fit_segment(session, request, segment)[1]


def _span_after(segment: Segment, result: SegmentResult) -> tuple[float, float]:
    """Seconds of a segment from the end of its frames to that of its sound."""
    end = result.speech_s + (segment.lead_frames or 0) / result.fps + RELEASE_S
    frames_s = result.n_frames / result.fps
    return frames_s, min(end, frames_s + segment.silence_s + result.overlap_s + RELEASE_S)


def _add_overlap(
    session: Session, fitted: PreparedRequest, writer: ClipWriter | ExportWriter, last: Clip, span: tuple[float, float]
) -> None:
    """Append the sound of a span after a segment's frames, whose last clip is given; a track shows rest with it."""
    if span[0] >= span[1]:
        return
    source = fitted.request.source
    if not isinstance(source, Recorded):
        whole = concatenate_clips([piece.clip for piece in session.stream_speech(fitted)]).speech.waveform
    else:
        whole = read_sound(source.audio, last.speech.waveform.rate)
    sound = whole.part(*(round(seconds * whole.rate) for seconds in span))
    if not len(sound.samples):
        return
    sound = Waveform(sound.samples * fade_out(len(sound.samples), sound.rate), sound.rate)
    if isinstance(writer, ClipWriter):
        writer.add_sound(sound.samples)
        return
    n_frames, shown = frame_count(sound.duration, last.fps), (last.motion, last.head)
    motion, head = (replace(track, values=np.repeat(track.values[-1:], n_frames, axis=0)) for track in shown)
    writer.add(Clip(motion, head, Speech.without_phones(sound)))


def _write_file(session: Session, segment: Segment, out: Path) -> SegmentResult:
    """Write a whole clip in the format of a segment's medium."""
    request, seconds = Request(**segment.request), 0.0
    format = segment.medium.removeprefix(FILE_PREFIX)
    with translate_disk_errors(out), Temporary(out) as temporary:
        with temporary.path.open("wb") as file:
            for chunk in session.stream_file(request, format, picture=Picture(**segment.picture), is_complete=True):
                file.write(chunk.content)
                seconds += chunk.seconds
        temporary.replace(out)
    fps = float(exact_rate(request.fps))
    rate = 1.0 if request.spoken is None else request.spoken.rate
    return SegmentResult(frame_count(max(seconds, 1e-3), fps), fps, rate, round(seconds, 4))


def _writer(
    session: Session, segment: Segment, prepared: PreparedRequest, target: tuple[Path, int]
) -> ClipWriter | ExportWriter:
    """Writer of the medium of a segment into a path, for a number of frames."""
    out, n_frames = target
    if segment.medium == TRACK:
        return ExportWriter(plan_exports([out], format=TRACK))
    renderer: FrameRenderer = session.renderer(Picture(**segment.picture), has_gestures=prepared.request.has_gestures)
    if isinstance(renderer, OwnFaceRenderer):
        renderer = replace(renderer, n_returning=n_frames)
    if isinstance(renderer, MeshRenderer):
        renderer = before_studio(renderer, load_face(DRAWN_FACE).light)
    kind = MKV if segment.medium == ALPHA_MOVIE else None
    return ClipWriter(out, renderer, kind=kind, making=session.making(prepared))


def fit_segment(session: Session, request: Request, segment: Segment) -> tuple[PreparedRequest, SegmentResult]:
    """The request with its fitted text and rate, and the length of the segment; errors as `SegmentRenderer.render`."""
    source = request.source
    if isinstance(source, Idle):
        n_frames = segment.slot_frames or segment.window_frames
        return prepare(request), SegmentResult(n_frames, float(exact_rate(request.fps)))
    if isinstance(source, Recorded):
        return _fit_recorded(session, request, segment)
    assert isinstance(source, Spoken)
    speech = SegmentSpeech(session, request, source, segment)
    fit = fit_speech(source.text, speech.limits, speech.ends)
    prepared, kept, lost = speech.kept(fit)
    n_frames, warnings = _length(segment, kept, speech.fps)
    if lost:
        warnings.append(f"{lost!r} is not spoken, {_why(segment)}")
    elif kept.overlap_s > 0.0:
        warnings.append(f"the last {kept.overlap_s:.2f} s of the speech sound on after the next cue has begun")
    cut = max(0.0, fit.speech_s - kept.speech_s)
    return prepared, _result(segment, kept, (n_frames, speech.fps), cut, [*prepared.notes, *warnings])


def _fit_recorded(session: Session, request: Request, segment: Segment) -> tuple[PreparedRequest, SegmentResult]:
    """A recording keeps its rate; what does not fit sounds on, and beyond the limit is cut off."""
    fps = float(exact_rate(request.fps))
    window_s = segment.window_frames / fps
    request, spoken, heard = fit_recording(session, request, segment)
    spoken = min(spoken, window_s) if segment.audio_begin is not None else spoken
    fit = Fit(request.source.text, 1.0, spoken, max(0.0, spoken - window_s))
    n_frames, warnings = _length(segment, fit, fps)
    late = max(0.0, spoken - n_frames / fps)
    cut = max(0.0, late - segment.max_overlap)
    overlap = max(0.0, late - cut - segment.silence_s)
    if cut > 0.0:
        warnings.append(f"the last {cut:.2f} s of the speech are cut off, {_why(segment)}")
    if overlap > 0.0:
        warnings.append(f"{overlap:.2f} s of the speech sound on after the next cue has begun")
    fit = replace(fit, overlap_s=overlap)
    prepared = session.prepare(request)
    return prepared, _result(segment, fit, (n_frames, fps), cut, [*heard, *prepared.notes, *warnings])


def _result(
    segment: Segment, fit: Fit, length: tuple[int, float], cut: float, warnings: Sequence[str]
) -> SegmentResult:
    speech_s = max(fit.speech_s - (segment.lead_frames or 0) / length[1], 0.0)
    return SegmentResult(
        *length,
        fit.rate,
        round(speech_s, 4),
        round(fit.overflow_s, 4),
        round(cut, 4),
        tuple(warnings),
        overlap_s=round(fit.overlap_s, 4),
    )


def _length(segment: Segment, fit: Fit, fps: float) -> tuple[int, list[str]]:
    """Frames of a segment, and warnings of its fit."""
    warnings = []
    if fit.overflow_s > (1.0 / fps if segment.overflow == REPORT else EASY_S):
        warnings.append(f"the speech is {fit.overflow_s:.2f} s longer than its cue at rate {fit.rate:.2f}")
    # beyond the limit only where nothing else made room (decision 208)
    if fit.rate > max(segment.max_rate, float(segment.request.get("rate", 1.0))) + 1e-6:
        warnings.append(f"the rate {fit.rate:.2f} exceeds {segment.max_rate:g}, {_why(segment)}")
    if segment.fills_slot and segment.slot_frames is not None:
        return segment.slot_frames, warnings
    # a clip has a frame at least
    return max(segment.window_frames, frame_count(max(fit.speech_s, 1e-3), fps)), warnings


def _why(segment: Segment) -> str:
    """Why speech is cut or hurried."""
    return "as its time ends" if segment.silence_s else "as the next cue begins"


class SegmentSpeech:
    """The words of a segment as a voice speaks them, with those of the whole sentence if it runs over several cues."""

    def __init__(self, session: Session, request: Request, spoken: Spoken, segment: Segment) -> None:
        self.fps = float(exact_rate(request.fps))
        self._session, self._segment = session, segment
        self._request, self._spoken = request, spoken
        self._text = session.prepare(request).text.text  # without marks
        own = CuePart(n_letters(self._text), segment.window_frames, segment.slot_frames, segment.lead_frames or 0)
        self._parts = segment.parts or (own,)

    @property
    def limits(self) -> Limits:
        """Limits of the fit."""
        segment = self._segment
        last = len(self._parts) - 1
        rooms = tuple(
            Room(
                part.window_frames / self.fps,
                None if part.slot_frames is None else part.slot_frames / self.fps,
                segment.max_overlap,
                segment.is_shared or at < last,
                RELEASE_S if at == last else 0.0,
                segment.silence_s if at == segment.part else 0.0,
            )
            for at, part in enumerate(self._parts)
        )
        rates = self._spoken.rate, segment.min_rate, segment.max_rate
        return Limits(rooms, *rates, segment.overflow, segment.part)

    def ends(self, text: str, rate: float) -> list[float]:
        """Ends of the parts of a text at a rate, in seconds of their segments."""
        spoken = replace(self._spoken, text=text, rate=rate)
        return [self._session.measure_speech(self._prepared(spoken, at)).end for at in range(len(self._parts))]

    def kept(self, fit: Fit) -> tuple[PreparedRequest, Fit, str]:
        """The fitted request, without the last words that would sound on too long; its fit, and these words."""
        spoken = replace(self._spoken, text=fit.text, rate=fit.rate)
        room, words = self.limits.rooms[self._segment.part], self._own_words()

        def end_of(n_words: int) -> float:
            return self._session.measure_speech(self._prepared(spoken, self._segment.part, words[:n_words])).end

        if not self._segment.fills_slot or len(words) < 2:
            return self._prepared(spoken, self._segment.part), fit, ""
        n_kept = without_overlap(fit, len(words), end_of, room)
        if n_kept == len(words):
            return self._prepared(spoken, self._segment.part), fit, ""
        end = end_of(n_kept)
        late, overlap = room.excess(end)
        shorter = replace(fit, speech_s=end, overflow_s=late, overlap_s=overlap)
        return self._prepared(spoken, self._segment.part, words[:n_kept]), shorter, " ".join(words[n_kept:])

    def _own_words(self) -> list[str]:
        first = sum(part.n_letters for part in self._parts[: self._segment.part])
        text, own = self._text, self._parts[self._segment.part]
        begin, end = (len(text_prefix(text, n)) for n in (first, first + own.n_letters))
        return text[begin:end].split()

    def _prepared(self, spoken: Spoken, at: int, words: Sequence[str] | None = None) -> PreparedRequest:
        """The request of a part, of which only the first words may be kept."""
        if words is None and not self._segment.parts:
            return self._session.prepare(replace(self._request, source=spoken))
        part, first = self._parts[at], sum(part.n_letters for part in self._parts[:at])
        if self._segment.parts:
            spoken = replace(spoken, lead=part.lead_frames / self.fps)
        last = first + (part.n_letters if words is None else sum(map(n_letters, words)))
        whole = self._session.prepare(replace(self._request, source=spoken))
        return replace(whole, excerpt=Excerpt(first, last))


@lru_cache(maxsize=1)
def _renderer() -> "SegmentRenderer":

    return SegmentRenderer()


def _render(call: Call) -> dict[str, Any]:
    return _renderer().render(segment_from_json(call.content["segment"]), Path(call.content["out"])).as_json()


HANDLERS: Mapping[str, Handler] = MappingProxyType({RENDER: _render})
