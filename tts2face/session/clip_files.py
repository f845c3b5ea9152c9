"""Clips and their files without a session: drawing, exporting, reading back and converting."""

from collections.abc import Callable, Iterable
from itertools import chain
from pathlib import Path

from lexicon.errors import DataError
from tts2face.face.gestures import gesture_face
from tts2face.interchange.exports.track import read_track
from tts2face.interchange.exports.writer import ExportWriter, mesh_of, plan_exports
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import default_face
from tts2face.models.palette_file import load_palette
from tts2face.picture.film import write_clips
from tts2face.picture.options import Picture
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.speech_stream import Piece
from tts2face.storage.output_paths import refuse_overwriting
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
        .mp4, .webm, .mov, .gif, or a folder of .png files. The file appears when it is complete; after an error no
        partial file remains.
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
    return writer.paths


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


def convert(  # noqa: PLR0913 - one parameter a model
    track: str | Path,
    path: str | Path | Iterable[str | Path],
    *,
    face: str | None = None,
    identity: str | None = None,
    hair: str | None = None,
    hair_color: str | None = None,
    palette: str = "starter",
    fps: float | None = None,
) -> tuple[Path, ...]:
    """Write the clip of a lossless track to files of other formats, in bounded memory.

    Parameters
    ----------
    track
        Track that `export` wrote, ``clip.track.json``.
    path, fps
        As for `export`.
    face, identity, hair, hair_color, palette
        Names or paths of the face, its identity preset and hair, and the palette that made the clip; loaded if a format
        uses the face's shapes. Without a face, as for `Session`.

    Returns
    -------
    tuple of Path
        The files written.

    Raises
    ------
    InputError
        As `export`; or a model does not exist, or a file would replace the track.
    DataError
        The track is damaged, or its channels are not those of the face and palette.
    """
    paths = [path] if isinstance(path, str | Path) else list(path)
    files = plan_exports(paths, fps=fps)
    names: dict[str, str | Path | None] = {f"output {number}": file.path for number, file in enumerate(files, start=1)}
    refuse_overwriting(names, {"the track": track, "the face": face, "the palette": palette})
    pieces = read_track(Path(track))
    first = next(pieces)
    channels = first.clip.motion.channels
    mesh = None
    face = face or default_face(identity, hair)
    if any(file.format.uses_face for file in files):
        mesh = _mesh_with_channels(
            channels, load_face(face, identity, hair=hair, hair_color=hair_color), (face, palette)
        )
    with ExportWriter(files, face=mesh, fps=fps) as writer:
        for piece in chain([first], pieces):
            writer.add(piece.clip, piece.text)
    return writer.paths


def _mesh_with_channels(channels: tuple[str, ...], mesh: Face, names: tuple[str, str]) -> Face:
    """Face whose first shapes are the channels of a track, with the gestures of a palette if it has them."""
    face, palette = names
    if len(channels) > len(mesh.shape_names):
        mesh = gesture_face(mesh, load_palette(palette)).face
    if mesh.shape_names[: len(channels)] != channels:
        raise DataError(
            f"the track has {len(channels)} channels ({', '.join(channels[:3])}, ...), which are not those of the face "
            f"{face} with the palette {palette}; name the face and palette that made it"
        )
    return mesh
