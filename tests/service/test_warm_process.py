"""The server's side of a synthesis process."""

import asyncio
import os
import signal

import pytest

from tts2face.service.logs import JSON_LINES
from tts2face.service.synthesis.warm_process import WarmProcess

READY_TIMEOUT_S = 120.0


def test_the_end_of_a_process_is_not_taken_from_asyncio(caplog: pytest.LogCaptureFixture) -> None:
    """Asyncio warns of an unknown child process if something else has read its exit status."""

    async def run() -> None:
        settings = {"n_sessions": 1, "log_format": JSON_LINES, "log_text": False, "memory_mb": 0, "sentences_mb": 0}
        process = WarmProcess(settings, (), lambda: None)
        running = asyncio.create_task(process.run())
        async with asyncio.timeout(READY_TIMEOUT_S):
            for number in range(3):
                while not process.is_ready:
                    await asyncio.sleep(0.01)
                assert process.pid is not None
                if number < 2:
                    os.kill(process.pid, signal.SIGKILL)  # it is started again
                else:
                    await process.close()
                while process.is_ready:
                    await asyncio.sleep(0.01)
            await running

    asyncio.run(run())
    assert [one.getMessage() for one in caplog.records if one.name == "asyncio"] == []
