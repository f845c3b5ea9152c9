"""What a live face makes: blocks of motion with their sound, the ends of utterances, and notes on texts."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from tts2face.session.live.waiting_gestures import ShownGesture
from tts2face.types import Trajectory, Waveform

if TYPE_CHECKING:
    from tts2face.session.live.idle import IdleMotion
    from tts2face.session.speech_stream import Piece

State = Literal["idle", "listening", "speaking"]
# Where motion comes from. Motion of one source goes on from block to block.
Source = Literal["speech", "sound", "listening", "gestures", "idle"]


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
        Shared idle motion of which the block is a part, and its frames; None for motion of this face alone.
    """

    motion: Trajectory
    head: Trajectory
    source: Source
    sound: Waveform | None = None
    utterance: int = 0
    piece: "Piece | None" = None
    shown: tuple[ShownGesture, ...] = ()
    idle: "tuple[IdleMotion, slice] | None" = None

    @property
    def state(self) -> State:
        """What the face does."""
        if self.source in ("speech", "sound"):
            return "speaking"
        return "listening" if self.source == "listening" else "idle"


@dataclass(frozen=True, slots=True)
class End:
    """All blocks of an utterance have been made."""

    utterance: int


@dataclass(frozen=True, slots=True)
class Note:
    """What of a text is read otherwise than written, or what of its marks is not followed."""

    text: str
    message: str


Item = Block | End | Note
