"""Requests for the recordings of segments: the words where the recording contains them, else the sound alone."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from lexicon.errors import DataError
from tts2face.request import FromPhones, Idle, Recorded, Request, Spoken
from tts2face.serving.batch.audio_track import open_track
from tts2face.serving.batch.segment import Segment
from tts2face.session.session import Session
from tts2face.sound.pauses import speech_onset
from tts2face.source_options import IDLE_LIMITS_S
from tts2face.types import SOUND_RATE, Waveform, exact_rate, first_sample

ONSET_S = 60  # of a recording of a cue, within which its first sound lies


class FittedRecording(NamedTuple):
    """A request that can be synthesised, seconds of its sound, and warnings."""

    request: Request
    speech_s: float
    warnings: list[str]


@contextmanager
def excerpt_of(segment: Segment, request: Request) -> Iterator[Request]:
    """The request of a segment, with its lead, or with its part of a recording as a temporary file."""
    fps, source = exact_rate(request.fps), request.source
    if isinstance(source, Spoken) and segment.lead_frames is not None:
        yield replace(request, source=replace(source, lead=float(segment.lead_frames / fps)))
        return
    if not isinstance(source, Recorded):
        yield request
        return
    if segment.audio_begin is None and segment.lead_frames is None:
        yield request
        return
    track = open_track(source.audio)
    begin, end = segment.audio_begin, segment.audio_end
    if begin is None:
        heard = Waveform(track.read(0, min(track.n_samples, ONSET_S * SOUND_RATE)) / np.float32(32768), SOUND_RATE)
        onset = round(speech_onset(heard, is_recording=True) * SOUND_RATE)
        begin = onset - first_sample(segment.lead_frames or 0, SOUND_RATE, fps)
        end = track.n_samples
        if not heard.samples.any():  # it is refused by its name
            yield request
            return
    with TemporaryDirectory(prefix="tts2face-") as folder:
        path = Path(folder) / f"{source.audio.stem}.wav"
        track.write_excerpt(path, begin, end)
        yield replace(request, source=replace(source, audio=path))


def fit_recording(session: Session, request: Request, segment: Segment) -> FittedRecording:
    """A request that follows the recording of a segment.

    An excerpt of a dubbing track may contain other words than the subtitles, or none: then lips follow the sound, or
    rest.
    """
    try:
        pieces = list(session.stream(request))
    except DataError as wrong:
        # a recording of this cue alone contains its words, or is wrong
        if segment.audio_begin is None:
            raise
        if request.source.text:
            return _without_words(session, request, segment)
        seconds = segment.window_frames / float(exact_rate(request.fps))
        idle = replace(request, source=Idle(max(seconds, IDLE_LIMITS_S[0])))
        return FittedRecording(idle, 0.0, [f"the recording has no speech here ({_reason(wrong)})"])
    found = [f"{' '.join(mismatch.words)!r}" for piece in pieces for mismatch in piece.mismatches]
    # an excerpt of a dubbing track may have other words than its subtitles
    if found and segment.audio_begin is not None:
        return _without_words(session, request, segment)
    warnings = [f"the recording probably does not contain {', '.join(found)}"] if found else []
    return FittedRecording(request, sum(piece.clip.speech.waveform.duration for piece in pieces), warnings)


def _without_words(session: Session, request: Request, segment: Segment) -> FittedRecording:
    source = request.source
    assert isinstance(source, Recorded)
    wordless = replace(request, source=replace(source, lips=FromPhones("", source.lips.articulation)))
    fitted = fit_recording(session, wordless, segment)
    if isinstance(fitted.request.source, Idle):
        return fitted
    other = f"the recording contains other words than {source.text[:40]!r}; lips follow its sound"
    return fitted._replace(warnings=[other, *fitted.warnings])


def _reason(error: DataError) -> str:
    """A reason without the path of the temporary file."""
    return "it is silent" if "silent" in str(error) else str(error).rpartition("/")[2]
