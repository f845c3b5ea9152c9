"""Turns of the uploads that are checked."""

import asyncio

from tts2face.service.errors import RefusedError

MAX_CHECKS, MAX_WAITING = 2, 8  # uploads that are checked, and that wait for it


class Checks:
    """Turns of the uploads that are checked."""

    def __init__(self) -> None:
        self._turns, self._n_waiting = asyncio.Semaphore(MAX_CHECKS), 0

    async def __aenter__(self) -> None:
        """Wait for a turn.

        Raises
        ------
        RefusedError
            Too many wait already.
        """
        if self._turns.locked() and self._n_waiting >= MAX_WAITING:
            raise RefusedError(
                429, "busy", f"{self._n_waiting} uploads wait to be checked; send it again later", {"Retry-After": "10"}
            )
        self._n_waiting += 1
        try:
            await self._turns.acquire()
        finally:
            self._n_waiting -= 1

    async def __aexit__(self, *_: object) -> None:
        """End the turn."""
        self._turns.release()
