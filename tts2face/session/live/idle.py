"""Motion of a face that neither speaks nor listens, made once for all live faces of equal options (decision 203)."""

import threading
from dataclasses import dataclass, field

import numpy as np

from tts2face.numeric.arrays import Float32Array
from tts2face.session.live.blocks import Block
from tts2face.session.live.speech import LiveSpeech
from tts2face.types import Trajectory

IDLE_LOOP_S = 60.0  # after which idle motion repeats
IDLE_PART_S = 5.0  # of it that is made at a time: a second takes 15 ms, a fifth of what it takes in parts of 0.2 s
MAX_IDLE = 8  # kinds of idle motion of a session, of 1.5 MB each


@dataclass(slots=True, eq=False, weakref_slot=True)
class IdleMotion:
    """Motion of a face without speech, which grows to `IDLE_LOOP_S` and then repeats.

    Attributes
    ----------
    weights : (T, K)
        Of the face's `channels`.
    head : (T, 6)
        Head pose.
    """

    _speech: LiveSpeech
    channels: tuple[str, ...] = ()
    head_channels: tuple[str, ...] = ()
    weights: Float32Array = field(default_factory=lambda: np.zeros((0, 0), np.float32))
    head: Float32Array = field(default_factory=lambda: np.zeros((0, 6), np.float32))
    _growing: threading.Lock = field(default_factory=threading.Lock)

    def __len__(self) -> int:
        """Return the number of frames so far."""
        return len(self.head)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self._speech.fps

    @property
    def is_whole(self) -> bool:
        """Whether it repeats from here on."""
        return bool(self._speech.seconds >= IDLE_LOOP_S)

    def grow(self) -> bool:
        """Make another part; False if another thread or task does so."""
        if not self._growing.acquire(blocking=False):
            return False
        try:
            for piece in self._speech.idle(IDLE_PART_S):
                motion, head = piece.clip.motion, piece.clip.head
                self.channels, self.head_channels = motion.channels, head.channels
                self.weights = np.vstack([self.weights, motion.values]) if len(self) else motion.values
                self.head = np.vstack([self.head, head.values])
        finally:
            self._growing.release()
        return True


def idle_motion(speech: LiveSpeech) -> IdleMotion:
    """Idle motion of the session and the options of a live clip; the last `MAX_IDLE` kinds are kept."""
    known, key = speech.models.idle_motions, repr(speech.request)
    found: IdleMotion = known.setdefault(key, IdleMotion(speech.without_pieces()))
    known.move_to_end(key)
    while len(known) > MAX_IDLE:
        known.popitem(last=False)
    return found


class IdlePlayer:
    """Plays idle motion from its beginning, again and again."""

    def __init__(self, idle: IdleMotion) -> None:
        self.motion = idle
        self._at = 0

    @property
    def begins(self) -> bool:
        """Whether the next frame is the first one, which does not follow the frame before it."""
        return self._at == 0

    def has(self, n_frames: int) -> bool:
        """Whether so many frames, or all, are made."""
        return self.motion.is_whole or self._at + n_frames <= len(self.motion)

    def next(self, n_frames: int) -> Block:
        """The next frames, at most `n_frames` of them; at least one must have been made."""
        idle = self.motion
        weights, head = idle.weights, idle.head  # another thread replaces them by longer ones
        part = slice(self._at, min(self._at + n_frames, len(weights), len(head)))
        self._at = part.stop if part.stop < len(idle) or not idle.is_whole else 0
        if part.start == part.stop:  # more cannot be made at the moment
            self._at = 0
            return self.next(n_frames)
        motion = Trajectory(idle.channels, weights[part], idle.fps)
        return Block(motion, Trajectory(idle.head_channels, head[part], idle.fps), "idle", idle=(idle, part))
