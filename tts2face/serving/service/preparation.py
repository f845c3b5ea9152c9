"""Preparation of synthesis processes until they are ready, and how much of it is done."""

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.processes.parent import ChildEndedError
from tts2face.serving.service.logs import log_event
from tts2face.storage.user_folders import without_paths

N_ENDED = 3  # processes that end before they are ready, one after another: no accident
CallProcess = Callable[[str, Mapping[str, Any]], Awaitable[object]]  # with the name and the content of a call


@dataclass(frozen=True, slots=True)
class Step:
    """A call of a process before it is ready.

    Parameters
    ----------
    name
        What it prepares, for the log and ``/readyz``.
    call, content
        Of the call.
    is_shared
        What it makes serves all processes, as kernels in the cache do: one process makes it, the others wait.
    """

    name: str
    call: str
    content: Mapping[str, Any]
    is_shared: bool = False


class Preparation:
    """The steps of all processes of a pool.

    Each process first takes a shared step that no other one works on: kernels are compiled once, by as many processes
    as there are.
    """

    def __init__(self, steps: Sequence[Step], n_processes: int) -> None:
        self._shared = [step for step in steps if step.is_shared]
        self._own = [step for step in steps if not step.is_shared]
        self._locks = {step.name: asyncio.Lock() for step in self._shared}
        self._done: set[tuple[str, object]] = set()  # names, with the process for steps of its own
        self._now: Counter[str] = Counter()
        self._n_steps = len(self._shared) + n_processes * len(self._own)
        self._lack, self._n_ended = "", 0

    async def run(self, call: CallProcess, process: object) -> None:
        """Take part in the shared steps until all are done, then make the own ones of a process that has started.

        Parameters
        ----------
        call
            Calls the process.
        process
            Which one it is.

        Raises
        ------
        Tts2faceError
            As a step; if it is a shared one, another process makes it.
        """
        self._done -= {(step.name, process) for step in self._own}
        shared = list(self._shared)
        while shared:
            step = next((unlocked for unlocked in shared if not self._locks[unlocked.name].locked()), shared[0])
            async with self._locks[step.name]:
                await self._make(step, call, None)
            shared.remove(step)
        for step in self._own:
            await self._make(step, call, process)
        self._lack, self._n_ended = "", 0

    @property
    def lack(self) -> str:
        """Why no process can become ready, as a model that is missing or damaged; empty if there is no such reason."""
        return self._lack

    async def _make(self, step: Step, call: CallProcess, process: object) -> None:
        if (step.name, process) in self._done:
            return
        log_event("preparing", part=step.name, done=len(self._done), of=self._n_steps)
        self._now[step.name] += 1
        try:
            await call(step.call, step.content)
        except Tts2faceError as error:
            self._n_ended += isinstance(error, ChildEndedError)
            # a process that ended once is started again; an error of a model stays
            if not isinstance(error, ChildEndedError) or self._n_ended >= N_ENDED:
                self._lack = f"the service cannot prepare its {step.name}: {without_paths(str(error))}"
            raise
        finally:
            self._now[step.name] -= 1
        self._done.add((step.name, process))

    def as_json(self) -> dict[str, Any]:
        """Parts that are being prepared, and how many steps are ``done`` of all."""
        parts = sorted(name for name, number in self._now.items() if number)
        return {"parts": parts, "done": len(self._done), "of": self._n_steps}

    def __str__(self) -> str:
        """The same as a clause."""
        found = self.as_json()
        parts = ", ".join(found["parts"]) or "its processes"
        return f"the service prepares {parts} ({found['done']} of {found['of']} steps are done)"
