"""Output files of a clip: a film or pictures, exports, or both.

`write_pieces` reports progress in the steps of the request; `write_speech` makes files of sound and phones without
talker, face and palette, and without what draws and animates.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from lexicon.errors import InputError
from lexicon.marked_text import NameMark
from tts2face.gestures.timeline import Timeline
from tts2face.interchange.exports.writer import ExportFile, ExportWriter, mesh_of, plan_exports
from tts2face.models.person import Person
from tts2face.processes.threads import Prefetch
from tts2face.request import Recorded
from tts2face.session.marked_styles import marked_styles
from tts2face.session.prepared import HEARING_STEPS, PreparedRequest
from tts2face.session.speech import MarkTime
from tts2face.session.speech_stream import Piece, SpeechModels, spoken_pieces
from tts2face.sound.fitting import fitted_voices
from tts2face.sound.voice_pool import VoicePool
from tts2face.storage.marks import UNKNOWN, Making
from tts2face.storage.output_paths import AnyPath, refuse_overwriting
from tts2face.types import Clip, Progress, ignore_progress

if TYPE_CHECKING:
    from tts2face.picture.film import ClipWriter
    from tts2face.picture.frame_renderer import FrameRenderer
    from tts2face.picture.options import Picture
    from tts2face.session.animated_face import AnimatedFace
    from tts2face.session.shared_models import SessionModels
    from tts2face.sound.alignment import TextMismatch
    from tts2face.storage.signing import Signer

N_PIECES_AHEAD = 2  # pieces synthesised before they are drawn


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
        self,
        face: "AnimatedFace | None",
        renderer: "FrameRenderer | None",
        on_frames: Progress,
        making: Making = UNKNOWN,
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
        making
            What the request adds to the marks of the files.
        """
        with ExitStack() as stack:
            film = None
            if self.out is not None and renderer is not None:
                from tts2face.picture.film import ClipWriter

                film = stack.enter_context(ClipWriter(self.out, renderer, on_progress=on_frames, making=making))
            mesh = mesh_of(face, self.exports)
            exports = stack.enter_context(ExportWriter(self.exports, face=mesh, making=making))
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
        from tts2face.picture.film import check_output

        check_output(out)
    files = plan_exports(exports)
    if out is None and not files:
        raise InputError("there is no output; give the path of a film or of an export")
    names: dict[str, AnyPath] = {f"export {number}": file.path for number, file in enumerate(files, start=1)}
    refuse_overwriting(names | {"out": out}, inputs)
    return OutputFiles(None if out is None else Path(out), files)


@dataclass(frozen=True, slots=True)
class WrittenClip:
    """Summary of a written file.

    Parameters
    ----------
    seconds
        Duration of the sound.
    n_frames
        Number of video frames.
    marks
        Named marks of the text with their times.
    is_silent
        Whether the file has no sound.
    mismatches
        Words of the text that the recording probably does not contain.
    exports
        Files of other formats, those beside them included.
    notes
        What is missing in the input, and what is guessed about it, one sentence each.
    """

    path: Path
    seconds: float
    n_frames: int
    marks: tuple[MarkTime, ...] = ()
    is_silent: bool = False
    mismatches: "tuple[TextMismatch, ...]" = ()
    exports: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> str:
        """All files written, separated by commas."""
        return ", ".join(dict.fromkeys(str(path) for path in (self.path, *self.exports)))


class RequestSteps:
    """Converts the number of drawn frames into steps of a request."""

    def __init__(self, n_steps: int, on_progress: Progress) -> None:
        self._n_steps, self._on_progress = n_steps, on_progress
        self._steps_heard = self._steps_before = self._piece_steps = self._frames_before = self._n_frames = 0

    def report_heard(self, done: int, of: int) -> None:
        """Report how much of a recording has been heard, before its first piece."""
        self._steps_heard = HEARING_STEPS * done // of
        self._on_progress(self._steps_heard, self._n_steps)

    def begin(self, piece: Piece) -> None:
        """Start the next piece."""
        self._steps_before += self._piece_steps
        self._piece_steps, self._frames_before = piece.n_steps, self._n_frames
        self._n_frames += len(piece.clip.motion)

    def report_frames(self, n_drawn: int, n_submitted: int) -> None:
        """Report the frames drawn, out of those passed to the writer so far."""
        share = (n_drawn - self._frames_before) / max(n_submitted - self._frames_before, 1)
        steps = max(self._steps_heard, int(self._steps_before + self._piece_steps * share))
        self._on_progress(min(self._n_steps, steps), self._n_steps)

    def finish(self) -> None:
        """Report that all steps are done."""
        self._on_progress(self._n_steps, self._n_steps)


def ahead(pieces: Iterable[Piece]) -> Prefetch[Piece]:
    """Pieces that are synthesised in a thread, ahead of their use, as long as the ``with`` block lasts."""
    return Prefetch(pieces, N_PIECES_AHEAD)


def write_request(
    prepared: PreparedRequest,
    models: "SessionModels",
    outputs: OutputFiles,
    picture: "Picture",
    on_progress: Progress | None = None,
    on_piece: Callable[[Piece], None] | None = None,
) -> WrittenClip:
    """Synthesise a request and write it to its outputs; arguments as of `tts2face.Session.write`."""
    has_gestures = prepared.request.has_gestures
    prepared.preload_voice(models.voices, models.person)  # while the face is prepared
    progress = RequestSteps(prepared.n_steps, on_progress or ignore_progress)
    face = models.face(has_gestures=has_gestures)
    with ahead(models.pieces(prepared, progress.report_heard)) as pieces:  # while the renderer is built
        renderer = None if outputs.out is None else models.renderer(picture, has_gestures=has_gestures)
        with outputs.open(face, renderer, progress.report_frames, models.making(prepared)) as files:
            return write_pieces(pieces, files, outputs, progress, on_piece)


def write_pieces(
    pieces: Iterable[Piece],
    files: OpenOutputs,
    outputs: OutputFiles,
    progress: RequestSteps,
    on_piece: Callable[[Piece], None] | None,
) -> WrittenClip:
    """Write all pieces to the open files of `outputs`, while the next ones are synthesised if they are of `ahead`.

    Parameters
    ----------
    on_piece
        Called with each piece before it is drawn.
    """
    marks: list[MarkTime] = []
    mismatches: list[TextMismatch] = []
    seconds, n_frames = 0.0, 0
    for piece in pieces:
        if on_piece:
            on_piece(piece)
        progress.begin(piece)
        files.add(piece.clip, piece.text)
        marks += piece.marks
        mismatches += piece.mismatches
        seconds += piece.clip.speech.waveform.duration
        n_frames += len(piece.clip.motion)
        if files.film is None:
            progress.report_frames(n_frames, n_frames)
    progress.finish()
    return WrittenClip(
        outputs.path, seconds, n_frames, tuple(marks), mismatches=tuple(mismatches), exports=files.exports.paths
    )


def is_speech_only(prepared: PreparedRequest, outputs: OutputFiles) -> bool:
    """Whether no output holds motion, and the request asks for nothing that a talker, face or palette could lack."""
    asks_for_motion = prepared.timeline != Timeline() or marked_styles(prepared.text) or prepared.excluded
    holds_motion = outputs.out is not None or any(file.format.has_motion for file in outputs.exports)
    return not isinstance(prepared.request.source, Recorded) and not asks_for_motion and not holds_motion


def write_speech(
    prepared: PreparedRequest,
    outputs: OutputFiles,
    voices: VoicePool,
    on_progress: Progress,
    person: Person | None = None,
    signer: "Signer | None" = None,
) -> WrittenClip:
    """Write outputs for which `is_speech_only` holds: the same files as those of a session that shows a person.

    Raises
    ------
    InputError, DataError, BackendError
        As `Session.export`.
    """
    models = SpeechModels(fitted_voices(voices, person, prepared.dictionary), voices.yield_turn)
    has_phones = any(not file.format.is_sound for file in outputs.exports)
    has_names = any(isinstance(mark, NameMark) for mark in prepared.text.marks)
    pieces = spoken_pieces(prepared, models, has_phones=has_phones or has_names)
    making = replace(prepared.making(person), signer=signer)
    with outputs.open(None, None, ignore_progress, making) as files, ahead(pieces) as spoken:
        return write_pieces(spoken, files, outputs, RequestSteps(prepared.n_steps, on_progress), None)
