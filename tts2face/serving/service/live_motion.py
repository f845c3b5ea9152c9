"""Curves of live streams: weights and head poses of frames as JSON texts.

Weights are ARKit's, or those of the character's own shapes where the face was imported from one. Idle motion is
written once for all streams of equal options (decision 203).
"""

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.characters.binding import shape_mapping
from tts2face.interchange.characters.own_weights import own_names, own_weights
from tts2face.interchange.characters.shapes import ShapeMapping
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, arkit_projection
from tts2face.serving.service.messages import Line
from tts2face.session.live.blocks import Block, SharedMotion
from tts2face.types import Trajectory

if TYPE_CHECKING:
    from tts2face.session.session import Session

MAX_FRAMES = 200  # of an event, whose writing is one step of the server's event loop, of some 5 ms
GAZE = tuple(name for name in ARKIT_SHAPES if name.startswith("eyeLook"))  # for a client that turns eyes by bones
Frames = NDArray[np.float32]  # (T, W) weights, or (T, W + H) with the head
Texts = tuple[list[str], list[str]]  # rows of weights and of head poses as JSON
_IDLE_TEXTS: "WeakKeyDictionary[SharedMotion, Texts]" = WeakKeyDictionary()


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
    """Events of one stream."""

    def __init__(self, session: "Session") -> None:
        self._projection = Projection(session)
        self._head_names: tuple[str, ...] | None = None
        self._n_weights = len(self._projection.names)

    def of_block(self, block: Block, begin: float) -> Iterator[Line]:
        """All frames of a block, at most `MAX_FRAMES` in an event; `begin` is in seconds of the stream."""
        names, fps = block.head.channels, block.motion.fps
        whole = self._texts_of(block)
        for at in range(0, len(block.motion), MAX_FRAMES):
            weights, heads = (texts[at : at + MAX_FRAMES] for texts in whole)
            yield Line(self._text(begin + at / fps, fps, weights, heads, names))

    def of_motion(self, motion: Trajectory, begin: float) -> Line:
        """All frames of lip motion alone."""
        texts = _texts(self._projection.frames(motion), self._n_weights)
        return Line(self._text(begin, motion.fps, *texts, ()), motion.duration)

    def _texts_of(self, block: Block) -> Texts:
        if block.idle is None:
            return _texts(self._projection.frames(block.motion, block.head), self._n_weights)
        idle, part = block.idle
        weights, heads = self._idle_texts(idle)
        return weights[part], heads[part]

    def _idle_texts(self, idle: SharedMotion) -> Texts:
        """Rows of idle motion as JSON, which all streams share."""
        weights, heads = known = _IDLE_TEXTS.setdefault(idle, ([], []))
        if len(heads) < len(idle):
            new = slice(len(heads), len(idle))
            motion = Trajectory(idle.channels, idle.weights[new], idle.fps)
            head = Trajectory(idle.head_channels, idle.head[new], idle.fps)
            more = _texts(self._projection.frames(motion, head), self._n_weights)
            weights += more[0]
            heads += more[1]
        return known

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


def _texts(frames: Frames, n_weights: int) -> Texts:
    """Rows of weights and of head poses as JSON."""
    rows = [[round(value, 4) for value in row] for row in frames.tolist()]
    return [_text(row[:n_weights]) for row in rows], [_text(row[n_weights:]) for row in rows if len(row) > n_weights]


def _text(row: list[float]) -> str:
    return json.dumps(row, separators=(",", ":"))
