"""Live streams that are shown on targets of the operator, each in a process of its own.

Clients choose names; what is behind them is in the operator's settings alone.
"""

import asyncio
import logging
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import aclosing, suppress
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.processes.async_parent import AsyncChild
from tts2face.processes.message import RESULT, Message
from tts2face.serving.service.access import Permissions
from tts2face.serving.service.errors import RefusedError, as_refused
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.messages import Work
from tts2face.serving.service.pool import InputQueue, each_input
from tts2face.targets.live_process import LIVE_PROGRAM, PRESENT
from tts2face.targets.states import LOST
from tts2face.targets.table import check_target, named_targets, parse_target

SCOPE = "live"  # of keys that may choose a target
USUAL_RATE = 16_000  # Hz, of a stream of sound that names none
CLOSE_S = 5.0  # within which the connections to targets are closed when a client has left


class Presentations:
    """Targets by name, of which each shows one live stream at a time.

    Parameters
    ----------
    written
        ``NAME=TARGET`` of the settings; errors as of `tts2face.targets.table.check_target`.
    """

    def __init__(self, written: Sequence[str], permissions: Permissions) -> None:
        self._targets: Mapping[str, str] = named_targets(written)
        for target in self._targets.values():
            check_target(parse_target(target))
        self._permissions = permissions
        self._taken: set[str] = set()

    def check(self, key: ApiKey, names: Sequence[str]) -> None:
        """Refuse names that a key may not choose, that are not known, or that show another stream."""
        self._permissions.keys.with_scope(key, SCOPE)
        for name in names:
            if name not in self._targets:
                known = ", ".join(self._targets) or "none"
                raise RefusedError(404, "not_found", f"there is no target {name[:40]!r}; the targets are {known}")
            if name in self._taken:
                raise RefusedError(409, "taken", f"the target {name} shows another stream; choose another one, or wait")

    async def messages(
        self, work: Work, key: ApiKey, inputs: InputQueue, names: Sequence[str]
    ) -> AsyncIterator[Message]:
        """Messages of a stream as `Results.messages` has them; the targets are free behind it."""
        self.check(key, names)
        key = self._permissions.speaking_key(key)
        chosen = {name: self._targets[name] for name in dict.fromkeys(names)}
        self._taken |= chosen.keys()
        released, spoken_s = asyncio.Event(), 0.0
        child = AsyncChild(LIVE_PROGRAM, lambda _: released.set())
        rate = work.request.get("rate", USUAL_RATE) if work.kind == "listen" else None
        request = dict(work.request) if rate is None else {}
        # a target shows a face at all times
        request.pop("with_idle", None)
        content = {"models": dict(work.models), "request": request, "targets": chosen, "rate": rate}
        try:
            async with aclosing(child.stream(PRESENT, content, inputs=each_input(inputs))) as messages:
                async for message in messages:
                    seconds = message.content["seconds"]
                    self._permissions.limits.add_speech(key, seconds - spoken_s)
                    spoken_s = seconds
                    if message.kind == RESULT:
                        released.set()
                        return
                    _log_target(message.content["event"])
                    yield message
        except Tts2faceError as error:
            released.set()
            raise as_refused(error) from error
        finally:
            with suppress(TimeoutError):
                await asyncio.wait_for(released.wait(), CLOSE_S)
            await child.close()
            self._taken -= chosen.keys()


def _log_target(event: Mapping[str, Any]) -> None:
    if event["type"] == "target":
        level = logging.WARNING if event["state"] == LOST else logging.INFO
        log_event(
            "live target", level=level, target=event["name"], state=event["state"], reason=event.get("reason", "")
        )  # fmt: skip
