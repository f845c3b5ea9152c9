"""Waiting for background work of the studio."""

import asyncio
from collections.abc import Callable
from typing import Any

from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.studio.work import BackgroundWork

OWNER = LOCAL_KEY.name


async def settle(*all_work: BackgroundWork) -> None:
    """Wait until no work is open."""
    async with asyncio.timeout(20):
        while any(work.is_open for work in all_work):
            await asyncio.sleep(0.01)


async def until(condition: Callable[[], Any]) -> None:
    async with asyncio.timeout(20):
        while not condition():
            await asyncio.sleep(0.01)
