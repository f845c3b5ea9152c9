"""Frames of a live face: one tick each, with its sound, pose and picture, and the words and phones that begin in it."""

import itertools
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array
from tts2face.session.live.blocks import Block, State


@dataclass(frozen=True, slots=True)
class LiveEvent:
    """A sentence, word or phone that begins, a gesture that is made, or a note on a text.

    Parameters
    ----------
    text
        Written sentence or word, phone in IPA, name of the gesture, or the note.
    start, end
        Seconds of the stream; the same for gestures and notes.
    """

    kind: Literal["sentence", "word", "phone", "gesture", "note"]
    text: str
    start: float
    end: float


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One tick of a live face.

    Parameters
    ----------
    number
        On the clock of the stream: picture and sound begin at ``number / fps`` seconds.
    pixels : (H, W, 3 or 4) or None
        Picture; None where the one before it stands, because nothing is drawn or this one came too late.
    sound : (n,)
        All samples of the tick at 48 kHz in [-1, 1]: those from ``round(number * 48000 / fps)`` on. Zeros in silence.
    weights : (K,)
        Of the channels of the face (`FaceStream.channels`).
    head : (6,)
        Head pose as `tts2face.types.HEAD_CHANNELS`.
    utterance
        Number of what is said; 0 in silence.
    ends
        Whether it is the last frame of its utterance.
    events
        What begins within the tick.
    """

    number: int
    pixels: NDArray[np.uint8] | None
    sound: Float32Array
    weights: Float32Array
    head: Float32Array
    state: State
    utterance: int = 0
    ends: bool = False
    events: tuple[LiveEvent, ...] = ()


def events_of(block: Block) -> Mapping[int, list[LiveEvent]]:
    """Events by the frame of a block in which they begin, in seconds of the block."""
    found: dict[int, list[LiveEvent]] = defaultdict(list)
    last = len(block.motion) - 1
    for event in itertools.chain(_spoken(block), _shown(block)):
        found[min(max(int(event.start * block.motion.fps + 1e-6), 0), last)].append(event)
    return found


def _spoken(block: Block) -> Iterator[LiveEvent]:
    if block.piece is None:
        return
    speech = block.piece.clip.speech
    edges = speech.phones.edges.tolist()
    if block.piece.text:
        yield LiveEvent("sentence", block.piece.text, 0.0, edges[-1])
    for word in speech.words:
        yield LiveEvent("word", word.text, edges[word.first], edges[word.last])
    for phone, (start, end) in zip(speech.phones.phones, itertools.pairwise(edges), strict=True):
        yield LiveEvent("phone", phone, start, end)


def _shown(block: Block) -> Iterator[LiveEvent]:
    for gesture in block.shown:
        yield LiveEvent("gesture", gesture.name, gesture.time, gesture.time)
