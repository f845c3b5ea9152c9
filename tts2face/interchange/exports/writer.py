"""Writing of consecutive clips to one or several export files, which appear when all of them are complete."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, TextIO

from lexicon.errors import InputError
from tts2face.interchange.exports.frame_grid import FrameGrid
from tts2face.interchange.exports.parts import FormatWriter, Target
from tts2face.interchange.exports.table import FormatInfo, find_format, sound_name, split_format
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.marks import MOTION_NOTICE, UNKNOWN, Making, Mark, sound_mark
from tts2face.storage.output_paths import check_name
from tts2face.storage.temporary import Temporary
from tts2face.types import Clip, exact_rate

if TYPE_CHECKING:
    from tts2face.models.face import Face

SOUND_FORMAT = "wav"


@dataclass(frozen=True, slots=True)
class ExportFile:
    """Path and format of a file to write."""

    path: Path
    format: FormatInfo


def plan_exports(
    paths: Iterable[str | Path], *, format: str | None = None, fps: float | None = None
) -> tuple[ExportFile, ...]:
    """Checked files of an export, those beside them included.

    Parameters
    ----------
    paths
        Paths, or ``FORMAT:PATH``.
    format
        Format of all paths; None for that of each suffix.
    fps
        Frames per second of the formats with frames; None for those of the clip, or of the format.

    Raises
    ------
    InputError
        A format is unknown, a path cannot be written or is given twice, or no format has frames though `fps` is given.
    BackendError
        A folder cannot be written.
    """
    files: list[ExportFile] = []
    for given in paths:
        path, named = split_format(given)
        files.append(ExportFile(path, find_format(path, format or named)))
    if fps is not None and files and not any(file.format.has_frames for file in files):
        raise InputError(f"{files[0].path.name} has no frames, so fps has no effect; remove it")
    if fps is not None:
        exact_rate(fps)
    for file in files:
        _check_path(file.path)
    names = [file.path.resolve() for file in files]
    if len(set(names)) != len(names):
        raise InputError("two exports have the same path; choose two names")
    sounds = dict.fromkeys(sound_path(file.path) for file in files if file.format.has_sound_beside)
    for sound in sounds:
        if sound.resolve() not in names:
            _check_path(sound)
            files.append(ExportFile(sound, find_format(sound, SOUND_FORMAT)))
    return tuple(files)


class HasMesh(Protocol):
    """A face with a mesh, such as `tts2face.AnimatedFace`."""

    @property
    def mesh(self) -> "Face":
        """Mesh with the shapes of all channels."""


def mesh_of(face: "Face | HasMesh | None", files: Iterable[ExportFile]) -> "Face | None":
    """Mesh of a face if one of the files uses it, else None; that of a photograph with its picture for textures.

    Raises
    ------
    InputError
        The face is a talker's own face, which has no mesh.
    """
    if face is None:  # exports of sound import no models
        return None
    from tts2face.face.rest_light import in_rest_light
    from tts2face.models.face import Face

    if isinstance(face, Face) or not any(file.format.uses_face for file in files):
        mesh = face if isinstance(face, Face) else None
    else:
        mesh = face.mesh
    return mesh if mesh is None or not mesh.light.is_flat else in_rest_light(mesh)[0]


def _check_path(path: Path) -> None:
    check_name(path)
    if path.is_dir():
        raise InputError(f"{path} is a folder; choose another name")


def sound_path(path: Path) -> Path:
    """Path of the .wav file beside an export."""
    return path.with_name(sound_name(path.name))


class ExportWriter:
    """Writer of consecutive clips to export files.

    The files appear under their names when all are complete; after an error none appears. Each clip begins on the
    frame after the previous one. Memory does not grow with the number of frames.

    Parameters
    ----------
    files
        As `plan_exports` returns them.
    face
        Mesh whose shapes the clips' channels are; needed by formats with a mesh, and by those of ARKit if the clips
        have other channels.
    fps
        Frames per second of the formats with frames; None for those of the clips, or of the format.
    making
        What the request adds to the marks of the files.

    Raises
    ------
    InputError
        A format needs a mesh and there is none, clips differ in fps, sound rate or channels, or no clip was added.
    BackendError
        The disk is full or cannot be written, or a package is missing.
    """

    def __init__(
        self,
        files: Sequence[ExportFile],
        *,
        face: "Face | None" = None,
        fps: float | None = None,
        making: Making = UNKNOWN,
    ) -> None:
        for file in files:
            if file.format.needs_mesh and face is None:
                raise InputError(f"{file.path.name} holds the mesh of the face; give the face, as in face=session.face")
        self._files = [_OpenFile(file, face, fps, making) for file in files]
        self._n_clips = 0

    def __enter__(self) -> "ExportWriter":
        """Create the temporary files."""
        try:
            for file in self._files:
                file.open()
        # also an interruption: the temporary files must go
        except BaseException:
            self._clear()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Complete the files, or remove them after an error."""
        try:
            if kind is None:
                self._complete()
        finally:
            self._clear()

    @property
    def paths(self) -> tuple[Path, ...]:
        """Paths of all files, those beside them included, such as textures; known when a clip was added."""
        return tuple(path for file in self._files for path in (file.path, *file.beside))

    def add(self, clip: Clip, text: str = "") -> None:
        """Append a clip, and its written text for captions; errors as the class."""
        self._n_clips += 1
        for file in self._files:
            file.add(clip, text)

    def _complete(self) -> None:
        # an empty export would be a file without a frame
        if self._files and not self._n_clips:
            raise InputError(f"there is no clip to write to {self._files[0].path}")
        for file in self._files:
            file.finish()
        for file in self._files:
            file.replace()

    def _clear(self) -> None:
        for file in self._files:
            file.clear()


class _OpenFile:
    """One file of an `ExportWriter`."""

    def __init__(self, file: ExportFile, face: "Face | None", fps: float | None, making: Making) -> None:
        self.path = file.path
        self._format = file.format
        self._face, self._making = face, making
        self._fps = (fps or file.format.default_fps) if file.format.has_frames else None
        self._grid: FrameGrid | None = None
        self._writer: FormatWriter | None = None
        self._temporary: Temporary | None = None
        self.beside: dict[Path, Temporary] = {}

    def open(self) -> None:
        with translate_disk_errors(self.path):
            self._temporary = Temporary(self.path)

    def add(self, clip: Clip, text: str) -> None:
        if self._temporary is None:
            raise InputError("ExportWriter writes only within a with statement; open it as `with ExportWriter(...)`")
        with translate_disk_errors(self.path):
            if self._grid is None or self._writer is None:
                self._grid = FrameGrid(clip, self._fps)
                self._writer = self._format.make_writer()(self._target(self._grid, clip, self._temporary))
            self._writer.add(self._grid.place(clip, text))

    def finish(self) -> None:
        if self._grid is not None and self._writer is not None:
            with translate_disk_errors(self.path):
                rest = self._grid.remainder()
                if len(rest.motion):
                    self._writer.add(rest)
                self._writer.finish()

    def replace(self) -> None:
        if self._temporary is not None:
            with translate_disk_errors(self.path):
                for path, temporary in self.beside.items():
                    temporary.replace(path)
                self._temporary.replace(self.path)
            self._temporary = None

    def clear(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None
        if self._temporary is not None:
            self._temporary.remove()
            self._temporary = None
            for temporary in self.beside.values():
                temporary.remove()

    def _target(self, grid: FrameGrid, clip: Clip, temporary: Temporary) -> Target:
        target = make_target(ExportFile(self.path, self._format), grid, clip, self._face, temporary.path)
        is_recorded = clip.speech.is_recorded
        shown = Mark(MOTION_NOTICE) if self._face is None else self._face.mark
        mark = shown.of(self._making, is_recorded=is_recorded)
        sound = sound_mark(self._making, is_recorded=is_recorded)
        return replace(target, mark=mark, sound_mark=sound, beside=self._file_beside)

    def _file_beside(self, name: str) -> Path:
        path = self.path.with_name(name)
        _check_path(path)
        self.beside[path] = Temporary(path)
        return self.beside[path].path


def make_target(
    file: ExportFile, grid: FrameGrid, clip: Clip, face: "Face | None", path: Path, lines: TextIO | None = None
) -> Target:
    """Target of a writer for clips such as the given one; `path` and `lines` as for `Target`.

    Raises
    ------
    InputError
        The format needs a mesh, and its shapes are not the channels of the clip.
    """
    channels = clip.motion.channels
    if face is not None and face.shape_names[: len(channels)] != channels:
        if file.format.needs_mesh:
            raise InputError(
                f"the clip has {len(channels)} channels ({', '.join(channels[:3])}, ...), which are not the first "
                f"of the face's {len(face.shape_names)} shapes; give the face and palette that made the clip"
            )
        face = None
    rate = clip.speech.waveform.rate
    return Target(path, file.path.name, grid.fps, grid.source_fps, rate, channels, face, lines)
