"""What a short request of another key waits for while clients vanish, flood a live stream or fill the queue.

``PYTHONPATH=. python tests/bench/bench_attacks.py --processes 2``; the last line is the longest step of the server's
event loop in seconds of its processor, after the first request.
"""

import argparse
import asyncio
import json
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import websockets

from cli.main import run as run_command
from tests.running import ServeProcess
from tests.serving.service.raw import connect, request
from tts2face.serving.service.keys import add_key

LONG = "We were away a year ago, but Bob may move five big maps. " * 40
N_LOOKS = 40  # of /healthz, at 20 a second
LOOK_S = 0.05
LONG_STEP_S = 0.002


class Attacked:
    """A server, and the keys of an attacker and of another client."""

    def __init__(self, processes: int, folder: Path) -> None:
        keys = folder / "keys.toml"
        self.attacker = add_key(keys, "attacker", ["speak"])
        self.limited = add_key(keys, "limited", ["speak"], requests_per_minute=5, concurrent=1)
        self.other = {"authorization": f"Bearer {add_key(keys, 'other', ['speak'])}"}
        self._steps = folder / "steps"
        self._steps.touch()
        environment = {"TTS2FACE_SERVE_WORKERS": "0"}
        self.running = ServeProcess(
            "--keys", str(keys), program=(__file__, str(self._steps)), processes=processes, environment=environment
        )  # fmt: skip
        self.running.wait_until_ready()

    def long_steps(self) -> list[float]:
        """Seconds of the processor of each step of the server's event loop above `LONG_STEP_S`."""
        return [float(line) for line in self._steps.read_text().split()]

    async def speak(self, headers: dict[str, str] | None = None) -> str:
        """Seconds that a word of the other client, or of the one of the headers, takes."""
        began = time.monotonic()
        body = {"input": "Yes.", "model": "tts-1", "voice": "alloy"}
        try:
            async with httpx.AsyncClient(timeout=120) as client:
                answer = await client.post(
                    f"{self.running.url}/v1/audio/speech", json=body, headers=headers or self.other
                )
        except httpx.TimeoutException:
            return "none in 120 s"
        return f"{time.monotonic() - began:.2f} s ({answer.status_code})"

    async def slowest_look(self) -> float:
        """Seconds of the slowest answer of /healthz."""
        slowest = 0.0
        async with httpx.AsyncClient(timeout=120) as client:
            for _ in range(N_LOOKS):
                began = time.monotonic()
                await client.get(f"{self.running.url}/healthz")
                slowest = max(slowest, time.monotonic() - began)
                await asyncio.sleep(LOOK_S)
        return slowest

    def vanish(self, n_clients: int, stay_s: float) -> None:
        """Clients that ask for a long clip and leave."""
        body = json.dumps({"text": LONG, "format": "mp4"}).encode()
        asked = request("POST", "/v1/clips", body, f"Authorization: Bearer {self.attacker}")
        connections = [connect(self.running.url) for _ in range(n_clients)]
        for connection in connections:
            connection.sendall(asked)
        time.sleep(stay_s)
        for connection in connections:
            connection.close()

    def socket(self, path: str, key: str) -> Any:
        """A WebSocket of a key."""
        address = self.running.url.replace("http", "ws", 1) + path
        return websockets.connect(address, max_size=None, additional_headers={"authorization": f"Bearer {key}"})

    async def flood(self, n_messages: int, n_characters: int) -> None:
        """A live stream that gets large texts as fast as it reads them."""
        text = (LONG * (n_characters // len(LONG) + 1))[:n_characters]
        with suppress(websockets.ConnectionClosed):
            async with self.socket("/v1/stream", self.attacker) as connection:
                await connection.send(json.dumps({"type": "start", "with_idle": False}))
                reading = asyncio.create_task(_read_all(connection))
                for _ in range(n_messages):
                    await connection.send(json.dumps({"type": "text", "text": text}))
                await reading

    async def ask_much(self, n_messages: int) -> tuple[int, int]:
        """Answers and refusals of a HeadTTS socket whose key may ask five times a minute."""
        answered = refused = 0
        async with self.socket("/", self.limited) as connection:
            for number in range(n_messages):
                await connection.send(json.dumps({"type": "synthesize", "id": number, "data": {"input": "Yes."}}))
            while answered + refused < n_messages:
                content = await connection.recv()
                if isinstance(content, str):
                    kind = json.loads(content)["type"]
                    answered, refused = answered + (kind == "audio"), refused + (kind == "error")
        return answered, refused


async def _read_all(connection: Any) -> None:
    with suppress(websockets.ConnectionClosed):
        async for _ in connection:
            pass


async def run(attacked: Attacked, n_clients: int) -> None:
    """Print a line for each attack, and the longest step."""
    print(f"idle: {await attacked.speak()}", flush=True)
    n_before = len(attacked.long_steps())
    await asyncio.to_thread(attacked.vanish, n_clients, 4.0)
    same = {"authorization": f"Bearer {attacked.attacker}"}
    print(f"{n_clients} clients of the same key have left: {await attacked.speak(same)}", flush=True)
    async with httpx.AsyncClient() as client:
        while (await client.get(f"{attacked.running.url}/readyz")).status_code != 200:
            await asyncio.sleep(1)
    floods = [asyncio.create_task(attacked.flood(30, 1_000_000 - 100)) for _ in range(2)]
    await asyncio.sleep(1.0)
    word, look = await asyncio.gather(attacked.speak(), attacked.slowest_look())
    print(f"2 live streams, 30 texts of 1 MB: {word}, /healthz at most {look:.2f} s", flush=True)
    for flood in floods:
        flood.cancel()
    await asyncio.gather(*floods, return_exceptions=True)
    floods = [asyncio.create_task(attacked.flood(300, 5_000)) for _ in range(2)]
    await asyncio.sleep(1.0)
    word, look = await asyncio.gather(attacked.speak(), attacked.slowest_look())
    print(f"2 live streams, 300 texts of 5 KB: {word}, /healthz at most {look:.2f} s", flush=True)
    for flood in floods:
        flood.cancel()
    await asyncio.gather(*floods, return_exceptions=True)
    answered, refused = await attacked.ask_much(60)
    print(f"60 messages of a key with 5 a minute: {answered} answered, {refused} refused", flush=True)
    print(f"longest step of the event loop: {max([LONG_STEP_S, *attacked.long_steps()[n_before:]]):.3f} s", flush=True)


def serve(steps: Path, arguments: list[str]) -> int:
    """Run the command line, and write the seconds of every long step of the event loop into a file."""
    run_step = asyncio.Handle._run

    def run_timed(handle: asyncio.Handle) -> None:
        began = time.thread_time()
        run_step(handle)
        if (took := time.thread_time() - began) > LONG_STEP_S:
            with steps.open("a") as file:
                file.write(f"{took:.4f}\n")

    asyncio.Handle._run = run_timed  # type: ignore[method-assign]
    return run_command(arguments)


def main() -> None:
    if sys.argv[2:3] == ["serve"]:
        sys.exit(serve(Path(sys.argv[1]), sys.argv[2:]))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--clients", type=int, default=40)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        attacked = Attacked(chosen.processes, Path(folder))
        try:
            asyncio.run(run(attacked, chosen.clients))
        finally:
            attacked.running.process.kill()
            attacked.running.close()


if __name__ == "__main__":
    main()
