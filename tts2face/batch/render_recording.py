"""Requests for the recordings of segments: the words where the recording contains them, else the sound alone."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from lexicon.errors import DataError
from tts2face.batch.segment import Segment
from tts2face.batch.track import open_track
from tts2face.clock import exact_rate
from tts2face.request import IDLE_LIMITS_S, Request
from tts2face.session import Session


@contextmanager
def excerpt_of(segment: Segment, request: Request) -> Iterator[Request]:
    """The request of a segment, with its excerpt of a recording as a temporary file if it has one."""
    if segment.audio_begin is None or request.audio is None:
        yield request
        return
    with TemporaryDirectory(prefix="tts2face-") as folder:
        path = Path(folder) / f"{request.audio.stem}.wav"
        open_track(request.audio).write_excerpt(path, segment.audio_begin, segment.audio_end)
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
