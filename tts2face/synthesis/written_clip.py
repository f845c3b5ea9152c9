"""Writing of the pieces of a clip to its outputs, with progress in the steps of the request."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from tts2face.prefetch import Prefetch
from tts2face.speech.text_fit import TextMismatch
from tts2face.synthesis.marked_speech import MarkTime
from tts2face.synthesis.output_files import OpenOutputs, OutputFiles
from tts2face.synthesis.speech_stream import Piece
from tts2face.types import Progress

N_PIECES_AHEAD = 2  # pieces synthesised before they are drawn


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
    """

    path: Path
    seconds: float
    n_frames: int
    marks: tuple[MarkTime, ...] = ()
    is_silent: bool = False
    mismatches: tuple[TextMismatch, ...] = ()
    exports: tuple[Path, ...] = ()

    @property
    def names(self) -> str:
        """All files written, separated by commas."""
        return ", ".join(dict.fromkeys(str(path) for path in (self.path, *self.exports)))


class RequestSteps:
    """Converts the number of drawn frames into steps of a request."""

    def __init__(self, n_steps: int, on_progress: Progress | None) -> None:
        self._n_steps, self._on_progress = n_steps, on_progress
        self._steps_before = self._piece_steps = self._frames_before = self._n_frames = 0

    def begin(self, piece: Piece) -> None:
        """Start the next piece."""
        self._steps_before += self._piece_steps
        self._piece_steps, self._frames_before = piece.n_steps, self._n_frames
        self._n_frames += len(piece.clip.motion)

    def report_piece(self) -> None:
        """Report that the piece is done."""
        self.report_frames(self._n_frames, self._n_frames)

    def report_frames(self, n_drawn: int, n_submitted: int) -> None:
        """Report the frames drawn, out of those passed to the writer so far."""
        if self._on_progress:
            share = (n_drawn - self._frames_before) / max(n_submitted - self._frames_before, 1)
            self._on_progress(min(self._n_steps, int(self._steps_before + self._piece_steps * share)), self._n_steps)

    def finish(self) -> None:
        """Report that all steps are done."""
        if self._on_progress:
            self._on_progress(self._n_steps, self._n_steps)


def ahead(pieces: Iterable[Piece]) -> Prefetch[Piece]:
    """Pieces that are synthesised in a thread, ahead of their use, as long as the ``with`` block lasts."""
    return Prefetch(pieces, N_PIECES_AHEAD)


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
        if files.film is None:
            progress.report_piece()
        marks += piece.marks
        mismatches += piece.mismatches
        seconds += piece.clip.speech.waveform.duration
        n_frames += len(piece.clip.motion)
    progress.finish()
    return WrittenClip(
        outputs.path, seconds, n_frames, tuple(marks), mismatches=tuple(mismatches), exports=outputs.export_paths
    )
