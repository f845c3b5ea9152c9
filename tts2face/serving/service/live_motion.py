"""Curves of live streams: weights and head poses of frames, without jumps between their sources, as JSON texts.

Weights are ARKit's, or those of the character's own shapes where the face was imported from one. Idle motion is made
once for all streams of equal options (decision 203).
"""

import json
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.characters.binding import shape_mapping
from tts2face.interchange.characters.own_weights import own_names, own_weights
from tts2face.interchange.characters.shapes import ShapeMapping
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, arkit_projection
from tts2face.serving.service.messages import Line
from tts2face.types import Clip, Trajectory

if TYPE_CHECKING:
    from tts2face.session.session import Session

MAX_FRAMES = 200  # of an event, whose writing is one step of the server's event loop, of some 5 ms
GAZE = tuple(name for name in ARKIT_SHAPES if name.startswith("eyeLook"))  # for a client that turns eyes by bones
JOIN_S = 0.5  # in which a difference between two sources is gone: heads turn by 10 degrees in less
LEAST_STEP = 1e-4  # of weights and radians: what the JSON shows
IDLE_LOOP_S = 60.0  # after which idle motion repeats
IDLE_PART_S = 5.0  # of it that is made at a time: a second takes 15 ms, a fifth of what it takes in parts of 0.2 s
MAX_IDLE = 8  # kinds of idle motion of a session, of 1.5 MB each
Frames = NDArray[np.float32]  # (T, W) weights, or (T, W + H) with the head


class Projection:
    """Frames of the motion of a session's face.

    Attributes
    ----------
    names : (W,)
        Of the weights: those of the character's own shapes, then those of gaze that it lacks; otherwise ARKit's.
    """

    def __init__(self, session: "Session") -> None:
        self._mesh, self._known = session.mesh, dict[tuple[str, ...], Any]()
        self._mapping = shape_mapping(self._mesh)
        self.names: tuple[str, ...] = ARKIT_SHAPES
        if self._mapping is not None:
            gaze = [name for name in GAZE if name in self._mesh.shape_names and name not in self._mapping]
            self.names = tuple(dict.fromkeys([*own_names(self._mapping), *gaze]))

    def frames(self, motion: Trajectory, head: Trajectory | None = None) -> Frames:
        """Weights of all frames, and the head pose if there is one."""
        weights = self._arkit(motion) if self._mapping is None else self._own(motion, self._mapping)
        return weights if head is None else np.hstack([weights, head.values.astype(np.float32)])

    def _own(self, motion: Trajectory, mapping: ShapeMapping) -> Frames:
        found = own_weights(motion, self._mesh, mapping)
        rest = np.zeros(len(motion), np.float32)
        for name in set(motion.channels) & set(GAZE) - set(mapping):
            found[name] = motion.columns([name])[:, 0].astype(np.float64)
        return np.column_stack([found.get(name, rest) for name in self.names]).astype(np.float32)

    def _arkit(self, motion: Trajectory) -> Frames:
        if motion.channels not in self._known:
            self._known[motion.channels] = arkit_projection(motion.channels, self._mesh, "the stream")
        weights: Frames = self._known[motion.channels].weights(motion.values)
        return weights


class Curves:
    """Events of one stream.

    Frames of another source than those before begin as far from it as these ended, which vanishes within `JOIN_S`.
    """

    def __init__(self, session: "Session") -> None:
        self._projection = Projection(session)
        self._head_names: tuple[str, ...] | None = None
        self._n_weights = len(self._projection.names)
        self._last: Frames | None = None  # frame (W + H)
        self._difference: Frames | None = None  # likewise, to the source at its first frame
        self._n_joined = 0
        self._is_new = True

    def begin_source(self) -> None:
        """Note that the next frames are from another source."""
        self._is_new = True

    def of_clip(self, clip: Clip, begin: float) -> Iterator[Line]:
        """All frames of a clip, at most `MAX_FRAMES` in an event."""
        names = clip.head.channels
        frames = self._joined(self._projection.frames(clip.motion, clip.head), clip.motion.fps)
        for at in range(0, len(frames), MAX_FRAMES):
            texts = _texts(frames[at : at + MAX_FRAMES], self._n_weights)
            yield Line(self._text(begin + at / clip.motion.fps, clip.motion.fps, *texts, names))

    def of_motion(self, motion: Trajectory, begin: float) -> Line:
        """All frames of lip motion alone."""
        texts = _texts(self._projection.frames(motion), self._n_weights)
        return Line(self._text(begin, motion.fps, *texts, ()), motion.duration)

    def of_idle(self, idle: "IdleMotion", part: slice, begin: float) -> Line:
        """Frames of idle motion."""
        made = idle.frames[part]
        frames = self._joined(made, idle.fps)
        texts = (idle.weights[part], idle.heads[part]) if frames is made else _texts(frames, self._n_weights)
        return Line(self._text(begin, idle.fps, *texts, idle.head_names))

    def _joined(self, frames: Frames, fps: float) -> Frames:
        if self._is_new and self._last is not None:
            difference = self._last - frames[0]
            self._difference = difference if np.abs(difference).max() > LEAST_STEP else None
            self._n_joined = 0
        self._is_new = False
        if self._difference is not None:
            at = np.minimum((self._n_joined + 1 + np.arange(len(frames))) / (JOIN_S * fps), 1.0)
            # a jump between two sources fades within `JOIN_S`
            left = (1.0 - at * at * (3.0 - 2.0 * at)).astype(np.float32)
            frames = frames + left[:, None] * self._difference
            # ARKit's weights lie from 0 to 1, those of a character with a gain up to it
            high = np.maximum(1.0, frames[:, : self._n_weights] - left[:, None] * self._difference[: self._n_weights])
            frames[:, : self._n_weights] = frames[:, : self._n_weights].clip(0.0, high)
            self._n_joined += len(frames)
            self._difference = self._difference if self._n_joined < JOIN_S * fps else None
        self._last = frames[-1]
        return frames

    def _text(self, begin: float, fps: float, weights: list[str], heads: list[str], names: tuple[str, ...]) -> bytes:
        parts = [f'{{"type":"curves","begin":{round(begin, 4)},"fps":{fps}']
        if self._head_names is None:
            self._head_names = names
            shown = {"names": self._projection.names} | ({"head_names": names} if heads else {})
            parts.append(json.dumps(shown)[1:-1])
        parts.append(f'"weights":[{",".join(weights)}]')
        if heads:
            parts.append(f'"head":[{",".join(heads)}]')
        return (",".join(parts) + "}").encode()


@dataclass(slots=True, eq=False)
class IdleMotion:
    """Motion of a face without speech, which grows to `IDLE_LOOP_S` and then repeats.

    Attributes
    ----------
    frames : (T, W + H)
        Weights and head poses, and as `weights` and `heads` their rows as JSON.
    """

    _speech: Any  # LiveSpeech
    _projection: Projection
    fps: float = 0.0
    head_names: tuple[str, ...] = ()
    frames: Frames = field(default_factory=lambda: np.zeros((0, 0), np.float32))
    weights: list[str] = field(default_factory=list)
    heads: list[str] = field(default_factory=list)
    _is_growing: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether it repeats from here on."""
        return bool(self._speech.seconds >= IDLE_LOOP_S)

    def grow(self) -> bool:
        """Make another part; False if another stream does so."""
        if self._is_growing:
            return False
        self._is_growing = True
        try:
            for piece in self._speech.idle(IDLE_PART_S):
                self.fps, self.head_names = piece.clip.motion.fps, piece.clip.head.channels
                made = self._projection.frames(piece.clip.motion, piece.clip.head)
                weights, heads = _texts(made, len(self._projection.names))
                self.frames = np.vstack([self.frames, made]) if len(self.frames) else made
                self.weights, self.heads = self.weights + weights, self.heads + heads
        finally:
            self._is_growing = False
        return True


_IDLE: "WeakKeyDictionary[Session, OrderedDict[str, IdleMotion]]" = WeakKeyDictionary()


def idle_motion(session: "Session", options: Mapping[str, Any]) -> IdleMotion:
    """Idle motion of a session with options of a live stream; errors as `Session.live`."""
    known, key = _IDLE.setdefault(session, OrderedDict()), repr(sorted(options.items()))
    if key not in known:
        known[key] = IdleMotion(session.live(**options), Projection(session))
    known.move_to_end(key)
    if len(known) > MAX_IDLE:
        known.popitem(last=False)
    return known[key]


def _texts(frames: Frames, n_weights: int) -> tuple[list[str], list[str]]:
    """Rows of weights and of head poses as JSON."""
    rows = [[round(value, 4) for value in row] for row in frames.tolist()]
    return [_text(row[:n_weights]) for row in rows], [_text(row[n_weights:]) for row in rows if len(row) > n_weights]


def _text(row: list[float]) -> str:
    return json.dumps(row, separators=(",", ":"))
