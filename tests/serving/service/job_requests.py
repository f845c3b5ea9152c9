"""Requests of jobs, and waiting for them."""

from typing import Any

import httpx

from tests.running import eventually

CLIP = {"text": "Hi.", "voice": "espeak", "format": "curves", "fps": 5}
SMALL = {"size": "64x64", "supersampling": 1, "fps": 5, "voice": "espeak"}


def wait_for_database(url: str) -> None:
    eventually(lambda: httpx.get(f"{url}/readyz").json()["checks"]["database"], 120)


def finished(api: httpx.Client, job: dict[str, Any]) -> dict[str, Any]:
    """A job after its end."""

    def end() -> dict[str, Any] | None:
        found: dict[str, Any] = api.get(f"/v1/jobs/{job['id']}").json()
        return None if found["state"] in {"waiting", "running"} else found

    ended: dict[str, Any] = eventually(end, 240, lambda: f"{job['id']} has not ended")
    return ended


def submit(api: httpx.Client, request: dict[str, Any], kind: str = "clip", **options: Any) -> httpx.Response:
    return api.post("/v1/jobs", json={"kind": kind, "request": request}, **options)
