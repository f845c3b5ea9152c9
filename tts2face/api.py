"""Public functions besides `tts2face.session.Session`: drawing an existing clip, exporting it, and reading it back."""

from collections.abc import Callable, Iterable
from pathlib import Path

from tts2face.exports.track_json import read_track
from tts2face.exports.writer import ExportWriter, mesh_of, plan_exports
from tts2face.models.face import Face
from tts2face.render.encode import write_clips
from tts2face.render.picture import Picture
from tts2face.synthesis.animated_face import AnimatedFace
from tts2face.synthesis.clip_stream import Piece
from tts2face.types import Clip, concatenate_clips


def write_clip(
    clip: Clip,
    face: AnimatedFace,
    out: str | Path,
    *,
    picture: Picture | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> None:
    """Draw a clip on a face and write it to a file.

    Parameters
    ----------
    face
        `Session.face` of the session that made the clip, or of another one with the same face.
    out
        .mp4, .webm, .gif, or a folder of .png files. The file appears when it is complete; after an error no partial
        file remains.
    picture
        Drawing options; None for the defaults.
    on_progress
        Called with the number of frames drawn and the total number of frames.

    Raises
    ------
    InputError
        The clip's motion is not in the channels of this face, or the name of the file has no known suffix.
    BackendError
        The file cannot be written.
    """
    write_clips(Path(out), [clip], face.renderer(picture or Picture()), on_progress=on_progress)


def export(
    clip: Clip | Iterable[Clip | Piece],
    path: str | Path | Iterable[str | Path],
    *,
    face: AnimatedFace | Face | None = None,
    format: str | None = None,
    fps: float | None = None,
) -> tuple[Path, ...]:
    """Write a clip, or the pieces of a stream, to one or several files of other programs.

    Parameters
    ----------
    clip
        A clip, or consecutive ones such as `Session.stream` gives; a stream is written in bounded memory.
    path
        Output, or several; the suffix selects the format (docs/exports.md). The files appear when all are complete.
    face
        `Session.face` of the session that made the clip, or its mesh; needed by formats with a mesh, and by those of
        ARKit if the clip has gestures.
    format
        Name of the format in place of that of the suffix; `tts2face.formats` lists all.
    fps
        Frames per second of formats with frames; None for those of the clip, or of the format.

    Returns
    -------
    tuple of Path
        The files written, those beside them included.

    Raises
    ------
    InputError
        The suffix or format is unknown, the format needs a face, or the clip's channels are not those of the face.
    BackendError
        A file cannot be written, or a package is missing.
    """
    paths = [path] if isinstance(path, str | Path) else list(path)
    files = plan_exports(paths, format=format, fps=fps)
    with ExportWriter(files, face=mesh_of(face, files), fps=fps) as writer:
        for piece in [clip] if isinstance(clip, Clip) else clip:
            if isinstance(piece, Clip):
                writer.add(piece)
            else:
                writer.add(piece.clip, piece.text)
    return tuple(file.path for file in files)


def load_clip(path: str | Path) -> Clip:
    """Read the clip of a lossless track that `export` wrote.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        It is not a track, or is damaged.
    """
    return concatenate_clips([piece.clip for piece in read_track(Path(path))])
