"""More requests at once than may wait are answered by 200 and 429, and by nothing else."""

import asyncio
from collections import Counter

import httpx

from tests.running import HostService

SPEECH = {"input": "Hello there.", "model": "tts-1", "voice": "alloy", "response_format": "pcm"}
N_REQUESTS = 200


async def speak_many(url: str) -> Counter[int]:
    """Statuses of short requests."""
    limits = httpx.Limits(max_connections=N_REQUESTS, max_keepalive_connections=0)
    async with httpx.AsyncClient(base_url=url, limits=limits, timeout=300) as client:
        answers = await asyncio.gather(*(client.post("/v1/audio/speech", json=SPEECH) for _ in range(N_REQUESTS)))
    return Counter(answer.status_code for answer in answers)


def test_two_hundred_at_once_get_200_or_429(host: HostService) -> None:
    with host(workers=0) as running:
        statuses = asyncio.run(speak_many(running.url))
    assert set(statuses) <= {200, 429}
    assert statuses[200] >= 64  # those that may wait, at least
