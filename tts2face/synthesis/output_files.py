"""Files that one clip is written to: a film or pictures, exports, or both."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lexicon.errors import InputError
from tts2face.exports.writer import ExportFile, ExportWriter, mesh_of, plan_exports
from tts2face.render.output_path import check_output
from tts2face.storage.overwrite import AnyPath, refuse_overwriting
from tts2face.types import Clip, Progress

if TYPE_CHECKING:
    from tts2face.render.encode import ClipWriter
    from tts2face.render.renderer import FrameRenderer
    from tts2face.synthesis.animated_face import AnimatedFace


@dataclass(frozen=True, slots=True)
class OutputFiles:
    """Checked outputs of one clip.

    Parameters
    ----------
    out
        Film or folder of pictures; None for exports only.
    exports
        Files of other formats, those beside them included.
    """

    out: Path | None
    exports: tuple[ExportFile, ...]

    @property
    def path(self) -> Path:
        """First file of the clip."""
        return self.exports[0].path if self.out is None else self.out

    @property
    def export_paths(self) -> tuple[Path, ...]:
        """Paths of the exports."""
        return tuple(file.path for file in self.exports)

    def check_face(self, face: "AnimatedFace") -> None:
        """Reject exports that a face cannot fill.

        Raises
        ------
        InputError
            An export holds a mesh, and the face has none.
        """
        mesh_of(face, self.exports)

    @contextmanager
    def open(
        self, face: "AnimatedFace | None", renderer: "FrameRenderer | None", on_frames: Progress | None
    ) -> Iterator["OpenOutputs"]:
        """Writer of consecutive clips to all files; errors as `ClipWriter` and `ExportWriter`.

        Parameters
        ----------
        face
            Animated face of the clips; None if no file holds its mesh or shapes.
        renderer
            Draws the clips; None if `out` is None.
        on_frames
            Called with the number of frames drawn and the number added so far.
        """
        with ExitStack() as stack:
            film = None
            if self.out is not None and renderer is not None:
                from tts2face.render.encode import ClipWriter  # not for exports alone

                film = stack.enter_context(ClipWriter(self.out, renderer, on_progress=on_frames))
            exports = stack.enter_context(ExportWriter(self.exports, face=mesh_of(face, self.exports)))
            yield OpenOutputs(film, exports)


@dataclass(frozen=True, slots=True)
class OpenOutputs:
    """Writers of a film and of exports."""

    film: "ClipWriter | None"
    exports: ExportWriter

    def add(self, clip: Clip, text: str = "") -> None:
        """Append a clip, and its written text for captions."""
        self.exports.add(clip, text)
        if self.film is not None:
            self.film.add(clip)


def plan_outputs(out: str | Path | None, exports: Sequence[str | Path], inputs: Mapping[str, AnyPath]) -> OutputFiles:
    """Check the outputs of a clip before anything is computed.

    Parameters
    ----------
    inputs
        Files that the request reads, by names for messages.

    Raises
    ------
    InputError
        There is no output, a suffix is unknown, or an output would replace an input or another output.
    BackendError
        A folder cannot be written.
    """
    if out is not None:
        check_output(out)
    files = plan_exports(exports)
    if out is None and not files:
        raise InputError("there is no output; give the path of a film or of an export")
    names: dict[str, AnyPath] = {f"export {number}": file.path for number, file in enumerate(files, start=1)}
    refuse_overwriting(names | {"out": out}, inputs)
    return OutputFiles(None if out is None else Path(out), files)
