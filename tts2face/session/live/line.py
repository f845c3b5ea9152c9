"""The frames of a live face that wait to be read: a short line, refilled from what is made, or by idle motion.

Without threads: `tts2face.session.live.stream` calls it under one lock.
"""

import math
from collections import OrderedDict, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array
from tts2face.session.live.blocks import Block, End, Item, Note, State
from tts2face.session.live.frames import Frame, LiveEvent, events_of
from tts2face.session.live.idle import IdlePlayer
from tts2face.session.live.joins import Joins
from tts2face.types import SOUND_RATE, exact_rate, first_sample

KEPT = 2  # silent frames of the line that are still shown when speech is ready: they may be drawn already
KNOWN_UTTERANCES = 64  # whose frames that have been read are counted
MAX_DRAW_SHARE = 0.5  # of a line, which the mean drawing time has at most: kernels compile for seconds


@dataclass(slots=True, eq=False)
class Place:
    """A frame of the line: the block of which it is a frame, as it was made, its pose and sound, and its picture.

    `utterance` is that within which it stands; the block of idle motion that fills a gap of one has none.
    """

    block: Block
    weights: Float32Array
    head: Float32Array
    sound: Float32Array
    number: int
    events: tuple[LiveEvent, ...] = ()
    utterance: int = 0
    ends: bool = False
    pixels: NDArray[np.uint8] | None = None
    is_read: bool = False
    is_forgotten: bool = False


class Line:
    """Frames that wait to be read, and blocks of which they are made.

    Parameters
    ----------
    length
        Number of frames in the line.
    has_idle
        Whether idle motion fills it where nothing is said.
    draws
        Whether frames have pictures.

    Attributes
    ----------
    idle
        Idle motion; None until there is some.
    late
        Pictures that were not drawn when their frames were read.
    is_moved
        Whether the face listens or makes gestures, so that more blocks come before it is idle again.
    """

    def __init__(self, fps: float, length: int, *, has_idle: bool, draws: bool) -> None:
        self.fps, self.length = fps, length
        self.late, self.is_moved = 0, False
        self.idle: IdlePlayer | None = None
        self._has_idle, self._draws = has_idle, draws
        self._rate = exact_rate(fps)
        self._joins = Joins(fps)
        self._blocks: deque[Block | End] = deque()
        self._n_waiting = 0  # frames of blocks
        self._places: deque[Place] = deque()
        self._number = 0  # of the next frame that is read
        self._last: Place | None = None  # that was read
        self._now: Block | None = None  # whose frames enter the line, as it was made
        self._joined: Block | None = None  # the same, joined to what was before it
        self._events: Mapping[int, list[LiveEvent]] = {}
        self._n_entered = 0  # of its frames
        self._sound = np.zeros(0, np.float32)  # behind the frames that have entered
        self._speaks = 0  # utterance of which more is to come
        self._is_pushed = False  # whether it is pushed sound
        self._is_gap = False  # whether idle motion goes on until there is more of it
        self._notes: list[LiveEvent] = []
        self._heard: OrderedDict[int, int] = OrderedDict()  # frames that have been read of utterances
        self._draw_s = 0.0  # mean time of drawing
        self._drawing: Place | None = None  # frame that is being drawn
        self._late_pixels: NDArray[np.uint8] | None = None

    @property
    def has_begun(self) -> bool:
        """Whether frames may be read: the first one is drawn."""
        is_drawn = bool(self._places) and self._places[0].pixels is not None
        return not self._draws or self._last is not None or is_drawn

    @property
    def seconds_waiting(self) -> float:
        """Duration of the blocks that have not entered the line."""
        return self._n_waiting / self.fps

    @property
    def has_blocks(self) -> bool:
        """Whether a block waits, or has frames that have not entered the line."""
        return self._now is not None or bool(self._blocks)

    @property
    def is_speaking(self) -> bool:
        """Whether an utterance has not been read to its end."""
        waiting = any(not isinstance(item, Block) or item.utterance for item in self._blocks)
        return bool(self._speaks) or waiting or any(place.utterance for place in self._places)

    def add(self, item: Item) -> None:
        """Append a block, the end of an utterance, or a note on a text."""
        if isinstance(item, Note):
            self._notes.append(LiveEvent("note", item.message, 0.0, 0.0))
            return
        if isinstance(item, Block):
            if item.utterance:
                self._give_way()
            self._n_waiting += len(item.motion)
        self._blocks.append(item)
        self.fill()

    def fill(self) -> None:
        """Refill the line."""
        while len(self._places) < self.length:
            if self._now is None and not self._next_block():
                return
            self._enter()

    def take(self, *, fills_gaps: bool) -> Frame | None:
        """The next frame; None if there is none.

        Parameters
        ----------
        fills_gaps
            Whether idle motion goes on where more of an utterance is not made in time.
        """
        if not self._places:
            if self.idle is None or not (fills_gaps and (self._speaks or self.is_moved)):
                return None
            self._begin(self.idle.next(1))
            self._enter()
            # a gap of sound that arrives in real time lasts single frames
            self._is_gap = not (self._speaks and self._is_pushed)
        place = self._places.popleft()
        place.is_read, self._last = True, place
        frame = self._frame(place)
        self._number += 1
        self.fill()
        return frame

    def hold(self) -> Frame | None:
        """A frame with the pose of the last one, in silence; None where nothing is said and the face is not idle."""
        if self._last is None or not (self._has_idle or self._speaks):
            return None
        self._number += 1
        last, number = self._last, self._number - 1
        sound = np.zeros(self._samples(number), np.float32)
        return Frame(number, None, sound, last.weights, last.head, last.block.state, self._speaks)

    def _frame(self, place: Place) -> Frame:
        pixels, start = place.pixels, self._number / self.fps
        if pixels is None and self._draws:
            self.late += 1
            pixels, self._late_pixels = self._late_pixels, None  # of a frame before it, better than none
        utterance = place.utterance
        if utterance:
            self._heard[utterance] = self._heard.pop(utterance, 0) + 1
            while len(self._heard) > KNOWN_UTTERANCES:
                self._heard.popitem(last=False)
        events = tuple(replace(event, start=event.start + start, end=event.end + start) for event in place.events)
        state: State = "speaking" if utterance else place.block.state
        return Frame(self._number, pixels, place.sound, place.weights, place.head, state, utterance, place.ends, events)

    def _next_block(self) -> bool:
        """Begin the next block; False where the line is long enough without one."""
        while self._blocks:
            item = self._blocks.popleft()
            if isinstance(item, Block):
                self._n_waiting -= len(item.motion)
                self._begin(item)
                return True
            if not self._end(item):
                self._blocks.appendleft(item)
                return False
        is_awaited = bool(self._speaks) or self.is_moved
        if self.idle is None or not (self._is_gap if is_awaited else self._has_idle):
            return False
        self._begin(self.idle.next(1))
        return True

    def _begin(self, block: Block) -> None:
        self._now, self._n_entered = block, 0
        self._joined = self._joins.add(block)
        self._events = events_of(block)
        self._is_gap = self._is_gap and block.source == "idle"
        if block.utterance:
            self._speaks, self._is_pushed = block.utterance, block.source == "sound"
        if block.sound is not None:
            self._sound = np.concatenate([self._sound, block.sound.samples])
        elif len(self._sound):
            self._sound = self._sound[:0]  # less than a sample was left by the frames of its utterance

    def _enter(self) -> None:
        """Append the next frame of the present block."""
        block, joined = self._now, self._joined
        assert block is not None
        assert joined is not None
        at = self._n_entered
        number = self._number + len(self._places)
        count = self._samples(number)
        sound, self._sound = self._sound[:count], self._sound[count:]
        if len(sound) < count:
            sound = np.pad(sound, (0, count - len(sound)))
        start = at / self.fps
        events = [
            replace(event, start=event.start - start, end=event.end - start) for event in self._events.get(at, ())
        ]
        events, self._notes = [*self._notes, *events], []
        pose = joined.motion.values[at], joined.head.values[at]
        self._places.append(Place(block, *pose, sound, number, tuple(events), block.utterance or self._speaks))
        self._n_entered += 1
        if self._n_entered == len(block.motion):
            self._now = self._joined = None

    def _end(self, end: End) -> bool:
        """Mark the last frame of an utterance; False where that has been read, and no motion is there for another."""
        last = next((place for place in reversed(self._places) if place.utterance == end.utterance), None)
        if last is None:
            if self.idle is None:
                return False
            self._begin(self.idle.next(1))
            self._enter()
            last = self._places[-1]
            last.utterance = end.utterance
        last.ends = True
        self._speaks = 0 if self._speaks == end.utterance else self._speaks
        return True

    def _samples(self, number: int) -> int:
        """Samples of a frame."""
        first, following = (first_sample(at, SOUND_RATE, self._rate) for at in (number, number + 1))
        return following - first

    def _give_way(self) -> None:
        """Leave out silence that waits: what is said is shown at once."""
        n_before = len(self._places)
        said = deque(item for item in self._blocks if isinstance(item, End) or item.utterance)
        self._blocks, self._n_waiting = said, _n_frames(said)
        if self._now is not None and not self._now.utterance:
            self._now = self._joined = None
            self._joins.cut(self._pose())
        while len(self._places) > KEPT and not self._places[-1].block.utterance and not self._places[-1].ends:
            self._places.pop().is_forgotten = True
        if len(self._places) < n_before:
            self._joins.cut(self._pose())

    def _pose(self) -> tuple[Float32Array, Float32Array] | None:
        """Pose of the last frame of the line, or of the last one that was read."""
        last = self._places[-1] if self._places else self._last
        return None if last is None else (last.weights, last.head)

    def interrupt(self, number: int | None = None) -> float:
        """Forget all that waits, or an utterance; seconds of it (None: of the present one) that have been read."""
        current = self._present if number is None else number
        heard = self._heard.get(current, 0) / self.fps
        kept: list[Block] = []
        while self._places and self._is_behind(number):
            place = self._places.pop()
            place.is_forgotten = True
            is_other = number is not None and place.utterance not in (0, number)
            if is_other and not (kept and kept[0] is place.block) and place.block is not self._now:
                kept.insert(0, place.block)
        self._forget_blocks(number, kept)
        self._late_pixels, self._notes = None, []
        if self._drawing is not None:
            self._drawing.is_forgotten = True
        self._joins.cut(self._pose())
        self.fill()
        return heard

    @property
    def _present(self) -> int:
        """Utterance of the last frame that was read, or the one that is about to begin."""
        if self._last is not None and self._last.utterance and not self._last.ends:
            return self._last.utterance
        return self._speaks

    def _is_behind(self, number: int | None) -> bool:
        """Whether the last frame of the line is to be forgotten, or lies behind one that is."""
        return any(place.utterance == number or (number is None and place.utterance) for place in self._places)

    def _forget_blocks(self, number: int | None, kept: list[Block]) -> None:
        blocks: list[Block | End] = [*kept]
        if self._now is not None and number is not None and self._now.utterance not in (0, number):
            blocks.append(self._now)
        blocks += [item for item in self._blocks if number is not None and item.utterance != number]
        self._blocks, self._n_waiting = deque(blocks), _n_frames(blocks)
        self._now = self._joined = None
        self._sound = self._sound[:0]
        if number is None or self._speaks == number:
            self._speaks = 0

    def next_to_draw(self) -> Place | None:
        """The first frame without a picture that can be drawn before it is read, or else the last one.

        A picture that comes late is shown in place of the next one that is missing.
        """
        first = min(math.ceil(self._draw_s * self.fps), len(self._places) - 1)
        waiting = (place for at, place in enumerate(self._places) if at >= first and place.pixels is None)
        self._drawing = next(waiting, None)
        return self._drawing

    def drawn(self, place: Place, pixels: NDArray[np.uint8], seconds: float) -> None:
        """Add the picture of a frame, which took some seconds."""
        most = max(MAX_DRAW_SHARE * self.length / self.fps, 1.0 / self.fps)
        self._draw_s += 0.1 * (min(seconds, most) - self._draw_s)
        self._drawing = None
        if place.is_read and not place.is_forgotten:
            self._late_pixels = pixels
        elif not place.is_read:
            place.pixels = pixels


def _n_frames(items: Iterable[Block | End]) -> int:
    return sum(len(item.motion) for item in items if isinstance(item, Block))
