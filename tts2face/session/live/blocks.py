"""Blocks of motion of a live face with their sound, the ends of its utterances, and notes on its texts."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

from tts2face.numeric.arrays import Float32Array
from tts2face.session.live.waiting_gestures import ShownGesture
from tts2face.types import Trajectory, Waveform

if TYPE_CHECKING:
    from tts2face.session.speech_stream import Piece

State = Literal["idle", "listening", "speaking"]
# Where motion comes from. Motion of one source goes on from block to block.
Source = Literal["speech", "sound", "listening", "gestures", "idle"]


class SharedMotion(Protocol):
    """Motion that several live faces show, one frame after another.

    Attributes
    ----------
    channels, head_channels
        Names of weights and of the head pose.
    weights : (T, K)
        Of all frames so far.
    head : (T, 6)
        Head poses.
    """

    channels: tuple[str, ...]
    head_channels: tuple[str, ...]
    weights: Float32Array
    head: Float32Array

    @property
    def fps(self) -> float:
        """Frames per second."""

    def __len__(self) -> int:
        """Return the number of frames so far."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Some frames of a live face.

    Parameters
    ----------
    motion : (T, K)
        Weights of the face's channels.
    head : (T, 6)
        Head pose.
    sound
        Of these frames; None for silence.
    utterance
        Number of what is said; 0 for silence.
    piece
        Sentence with its text, words and phones, in seconds of the block; None for all else.
    shown
        Gestures that begin, in seconds of the block.
    idle
        The shared idle motion of which the block is a part, and its frames; None for motion of this face alone.
    """

    motion: Trajectory
    head: Trajectory
    source: Source
    sound: Waveform | None = None
    utterance: int = 0
    piece: "Piece | None" = None
    shown: tuple[ShownGesture, ...] = ()
    idle: "tuple[SharedMotion, slice] | None" = None

    @property
    def state(self) -> State:
        """State of the face."""
        if self.source in ("speech", "sound"):
            return "speaking"
        return "listening" if self.source == "listening" else "idle"


@dataclass(frozen=True, slots=True)
class End:
    """All blocks of an utterance have been made."""

    utterance: int


@dataclass(frozen=True, slots=True)
class Note:
    """A part of a text that is read otherwise than written, or a mark that is not followed."""

    text: str
    message: str


Item = Block | End | Note
