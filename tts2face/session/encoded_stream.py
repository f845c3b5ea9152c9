"""A clip as bytes: a movie, sound or lines of text that are sent while they are made, or a complete file."""

import io
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import InputError
from lexicon.values.fields import check_fields
from tts2face.interchange.exports.frame_grid import FrameGrid
from tts2face.interchange.exports.parts import FormatWriter
from tts2face.interchange.exports.table import FormatInfo, all_formats
from tts2face.interchange.exports.writer import ExportFile, ExportWriter, make_target, mesh_of, plan_exports
from tts2face.models.face import Face
from tts2face.picture.options import Picture
from tts2face.picture.pace import Pace
from tts2face.picture.sound_stream import SOUND_KINDS, encode_sound
from tts2face.picture.streamed_movie import MOVIE_KINDS, encode_movie, find_movie_kind
from tts2face.request import Recorded
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.prepared import PreparedRequest
from tts2face.session.shared_models import SessionModels
from tts2face.session.speech_stream import Piece, timed_speech
from tts2face.storage.marks import Making, sound_mark
from tts2face.types import Chunk

BLOCK_BYTES = 1 << 18  # of a file that is read when it is complete


@cache
def line_formats() -> Mapping[str, FormatInfo]:
    """Formats of lines by name, of other packages, too."""
    return MappingProxyType({info.name: info for info in all_formats() if info.has_lines})


@cache
def media_types() -> Mapping[str, str]:
    """Media types of the formats of `Session.stream_file`."""
    return MappingProxyType({
        **{name: kind.media_type for name, kind in MOVIE_KINDS.items()},
        **{name: kind.media_type for name, kind in SOUND_KINDS.items()},
        **{name: info.media_type for name, info in line_formats().items()},
        "glb": "model/gltf-binary",
        "vrma": "model/gltf-binary",
    })  # fmt: skip


@dataclass(frozen=True, slots=True)
class StreamFormat:
    """Format of streamed bytes, one of `media_types`, and the drawing options of movies.

    Parameters
    ----------
    threads, pace
        As for `tts2face.picture.clip_frames.ClipFrames`.
    is_complete
        Bytes come when all is made: a file whose header has its length, in place of one that plays while it is sent.
    """

    name: str
    picture: Picture
    threads: int | None = None
    pace: Pace | None = None
    is_complete: bool = False

    def __post_init__(self) -> None:
        """Check the types and the format."""
        check_fields(self)
        if self.name not in media_types():
            raise InputError(f"there is no streamed format {self.name!r}; the formats are {', '.join(media_types())}")
        if self.name in MOVIE_KINDS:
            find_movie_kind(self.name, self.picture)


def encode_stream(prepared: PreparedRequest, models: SessionModels, format: StreamFormat) -> Iterator[Chunk]:
    """Synthesise and encode a request; yields consecutive chunks of a file."""
    request, name = prepared.request, format.name
    making = models.making(prepared)
    if name in MOVIE_KINDS or name in SOUND_KINDS:
        return encode_media(
            lambda path: _encode_media(prepared, models, format, path), name, is_complete=format.is_complete
        )
    if name not in line_formats():
        file, face = f"clip.{name}", models.face(has_gestures=request.has_gestures)
        return encode_whole(models.pieces(prepared), file, (face, making), lambda folder: folder / file)
    mesh = models.face(has_gestures=request.has_gestures).mesh if line_formats()[name].uses_face else None
    return encode_lines(models.pieces(prepared), name, mesh)


def encode_media(write: Callable[[Path | None], Iterator[Chunk]], format: str, *, is_complete: bool) -> Iterator[Chunk]:
    """Chunks of a movie or sound while it is made, or of a complete file, as the format may demand.

    Parameters
    ----------
    write
        Writes the file to a path, or gives its chunks where there is none.
    format
        A movie, or one of `SOUND_KINDS`.
    """
    if is_complete or (format in SOUND_KINDS and SOUND_KINDS[format].is_sent_whole):
        return _encode_complete(write, format)
    return write(None)


def _encode_media(
    prepared: PreparedRequest, models: SessionModels, format: StreamFormat, path: Path | None
) -> Iterator[Chunk]:
    """Movie or sound of a request; `path` as for `encode_movie` and `encode_sound`."""
    request, making = prepared.request, models.making(prepared)
    if format.name in MOVIE_KINDS:
        renderer = models.renderer(format.picture, has_gestures=request.has_gestures)
        clips = (piece.clip for piece in models.pieces(prepared))
        return encode_movie(
            clips, renderer, format.name, threads=format.threads, pace=format.pace, path=path, making=making
        )
    if not isinstance(request.source, Recorded):
        pieces = timed_speech(prepared, models.for_request(prepared).speech, has_phones=False)
    else:
        pieces = models.pieces(prepared)
    mark = sound_mark(making, is_recorded=isinstance(request.source, Recorded))
    return encode_sound((piece.speech.waveform for piece in pieces), format.name, path, mark)


def _encode_complete(write: Callable[[Path], Iterator[Chunk]], format: str) -> Iterator[Chunk]:
    """Chunks without content while a file is written to the path that `write` gets, then its bytes."""
    with tempfile.TemporaryDirectory(prefix="tts2face-") as folder:
        path = Path(folder, f"clip.{format}")
        yield from write(path)
        yield from _file_chunks(path)


def _file_chunks(path: Path) -> Iterator[Chunk]:
    with path.open("rb") as file:
        while block := file.read(BLOCK_BYTES):
            yield Chunk(block)


def encode_whole(
    pieces: Iterable[Piece], name: str, shown: tuple[AnimatedFace, Making], choose: Callable[[Path], Path]
) -> Iterator[Chunk]:
    """Write pieces to an export of a name, whose bytes come after the last piece.

    Parameters
    ----------
    shown
        The face, and what the request adds to the marks of the files.
    choose
        Path of the file that is sent, in the folder of all files that were written.

    Raises
    ------
    InputError, BackendError
        As `plan_exports`, `mesh_of` and `ExportWriter`.
    """
    face, making = shown
    with tempfile.TemporaryDirectory(prefix="tts2face-") as folder:
        files = plan_exports([Path(folder, name)])
        with ExportWriter(files, face=mesh_of(face, files), making=making) as writer:
            for piece in pieces:
                writer.add(piece.clip, piece.text)
                yield Chunk(b"", piece.clip.speech.waveform.duration)
        yield from _file_chunks(choose(Path(folder)))


class LineBuffer(io.StringIO):
    """Text that is taken in parts; closing it keeps what was not yet taken."""

    def take(self) -> bytes:
        """Return the text written since the last call as UTF-8."""
        taken = self.getvalue().encode()
        self.seek(0)
        self.truncate()
        return taken

    def close(self) -> None:
        """Do nothing: memory is all that a buffer holds."""


def encode_lines(pieces: Iterable[Piece], format: str, face: Face | None) -> Iterator[Chunk]:
    """Write consecutive pieces in a format of lines; yields a chunk for each piece.

    Parameters
    ----------
    format
        One of `line_formats`.
    face
        Mesh whose shapes the clips' channels are, for formats of ARKit shapes.
    """
    info = line_formats()[format]
    file, buffer = ExportFile(Path(f"clip{info.suffixes[0]}"), info), LineBuffer()
    grid: FrameGrid | None = None
    writer: FormatWriter | None = None
    for piece in pieces:
        if grid is None or writer is None:
            grid = FrameGrid(piece.clip, info.default_fps)
            writer = info.make_writer()(make_target(file, grid, piece.clip, face, file.path, buffer))
        writer.add(grid.place(piece.clip, piece.text))
        yield Chunk(buffer.take(), piece.clip.speech.waveform.duration)
    if grid is not None and writer is not None:
        writer.add(grid.remainder())
        writer.finish()
        yield Chunk(buffer.take())
