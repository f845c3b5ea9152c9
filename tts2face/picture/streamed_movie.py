"""Movies that are sent while they are made: fragmented MP4, and WebM."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import InputError
from tts2face.picture.clip_frames import ClipFrames
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.movie import MP4_MOVIE, STREAMED_MP4, STREAMED_WEBM, WEBM_MOVIE, MovieKind, MovieWriter
from tts2face.picture.options import Picture
from tts2face.picture.pace import Pace
from tts2face.picture.write_buffer import WriteBuffer
from tts2face.storage.marks import UNKNOWN, Making
from tts2face.types import Chunk, Clip, exact_rate


@dataclass(frozen=True, slots=True)
class StreamedMovie:
    """Encodings of a movie format, sent while it is made and as a complete file, and its media type."""

    kind: MovieKind
    complete: MovieKind
    media_type: str
    has_alpha: bool


MOVIE_KINDS = {
    "mp4": StreamedMovie(STREAMED_MP4, MP4_MOVIE, "video/mp4", False),
    "webm": StreamedMovie(STREAMED_WEBM, WEBM_MOVIE, "video/webm", True),
}


def encode_movie(  # noqa: PLR0913 - what a stream chooses
    clips: Iterable[Clip], renderer: FrameRenderer, format: str, *, threads: int | None = None,
    pace: Pace | None = None, path: Path | None = None, making: Making = UNKNOWN,
) -> Iterator[Chunk]:  # fmt: skip
    """Draw and encode consecutive clips; yields a chunk of the movie after each frame.

    Fragments of a fifth of a second can be played when they arrive.

    Parameters
    ----------
    format
        One of `MOVIE_KINDS`.
    threads, pace
        As for `ClipFrames`.
    path
        Where a complete file is written, with its duration and an index; chunks are empty then.
    making
        What the request adds to the mark of the movie.

    Raises
    ------
    InputError
        The format is unknown or cannot be transparent, or the clips differ in fps, sound rate or channels.
    """
    movie, frames = find_movie_kind(format, renderer.picture), ClipFrames(renderer, threads, pace)
    buffer, writer, n_frames = WriteBuffer(), None, 0
    target, kind = (buffer, movie.kind) if path is None else (path, movie.complete)
    try:
        for clip in clips:
            writer = writer or _open_movie(target, kind, clip, (renderer, making))
            for pixels, samples in frames.add(clip):
                seconds = (frames.n_frames - n_frames) / clip.fps
                n_frames = frames.n_frames
                if pixels is not None:
                    writer.n_frames = n_frames - 1
                    writer.picture(pixels)
                if len(samples):
                    writer.sound(samples)
                yield Chunk(buffer.take(), seconds)
        if writer is not None:
            writer.finish()
            writer = None
            yield Chunk(buffer.take())
    finally:
        if writer is not None:
            writer.abandon()


def find_movie_kind(format: str, picture: Picture) -> StreamedMovie:
    """Encodings of a movie format; raises as `encode_movie`."""
    if format not in MOVIE_KINDS:
        raise InputError(f"there is no streamed movie format {format!r}; the formats are {', '.join(MOVIE_KINDS)}")
    movie = MOVIE_KINDS[format]
    # H.264 has no transparency
    if picture.is_transparent and not movie.has_alpha:
        raise InputError(f"{format} cannot be transparent; choose webm, or another background")
    return movie


def _open_movie(
    target: Path | WriteBuffer, kind: MovieKind, clip: Clip, shown: tuple[FrameRenderer, Making]
) -> MovieWriter:
    renderer, making = shown
    picture, clock = renderer.picture, (exact_rate(clip.fps), clip.speech.waveform.rate)
    mark = renderer.mark.of(making, is_recorded=clip.speech.is_recorded)
    return MovieWriter(target, kind, (picture.height, picture.width, picture.channels), clock, mark)
