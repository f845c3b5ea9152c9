"""Memory, threads and files of a server over many short requests.

``PYTHONPATH=. python tests/bench/bench_load.py --requests 2000 --at-once 8``
"""

import argparse
import asyncio
import time

from tests.running import RunningService, ServeProcess
from tests.service.server.test_load import Usage, speak_many, usage, wait_until_idle

N_ROWS = 5
KEEP_ALIVE_S = 1.0


def row(n_requests: int, seconds: float, now: Usage) -> str:
    rate = n_requests / seconds if seconds else 0.0
    return (
        f"| {n_requests} | {now.server_bytes / 1e6:.0f} | {now.synthesis_bytes / 1e6:.0f} | {now.n_threads} "
        f"| {now.n_files} | {now.n_children} | {rate:.1f} |"
    )


def settled_usage(service: RunningService) -> Usage:
    wait_until_idle(service)
    time.sleep(KEEP_ALIVE_S + 1.0)
    return usage(service)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--requests", type=int, default=2000)
    parser.add_argument("--at-once", type=int, default=8)
    parser.add_argument("--processes", type=int, default=2)
    chosen = parser.parse_args()
    running = ServeProcess(processes=chosen.processes, environment={
        "TTS2FACE_SERVE_KEEP_ALIVE_S": str(KEEP_ALIVE_S), "TTS2FACE_SERVE_WORKERS": "0",
    })  # fmt: skip
    try:
        running.wait_until_ready()
        print("| requests | server MB | synthesis MB | threads | files | processes | requests/s |")
        print("| --- | --- | --- | --- | --- | --- | --- |")
        print(row(0, 0.0, settled_usage(running)), flush=True)
        n_made, took = 0, 0.0
        for _ in range(N_ROWS):
            began = time.monotonic()
            statuses = asyncio.run(speak_many(running.url, chosen.requests // N_ROWS, chosen.at_once))
            took += time.monotonic() - began
            n_made += sum(statuses.values())
            assert set(statuses) == {200}, statuses
            print(row(n_made, took, settled_usage(running)), flush=True)
    finally:
        running.close()


if __name__ == "__main__":
    main()
