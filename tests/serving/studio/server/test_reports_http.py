"""Reports over HTTP: made by a process, kept, shown as a page that can do nothing, and deleted."""

from pathlib import Path

import httpx
import pytest

from tests.running import eventually

pytestmark = pytest.mark.needs("matplotlib", "sklearn")
REPORTS = "/api/reports"


def state(studio: httpx.Client, number: str) -> dict[str, object]:
    return next(one for one in studio.get(REPORTS).json() if one["id"] == number)


def test_a_report_is_made_kept_and_deleted(studio: httpx.Client, data: Path) -> None:
    started = studio.post(REPORTS, json={"kind": "similarity", "model": "grid_s1"})
    assert started.status_code == 202
    number = started.json()["id"]
    assert studio.get(f"{REPORTS}/{number}/page").status_code == 400  # not made yet
    eventually(lambda: state(studio, number)["state"] not in {"waiting", "running"}, 180.0)
    assert state(studio, number)["state"] == "done", state(studio, number)
    page = studio.get(f"{REPORTS}/{number}/page")
    assert "<h1>Similarity of phones: grid_s1</h1>" in page.text
    assert "sandbox; default-src 'none'" in page.headers["content-security-policy"]
    assert "http://" not in page.text.replace("http://www.w3.org/", "")  # names of XML, not addresses
    assert "<script" not in page.text
    assert sorted(path.name for path in (data / "studio" / "reports" / number).iterdir()) == [
        "report.html", "report.json",
    ]  # fmt: skip
    shown = studio.get(f"/reports/{number}")
    assert "Visual similarity of phones: grid_s1" in shown.text
    assert studio.delete(f"{REPORTS}/{number}").status_code == 204
    assert studio.get(REPORTS).json() == []
    assert not (data / "studio" / "reports" / number).exists()


def test_a_report_that_waits_or_runs_is_cancelled(studio: httpx.Client, data: Path) -> None:
    number = studio.post(REPORTS, json={"kind": "gestures", "model": "starter"}).json()["id"]
    assert studio.delete(f"{REPORTS}/{number}").status_code == 204
    assert studio.get(REPORTS).json() == []
    eventually(lambda: not (data / "studio" / "reports" / number).exists(), 1.0)
