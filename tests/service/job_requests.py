"""Requests of jobs, and waiting for them."""

import time
from typing import Any

import httpx

CLIP = {"text": "Hi.", "voice": "espeak", "format": "curves", "fps": 5}
SMALL = {"size": "64x64", "supersampling": 1, "fps": 5, "voice": "espeak"}


def wait_for_database(url: str) -> None:
    deadline = time.monotonic() + 120
    while not httpx.get(f"{url}/readyz").json()["checks"]["database"]:
        assert time.monotonic() < deadline
        time.sleep(0.1)


def finished(api: httpx.Client, job: dict[str, Any]) -> dict[str, Any]:
    """A job after its end."""
    deadline = time.monotonic() + 240
    while True:
        found: dict[str, Any] = api.get(f"/v1/jobs/{job['id']}").json()
        if found["state"] not in {"waiting", "running"}:
            return found
        assert time.monotonic() < deadline, found
        time.sleep(0.2)


def submit(api: httpx.Client, request: dict[str, Any], kind: str = "clip", **options: Any) -> httpx.Response:
    return api.post("/v1/jobs", json={"kind": kind, "request": request}, **options)
