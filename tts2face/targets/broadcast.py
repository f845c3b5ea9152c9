"""A live face that is sent to targets while it says what it is given."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError, Tts2faceError
from tts2face.picture.options import Picture
from tts2face.targets.address import Address
from tts2face.targets.feeds import Feed
from tts2face.targets.live_targets import LiveTargets
from tts2face.targets.states import CONNECTED, LOST, TargetState
from tts2face.targets.table import make_target
from tts2face.targets.target import Target
from tts2face.targets.tick import LiveFormat, TickMaker
from tts2face.targets.window import WindowTarget
from tts2face.types import exact_rate

if TYPE_CHECKING:
    from tts2face.session.live.stream import FaceStream
    from tts2face.session.session import Session

TAIL_S = 0.5  # of silence behind the last utterance
REACH_S = 60.0  # within which one of the targets must be reached, where the end of what is said is awaited


@dataclass(frozen=True, slots=True)
class LivePlan:
    """Targets of a live face, its pictures and its speech.

    Parameters
    ----------
    addresses
        Of the targets.
    picture
        Of those that show pictures.
    options
        Fields of `tts2face.request.Request`.
    stays
        It goes on when all has been said.
    names
        Of the targets in states; without any their kinds and places.
    """

    addresses: tuple[Address, ...]
    picture: Picture
    options: dict[str, Any] = field(default_factory=dict)
    fps: float = 30.0
    stays: bool = False
    names: tuple[str, ...] = ()

    @property
    def format(self) -> LiveFormat:
        """Rate and size of the frames."""
        return LiveFormat(exact_rate(self.fps), self.picture.width, self.picture.height)

    @property
    def shown_names(self) -> tuple[str, ...]:
        """Names of the targets in states, each another one: several places of a server are numbered."""
        shown = [address.shown for address in self.addresses]
        numbers = (shown[: at + 1].count(name) for at, name in enumerate(shown))
        numbered = (f"{name} ({n})" if n > 1 else name for name, n in zip(shown, numbers, strict=True))
        return self.names or tuple(numbered)

    def make_targets(self) -> tuple[Target, ...]:
        """The targets, which connect later; errors as `make_target`."""
        return tuple(make_target(address, self.format) for address in self.addresses)


@dataclass(frozen=True, slots=True)
class Listener:
    """Called with each state of a target, what cannot be said, and an utterance whose last frame was sent."""

    on_state: Callable[[TargetState], object]
    on_error: Callable[[Tts2faceError], object]
    on_end: Callable[[int], object] = int


class Broadcast:
    """One live face and its targets, until it ends by itself or by `end`.

    Parameters
    ----------
    targets
        Of `LivePlan.make_targets`.
    listener
        Called from the threads of the broadcast.

    Attributes
    ----------
    n_frames, n_spoken, n_late
        Frames that were sent, how many of them in speech, and how many without a picture of their own.
    """

    def __init__(self, plan: LivePlan, targets: Sequence[Target], listener: Listener) -> None:
        self._plan, self._targets = plan, tuple(targets)
        self._listener = listener
        self._changed, self._has_ended = threading.Condition(), threading.Event()
        self._reached: dict[str, bool] = {}  # by target, whether it is there; none while it is tried for the first time
        self._last: int | None = None  # utterance, when all has been given
        self._n_ended = 0  # the newest utterance that has ended
        self._error: Tts2faceError | None = None
        self.n_frames = self.n_spoken = self.n_late = 0

    def end(self) -> None:
        """End soon; from any thread."""
        self._has_ended.set()
        with self._changed:
            self._changed.notify_all()

    def run(self, session: "Session", feed: Feed | None) -> None:
        """Send the face of a session, which says what `feed` gives; a window needs the main thread.

        Raises
        ------
        InputError
            A target needs what the face lacks.
        BackendError
            No target could be reached, and nobody waits for more, or the microphone or the display is missing.
        Tts2faceError
            What was given cannot be read.
        """
        plan = self._plan
        window = next((target for target in self._targets if isinstance(target, WindowTarget)), None)
        has_curves = any(target.has_curves for target in self._targets)
        mesh = session.mesh if has_curves or window is not None else None
        draws = any(target.draws for target in self._targets)
        if draws:
            mark = session.renderer(plan.picture, has_gestures=plan.options.get("gestures") != "none").mark
            for target in self._targets:
                target.mark = mark
        with session.face_stream(plan.picture, fps=plan.fps, draws=draws, **plan.options) as stream:
            maker = TickMaker(plan.format, stream.channels, mesh if has_curves else None)
            # nothing is connected before it is known that the face can be shown
            with LiveTargets(self._targets, plan.shown_names, self._note) as live:
                threading.Thread(target=self._feed, args=(stream, feed), name="feed", daemon=True).start()
                clock = threading.Thread(target=self._send_all, args=(stream, maker, live), name="clock", daemon=True)
                try:
                    if window is not None and mesh is not None:
                        clock.start()
                        window.show(mesh, plan.picture)
                    else:
                        self._send_all(stream, maker, live)
                finally:
                    self.end()
                    if clock.ident is not None:
                        clock.join()
            self.n_late = stream.late
        if self._error is not None:
            raise self._error

    def _send_all(self, stream: "FaceStream", maker: TickMaker, live: LiveTargets) -> None:
        """Send a frame a tick until the end."""
        n_silent = 0
        while not self._has_ended.is_set():
            try:
                for frame in stream.frames():
                    live.send(maker.make(frame))
                    self.n_frames += 1
                    n_silent = 0 if frame.utterance else n_silent + 1
                    self.n_spoken += bool(frame.utterance)
                    if frame.ends:
                        self._n_ended = frame.utterance
                        self._listener.on_end(frame.utterance)
                    if self._has_ended.is_set() or self._is_over(n_silent / self._plan.fps):
                        return
            except Tts2faceError as error:  # of a text; the clock goes on behind it
                self._listener.on_error(error)

    def _is_over(self, silent_s: float) -> bool:
        """Whether all has been said, some silence ago."""
        has_said_all = self._last is not None and self._n_ended >= self._last
        return has_said_all and not self._plan.stays and silent_s > TAIL_S

    def _feed(self, stream: "FaceStream", feed: Feed | None) -> None:
        """Give what is to be said as soon as a target shows it."""
        if feed is None:
            return
        try:
            self._wait_for_targets()
            self._last = feed(stream, self._has_ended.is_set)
        except Tts2faceError as error:
            self._error = None if self._has_ended.is_set() else error
            self.end()

    def _wait_for_targets(self) -> None:
        """Wait until each target has been tried, and one of them is there.

        If none is reached in time, and the end is awaited, this ends with a `BackendError`.
        """

        def is_ready() -> bool:
            has_tried = len(self._reached) == len(self._plan.shown_names)
            return self._has_ended.is_set() or (has_tried and any(self._reached.values()))

        with self._changed:
            if not self._changed.wait_for(is_ready, None if self._plan.stays else REACH_S):
                raise BackendError(f"no target was reached in {REACH_S:g} s; start the receiver, or check the address")

    def _note(self, state: TargetState) -> None:
        with self._changed:
            if state.state in {CONNECTED, LOST}:
                self._reached[state.target] = state.state == CONNECTED
            self._changed.notify_all()
        self._listener.on_state(state)
