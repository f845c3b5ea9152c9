"""Movies that are sent while they are made: fragmented MP4, and WebM."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from lexicon.errors import InputError
from tts2face.clock import exact_rate
from tts2face.render.clip_frames import ClipFrames
from tts2face.render.movie import STREAMED_MP4, STREAMED_WEBM, MovieKind, MovieWriter
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.render.write_buffer import WriteBuffer
from tts2face.types import Chunk, Clip


@dataclass(frozen=True, slots=True)
class StreamedMovie:
    """Encoding of a movie format, and its media type."""

    kind: MovieKind
    media_type: str
    has_alpha: bool


MOVIE_KINDS = {
    "mp4": StreamedMovie(STREAMED_MP4, "video/mp4", False),
    "webm": StreamedMovie(STREAMED_WEBM, "video/webm", True),
}


def encode_movie(
    clips: Iterable[Clip], renderer: FrameRenderer, format: str, *, threads: int | None = None
) -> Iterator[Chunk]:
    """Draw and encode consecutive clips; yields a chunk of the movie after each frame.

    Fragments of a fifth of a second can be played when they arrive.

    Parameters
    ----------
    format
        One of `MOVIE_KINDS`.
    threads
        Number of frames drawn in advance; None for one on each core.

    Raises
    ------
    InputError
        The format is unknown or cannot be transparent, or the clips differ in fps, sound rate or channels.
    """
    kind, frames = find_movie_kind(format, renderer.picture), ClipFrames(renderer, threads)
    buffer, writer = WriteBuffer(), None
    try:
        for clip in clips:
            writer = writer or _open_movie(buffer, kind, clip, renderer)
            for pixels, samples in frames.add(clip):
                if pixels is not None:
                    writer.picture(pixels)
                if len(samples):
                    writer.sound(samples)
                yield Chunk(buffer.take(), 0.0 if pixels is None else 1.0 / clip.fps)
        if writer is not None:
            writer.finish()
            writer = None
            yield Chunk(buffer.take())
    finally:
        if writer is not None:
            writer.abandon()


def find_movie_kind(format: str, picture: Picture) -> MovieKind:
    """Encoding of a streamed movie; raises as `encode_movie`."""
    if format not in MOVIE_KINDS:
        raise InputError(f"there is no streamed movie format {format!r}; the formats are {', '.join(MOVIE_KINDS)}")
    movie = MOVIE_KINDS[format]
    if picture.is_transparent and not movie.has_alpha:
        raise InputError(f"{format} cannot be transparent; choose webm, or another background")
    return movie.kind


def _open_movie(buffer: WriteBuffer, kind: MovieKind, clip: Clip, renderer: FrameRenderer) -> MovieWriter:
    picture, clock = renderer.picture, (exact_rate(clip.fps), clip.speech.waveform.rate)
    return MovieWriter(buffer, kind, (picture.height, picture.width, picture.channels), clock, renderer.notice)
