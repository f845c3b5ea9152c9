"""A live face on a clock: text or sound goes in from any thread, frames come out."""

import asyncio
import atexit
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError, Tts2faceError
from lexicon.gesture_marks import parse_gesture
from lexicon.gesture_names import GESTURES
from lexicon.marked_text import GestureMark
from lexicon.values.checks import Place as Argument
from lexicon.values.checks import typed
from tts2face.numeric.arrays import Float32Array
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.session.live import AHEAD_S
from tts2face.session.live.blocks import Item
from tts2face.session.live.clock import FrameClock
from tts2face.session.live.drawing import PoseDrawer
from tts2face.session.live.frames import Frame
from tts2face.session.live.line import Line, Place
from tts2face.session.live.lips import RATE_LIMITS, LiveLips
from tts2face.session.live.live_face import LiveFace
from tts2face.session.live.numbers import UtteranceNumbers
from tts2face.session.live.speech import LiveSpeech
from tts2face.sound.features import FEATURE_RATE
from tts2face.sound.listener import checked_block

MOST_AHEAD_S = 2.0  # frames of 512 x 512 are 0.8 MB each
READY_S = 2.0  # of motion and sound that are made before the line has room: the next sentences
IDLE_AHEAD_S = 2.0  # of idle motion that is made before it is needed
SHARED_WAIT_S = 0.02  # until it is seen whether another stream has made more of the idle motion
FIRST_WAIT_S = 0.005  # after which an asynchronous reader asks for a first frame again
THREAD = "live face"
checked_text = typed(str)
CLOSED = "the stream is closed; open another one"


class FaceStream:
    """One face on a clock; made by `tts2face.Session.face_stream`, and closed by `close` or a ``with`` block.

    All methods may be called from any thread, and return at once but for `read`. A thread makes motion and sound,
    another one draws. The next `read` raises what went wrong with a text or a sound; the stream goes on behind it.

    Parameters
    ----------
    speech
        Clip without an end, with the options of the stream.
    lips
        Returns the lip motion of sound with a rate in Hz.
    renderer
        Returns what draws the frames; None: they have no pictures.
    channels
        Names of the weights of all frames.
    idle, ahead_s
        As for `tts2face.Session.face_stream`.

    Attributes
    ----------
    fps
        Frames per second.
    """

    def __init__(
        self,
        speech: LiveSpeech,
        lips: Callable[[int], LiveLips],
        renderer: Callable[[], FrameRenderer] | None,
        channels: tuple[str, ...],
        *,
        idle: bool = True,
        ahead_s: float = AHEAD_S,
    ) -> None:
        if not 0.0 < ahead_s <= MOST_AHEAD_S:
            raise InputError(f"ahead_s must be above 0 and at most {MOST_AHEAD_S:g} s, not {ahead_s:g}")
        self.fps, self.channels = speech.fps, channels
        self._lips = lips
        length = max(round(ahead_s * self.fps), 2)
        self._n_idle = round(IDLE_AHEAD_S * self.fps)
        self._line = Line(self.fps, length, has_idle=idle, draws=renderer is not None)
        self._face = LiveFace(speech, lips)
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._inbox: deque[tuple[int, Callable[[], object]]] = deque()  # each with its utterance; 0: none
        self._errors: deque[BaseException] = deque()
        self._failure: BaseException | None = None  # that ended a thread
        self._is_closed = False
        self._numbers = UtteranceNumbers()
        self._pushed: dict[int, list[Float32Array]] = {}  # blocks of utterances that have not been taken
        tasks = [self._make, *([] if renderer is None else [partial(self._draw, renderer)])]
        self._threads = [
            threading.Thread(target=self._guarded, args=[task], name=THREAD, daemon=True) for task in tasks
        ]
        atexit.register(self.close)  # a process that ends while native code runs in a thread aborts
        for thread in self._threads:
            thread.start()

    def say(self, text: str) -> int:
        """Speak a text, of one sentence or several, after everything before it; returns the number of the utterance."""
        text = checked_text(text, Argument("text"))
        with self._lock:
            number = self._numbers.next()
            self._post(number, lambda: self._face.say(number, text))
            return number

    def push_text(self, part: str) -> int:
        """Speak more of a text as it is written, sentence by sentence; until `end_text` it is one utterance."""
        part = checked_text(part, Argument("part"))
        with self._lock:
            number = self._numbers.open_text()
            self._post(number, lambda: self._face.add_text(number, part))
            return number

    def end_text(self) -> None:
        """Speak the rest of the text that was pushed."""
        with self._lock:
            if number := self._numbers.end_text():
                self._post(number, lambda: self._face.end(number))

    def push_sound(self, samples: NDArray[np.floating], rate: int) -> int:
        """Speak more of a sound, whose lips, head and brows follow it; until `end_sound` it is one utterance.

        Parameters
        ----------
        samples : (m,)
            In [-1, 1], of any number.
        rate
            Sample rate in Hz, the same until `end_sound`.
        """
        samples, (low, high) = checked_block(samples), RATE_LIMITS
        if not low <= rate <= high:
            raise InputError(f"the sample rate must lie between {low} and {high} Hz, not {rate}; convert the sound")
        with self._lock:
            if (begun := self._numbers.open_rate) not in (0, rate):
                raise InputError(f"the sound began with {begun} Hz, not {rate}; end it before another rate")
            number = self._numbers.open_sound(rate)
            waiting = self._pushed.setdefault(number, [])
            waiting.append(samples)
            if len(waiting) == 1:
                self._post(number, lambda: self._take_sound(number, rate))
            return number

    def end_sound(self) -> None:
        """The sound that was pushed is complete: the frames of its end can be made."""
        with self._lock:
            if number := self._numbers.end_sound():
                self._post(number, lambda: self._face.end(number))

    def listen(self, samples: NDArray[np.floating] | None = None, rate: int | None = None) -> None:
        """Listen until the next speech; `samples` are what the other one says, at whose pauses the face nods."""
        heard = None if samples is None else checked_block(samples)
        if (heard is None) != (rate is None):
            raise InputError("samples that are heard need their rate, and a rate its samples; give both, or neither")
        with self._lock:
            self._post(0, lambda: self._face.hear_at(rate, heard))

    def gesture(self, written: str | GestureMark) -> None:
        """Make a gesture, or look somewhere, with the next word that is not made yet, in silence at once.

        `written` is as between the brackets of a mark of a text: ``nod``, ``wink left``, ``look left 20 2s``.
        """
        mark = parse_gesture(written, 0) if isinstance(written, str) else written
        if not isinstance(mark, GestureMark):
            raise InputError(f"there is no gesture {str(written)[:40]!r}; choose {', '.join(GESTURES)}")
        with self._lock:
            self._post(0, lambda: self._face.gesture(mark))

    def style(self, name: str) -> None:
        """From the next word or the next silence on, face and voice have another style, as of `LiveSpeech`."""
        name = checked_text(name, Argument("style"))
        with self._lock:
            self._post(0, lambda: self._face.change_style(name))

    def interrupt(self, utterance: int | None = None) -> float:
        """Forget an utterance, or all; returns the seconds of it (None: of the present one) that have been read.

        The mouth closes, and the head goes on, from the last frame that was read.
        """
        with self._lock:
            self._numbers.forget(utterance)
            self._inbox = deque(message for message in self._inbox if not self._numbers.is_forgotten(message[0]))
            self._pushed = {
                number: blocks for number, blocks in self._pushed.items() if not self._numbers.is_forgotten(number)
            }
            self._post(0, lambda: self._face.interrupt(utterance))
            return self._line.interrupt(utterance)

    def _take_sound(self, number: int, rate: int) -> None:
        """Add all blocks that have come at once: the lips of many short ones take longer."""
        with self._lock:
            blocks = self._pushed.pop(number, None)
        if blocks:
            self._face.add_sound(number, np.concatenate(blocks), rate)

    def _post(self, number: int, follow: Callable[[], object]) -> None:
        if self._is_closed:
            raise InputError(CLOSED)
        self._inbox.append((number, follow))
        self._changed.notify_all()

    @property
    def late(self) -> int:
        """Frames so far whose picture was not drawn in time."""
        return self._line.late

    @property
    def look_ahead_s(self) -> float:
        """Seconds of pushed sound behind a frame that are needed to make it; a text needs none."""
        return self._lips(FEATURE_RATE).look_ahead_s

    def read(self, timeout: float | None = None) -> Frame | None:
        """The next frame, for a reader with a clock of its own: each call is one tick.

        It is None, and uses no number, if there is none in time or the stream is closed. A text or a sound that could
        not be spoken raises its error, and what waits behind it follows.

        Parameters
        ----------
        timeout
            Seconds to wait for it, after which idle motion fills a gap of an utterance that is not made in time; None:
            until there is one, or the stream is closed.
        """
        until = None if timeout is None else time.monotonic() + timeout
        with self._lock:
            while not self._is_closed:
                self._raise_errors()
                left = None if until is None else until - time.monotonic()
                is_late = left is not None and left <= 0.0
                frame = self._line.take(fills_gaps=is_late) if self._line.has_begun else None
                if frame is not None:
                    self._changed.notify_all()
                if frame is not None or is_late:
                    return frame
                self._changed.wait(left)
            return None

    def frames(self, *, paced: bool = True) -> Iterator[Frame]:
        """Frames until the stream is closed; errors as of `read`.

        Parameters
        ----------
        paced
            One a tick of a steady clock: frame n of a reader is due ``n / fps`` seconds after its first one, and where
            no motion is made in time, the last pose stands. Otherwise as soon as each is made.
        """
        clock = FrameClock(self.fps)
        while not self._is_closed:
            frame = self.read(None if clock.is_new or not paced else 0.0) or self._held()
            if frame is None:  # nothing is said, and the face is not idle
                clock = FrameClock(self.fps)
                continue
            yield frame
            if paced:
                time.sleep(clock.wait_s())

    async def __aiter__(self) -> AsyncIterator[Frame]:
        """Frames on a steady clock, as `frames`; the event loop goes on meanwhile."""
        clock = FrameClock(self.fps)
        while not self._is_closed:
            frame = self.read(0.0) or (None if clock.is_new else self._held())
            if frame is None:
                clock = FrameClock(self.fps)
                await asyncio.sleep(FIRST_WAIT_S)
                continue
            yield frame
            await asyncio.sleep(clock.wait_s())

    def _held(self) -> Frame | None:
        with self._lock:
            return None if self._is_closed else self._line.hold()

    def _raise_errors(self) -> None:
        if self._failure is not None:
            raise self._failure
        if self._errors:
            raise self._errors.popleft()

    def close(self) -> None:
        """End the stream and its threads; what waits is forgotten."""
        with self._lock:
            self._is_closed = True
            self._changed.notify_all()
        for thread in self._threads:
            thread.join()
        atexit.unregister(self.close)

    def __enter__(self) -> "FaceStream":
        """Return the stream itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the stream."""
        self.close()

    async def __aenter__(self) -> "FaceStream":
        """Return the stream itself."""
        return self

    async def __aexit__(self, *_: object) -> None:
        """Close the stream in a thread."""
        await asyncio.to_thread(self.close)

    def _guarded(self, task: Callable[[], None]) -> None:
        try:
            task()
        except BaseException as error:  # noqa: BLE001 - whoever reads gets it
            with self._lock:
                self._failure = error
                self._changed.notify_all()

    def _make(self) -> None:
        """Make motion and sound until the stream is closed."""
        face = self._face
        while not self._is_closed:
            with self._lock:
                self._changed.wait_for(self._has_work)
                messages, self._inbox = self._inbox, deque()
                is_speaking = self._line.is_speaking
            for number, follow in messages:
                with self._reported():
                    if not self._numbers.is_forgotten(number):
                        follow()
            if face.has_speech and not is_speaking:
                face.rest()
            self._line.is_moved = face.is_moved and not face.has_speech
            with self._reported():
                self._make_more()
            with self._lock:
                if len(face.idle.motion) and self._line.idle is not face.idle:
                    self._line.idle = face.idle
                    self._line.fill()
                self._changed.notify_all()

    def _make_more(self) -> None:
        """Make the next sentence, some silence, or more of the idle motion."""
        face = self._face
        if face.has_speech:
            self._put(face.speak())
        elif face.is_moved and not self._line.has_blocks:
            self._put(face.silence())
        elif not face.idle.has(self._n_idle) and not face.idle.motion.grow():
            time.sleep(SHARED_WAIT_S)

    def _has_work(self) -> bool:
        face = self._face
        is_silent = face.is_moved and not self._line.has_blocks
        return self._is_closed or bool(self._inbox) or face.has_speech or is_silent or not self._has_idle()

    def _has_idle(self) -> bool:
        return self._line.idle is self._face.idle and self._face.idle.has(self._n_idle)

    @contextmanager
    def _reported(self) -> Iterator[None]:
        """Errors of the product are raised by the next `read`."""
        try:
            yield
        except Tts2faceError as error:
            with self._lock:
                self._errors.append(error)
                self._changed.notify_all()

    def _put(self, items: Iterator[Item]) -> None:
        """Put what is made in line, each when there is room for it; ends with an utterance that is forgotten."""
        for item in items:
            with self._lock:
                number = getattr(item, "utterance", 0)
                self._changed.wait_for(lambda: self._line.seconds_waiting < READY_S or self._has_ended(number))  # noqa: B023
                if self._has_ended(number):
                    return
                self._line.add(item)
                self._changed.notify_all()

    def _has_ended(self, number: int) -> bool:
        return self._is_closed or self._numbers.is_forgotten(number)

    def _draw(self, load: Callable[[], FrameRenderer]) -> None:
        """Draw frames of the line until the stream is closed."""
        drawer = PoseDrawer(load(), self.channels, self.fps)
        drawer.prepare()
        while (place := self._next_place()) is not None:
            started = time.monotonic()
            pixels = drawer.draw(place.weights, place.head, place.number)
            with self._lock:
                self._line.drawn(place, pixels, time.monotonic() - started)
                self._changed.notify_all()

    def _next_place(self) -> Place | None:
        """The next frame to draw; None when the stream is closed."""
        with self._lock:
            place = None
            while not self._is_closed and (place := self._line.next_to_draw()) is None:
                self._changed.wait()
            return None if self._is_closed else place
