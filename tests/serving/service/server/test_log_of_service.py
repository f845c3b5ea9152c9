"""The log and the timing of a running service, and keys that it reads again."""

import signal
from pathlib import Path

import httpx

from tests.packages import needs
from tests.running import HostService, RunningService
from tts2face.serving.service.keys import add_key, remove_key


def test_every_line_of_a_request_has_its_id_and_none_its_text(service: RunningService) -> None:
    body = {"text": "Zebras graze quietly.", "style": "gleeful", "format": "curves"}
    httpx.post(f"{service.url}/v1/clips", json=body, headers={"x-request-id": "id-11"}, timeout=60)
    made = service.wait_for_event("request", id="id-11")
    assert (made["status"], made["code"], made["path"]) == (400, "invalid_request", "/v1/clips")
    assert "Zebras" not in "".join(service.lines)
    assert all({"time", "level", "event"} <= set(event) for event in service.events())


def test_the_log_says_when_a_process_can_serve(service: RunningService) -> None:
    assert service.host.wait_for_event("synthesis process ready")["seconds"] > 0.0
    before = service.host.wait_for_event("preparing", part="models")
    found = httpx.get(f"{service.url}/readyz").json()["preparing"]
    assert before["done"] < found["done"] == found["of"] == before["of"]


def test_the_log_names_the_studio_and_it_can_be_left_out(service: RunningService, host: HostService) -> None:
    needs("nicegui")
    listening = service.wait_for_event("listening", url=service.url)
    assert listening["studio"] == f"{listening['url']}/studio"
    with host(workers=0, is_ready=False) as without:
        assert without.wait_for_event("listening", url=without.url)["studio"] is None
        assert httpx.get(f"{without.url}/studio/").status_code == 404


def test_server_timing_names_the_stages(client: httpx.Client) -> None:
    answer = client.post("/v1/audio/speech", json={"input": "Hello.", "model": "tts-1", "voice": "alloy"})
    timing = dict(part.split(";dur=") for part in answer.headers["server-timing"].split(", "))
    assert set(timing) == {"queue", "synthesis", "total"}
    assert float(timing["queue"]) + float(timing["synthesis"]) <= float(timing["total"]) + 1.0


def test_keys_are_read_again_on_sighup(host: HostService, tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    first = add_key(path, "first", ["speak"])

    def status(secret: str) -> int:
        answer = httpx.get(f"{running.url}/v1/models", headers={"authorization": f"Bearer {secret}"})
        return answer.status_code

    with host(keys=path, workers=0) as running:
        second = add_key(path, "second", ["speak"])
        assert (status(first), status(second)) == (200, 401)
        running.process.send_signal(signal.SIGHUP)
        running.wait_for_event("keys reloaded", keys=["first", "second"])
        assert (status(first), status(second)) == (200, 200)
        remove_key(path, "first")
        running.process.send_signal(signal.SIGHUP)
        running.wait_for_event("keys reloaded", keys=["second"])
        assert (status(first), status(second)) == (401, 200)
        path.write_text("[[key]]\nname = 1")
        running.process.send_signal(signal.SIGHUP)
        assert "name must be a text in quotes, not 1" in running.wait_for_event("keys dropped")["reason"]
        assert "nobody is served" in running.wait_for_event("no keys")["reason"]
        assert status(second) == 401
