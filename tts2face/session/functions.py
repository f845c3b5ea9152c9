"""What is public besides `Session`: drawing, exporting and reading back a clip; and sessions by names of models."""

import gc
import os
from collections import OrderedDict
from collections.abc import Callable, Iterable
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from lexicon.errors import DataError
from tts2face.face.gestures import gesture_face
from tts2face.interchange.exports.track import read_track
from tts2face.interchange.exports.writer import ExportWriter, mesh_of, plan_exports
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import default_face
from tts2face.models.palette import load_palette
from tts2face.picture.film import write_clips
from tts2face.picture.options import Picture
from tts2face.processes.shared import free_unused
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.named_models import Models
from tts2face.session.speech_stream import Piece
from tts2face.storage.output_paths import refuse_overwriting
from tts2face.types import Clip, concatenate_clips

if TYPE_CHECKING:
    from tts2face.session.session import Session
    from tts2face.sound.voice_pool import VoicePool


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
    return tuple(file.path for file in files)


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


class SessionCache:
    """Loads sessions at their first use and keeps the last ones; a second one takes 250 MB.

    Parameters
    ----------
    n_sessions
        Sessions to keep.
    voices
        Loaded voices that all sessions share; None: each has its own.
    max_bytes
        Memory of this process beyond which the least recently used sessions are released, all but one; None: any.
    memory_mb
        Finished sentences that a session with an owner keeps, as for `Session`.
    """

    def __init__(
        self,
        n_sessions: int = 1,
        *,
        voices: "VoicePool | None" = None,
        max_bytes: int | None = None,
        memory_mb: float = 0.0,
    ) -> None:
        self._n_sessions, self._voices, self._max_bytes = n_sessions, voices, max_bytes
        self._memory_mb = memory_mb
        self._sessions: OrderedDict[tuple[Models, str, tuple[int, ...]], Session] = OrderedDict()

    def get(self, models: Models, owner: str = "") -> "Session":
        """Session of these models; a new one if a file has changed; raises as `Session`.

        Parameters
        ----------
        owner
            For whom the session keeps finished sentences, and for nobody else; empty: it keeps none.
        """
        key = (models, owner, _file_times(models))
        if key in self._sessions:
            self._sessions.move_to_end(key)
        else:
            while len(self._sessions) >= self._n_sessions:
                self._sessions.popitem(last=False)
            gc.collect()  # sessions hold themselves in circles
            self._sessions[key] = models.open_session(self._voices, memory_mb=self._memory_mb if owner else 0.0)
            free_unused()  # models of the released sessions that the new one does not share
        while self._max_bytes is not None and len(self._sessions) > 1 and resident_bytes() > self._max_bytes:
            self._sessions.popitem(last=False)
            free_unused()
            gc.collect()
        return self._sessions[key]


def _file_times(models: Models) -> tuple[int, ...]:
    """Times of the last change of those models that are files, in nanoseconds."""
    found = []
    for name in (models.talker, models.face, models.palette):
        if name is not None and os.sep in name:
            with suppress(OSError):
                found.append(os.stat(name).st_mtime_ns)
    return tuple(found)


def resident_bytes() -> int:
    """Memory of this process in bytes; 0 where the system does not tell."""
    with suppress(OSError):
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0
