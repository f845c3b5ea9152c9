"""Tasks in threads that take turns: one at a time computes, and others go on while it waits for another process."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from tts2face.service.synthesis.messages import Wait
from tts2face.service.synthesis.scheduler import Step

Result = TypeVar("Result")

POLL_S = 0.01  # between looks whether a wait for a lock has been abandoned


class AbandonedError(Exception):
    """A wait that has been abandoned."""


class CancelledTaskError(BaseException):
    """The task has been cancelled while it waited; releases what its steps hold."""


class InterruptedTaskError(Exception):
    """What the task waited for is no longer needed; the task goes on."""


class TurnSteps:
    """Steps of a task that run in a thread of their own, at the turns that the scheduler gives.

    A step that waits by `wait_elsewhere` ends its turn with a `Wait`; when the wait is over, `wake` is called, and the
    step continues at the next turn.

    Parameters
    ----------
    make
        Makes the steps, at the first turn.
    wake
        Requests a turn; called from other threads.
    """

    def __init__(self, make: Callable[[], Iterator[Step]], wake: Callable[[], None]) -> None:
        self._make, self._wake = make, wake
        self._turn, self._back = threading.Semaphore(0), threading.Semaphore(0)
        self._found: Step | BaseException | None = None
        self._is_waiting = self._is_over = self._is_interrupted = self._is_closed = False
        self._abandon: Callable[[], None] | None = None
        self._thread: threading.Thread | None = None

    def __iter__(self) -> "TurnSteps":
        """Return the steps themselves."""
        return self

    def __next__(self) -> Step:
        """Run the task until its next step is made, or until it waits for another process."""
        if self._is_closed or isinstance(self._found, StopIteration):
            raise StopIteration
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="task", daemon=True)
            self._thread.start()
        if self._is_waiting and not self._is_over:
            return Wait()
        self._turn.release()
        self._back.acquire()
        if self._is_waiting:
            return Wait()
        found = self._found
        if isinstance(found, BaseException):
            raise found
        assert found is not None
        return found

    def close(self) -> None:
        """Cancel the task; returns when it has released what it held."""
        if self._is_closed or self._thread is None:
            self._is_closed = True
            return
        self._is_closed = True
        if self._is_waiting and self._abandon is not None:
            self._abandon()
        self._turn.release()
        self._thread.join()

    def interrupt(self) -> None:
        """Continue the task with an `InterruptedTaskError` where it waits, even if that wait is over.

        Does nothing if the task does not wait, that is, has made a step.
        """
        if not self._is_waiting:
            return
        self._is_interrupted = True
        if not self._is_over and self._abandon is not None:
            self._abandon()

    def wait_elsewhere(self, wait: Callable[[], Result], abandon: Callable[[], None]) -> Result:
        """Result of `wait`, during which other tasks have their turns.

        Parameters
        ----------
        abandon
            Ends the wait with an exception when the task is cancelled.

        Raises
        ------
        CancelledTaskError, InterruptedTaskError
            The task has been cancelled or interrupted.
        """
        self._abandon, self._is_over, self._is_interrupted, self._is_waiting = abandon, False, False, True
        self._back.release()
        try:
            return wait()
        finally:
            self._is_over = True
            self._wake()
            self._turn.acquire()
            self._is_waiting, self._abandon = False, None
            if self._is_closed:
                raise CancelledTaskError
            if self._is_interrupted:
                raise InterruptedTaskError

    def _run(self) -> None:
        _CURRENT.steps = self
        self._turn.acquire()
        steps: Any = None
        try:
            steps = self._make()
            while not self._is_closed:
                self._found = next(steps)
                self._back.release()
                self._turn.acquire()
        except CancelledTaskError:
            pass
        except BaseException as error:  # noqa: BLE001 - raised again in the scheduler's thread
            self._found = error
        finally:
            if hasattr(steps, "close"):
                steps.close()
            self._back.release()


class QueueLock:
    """A lock that threads get in the order in which they ask for it, and for which they need not wait to the end."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._queue: deque[object] = deque()  # who holds it, then who waits

    @contextmanager
    def hold(self, is_abandoned: threading.Event) -> Iterator[None]:
        """The lock for a ``with`` block.

        Raises
        ------
        AbandonedError
            `is_abandoned` is set before the lock is free.
        """
        place = object()
        with self._changed:
            self._queue.append(place)
        try:
            with self._changed:
                while self._queue[0] is not place and not is_abandoned.is_set():
                    self._changed.wait(POLL_S)
            if is_abandoned.is_set():
                raise AbandonedError
            yield
        finally:
            with self._changed:
                self._queue.remove(place)
                self._changed.notify_all()


class OneAtATime:
    """Runs computations of native code one after another while other tasks have their turns."""

    def __init__(self) -> None:
        self._lock = QueueLock()

    def __call__(self, compute: Callable[[], Result], end: Callable[[], None]) -> Result:
        """Result of `compute`, which `end` ends early; both are called from different threads."""
        is_abandoned = threading.Event()

        def run() -> Result:
            with self._lock.hold(is_abandoned):
                return compute()

        def abandon() -> None:
            is_abandoned.set()
            end()

        return wait_elsewhere(run, abandon)


_CURRENT = threading.local()


def wait_elsewhere(wait: Callable[[], Result], abandon: Callable[[], None]) -> Result:
    """As `TurnSteps.wait_elsewhere` of the task whose thread calls it; in other threads `wait` alone."""
    steps: TurnSteps | None = getattr(_CURRENT, "steps", None)
    return wait() if steps is None else steps.wait_elsewhere(wait, abandon)
