"""The alerts fire when they should, as Prometheus' own tester sees them, on series that begin as those of a service."""

import json
import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.docs.blocks import DOCS
from tts2face.serving.service.application import create_app
from tts2face.serving.service.settings import ServiceSettings

FILE = DOCS / "deploy/alerts.yaml"
RULES: Mapping[str, dict[str, Any]] = {
    rule["alert"]: rule for group in yaml.safe_load(FILE.read_text())["groups"] for rule in group["rules"]
}
INTERVAL_S = 15
DEFECTS = 'tts2face_failures_total{kind="internal",instance="a"}'
BUCKETS = '{path="/v1/clips",instance="a",le="%s"}'
A = {"instance": "a"}
DEFECT = A | {"kind": "internal"}


def requests(status: int, path: str = "/v1/clips") -> str:
    return f'tts2face_requests_total{{path="{path}",status="{status}",instance="a"}}'


@dataclass(frozen=True, slots=True)
class Case:
    """An alert that fires with some labels after some minutes of series (None: it does not)."""

    alert: str
    series: Mapping[str, str]
    minutes: float
    labels: Mapping[str, str] | None


CASES = {
    "the first defect": Case("Tts2faceDefect", {DEFECTS: "0x40 1x40"}, 12, DEFECT),
    "no defect": Case("Tts2faceDefect", {DEFECTS: "0x80"}, 12, None),
    "a defect before the first look": Case("Tts2faceDefect", {DEFECTS: "_x20 1x60"}, 6, DEFECT),
    "a defect after a restart": Case("Tts2faceDefect", {DEFECTS: "3x60 0x4 1x16"}, 18, DEFECT),
    "a defect of an hour ago": Case("Tts2faceDefect", {DEFECTS: "0x4 1x240"}, 60, None),
    "no server": Case("Tts2faceNoMetrics", {}, 6, {}),
    "a server that closed its door": Case(
        "Tts2faceNoMetrics", {'tts2face_processes_ready{instance="a"}': "2x20 stale"}, 15, {}
    ),
    "a server": Case("Tts2faceNoMetrics", {'tts2face_processes_ready{instance="a"}': "2x60"}, 15, None),
    "no process": Case("Tts2faceProcessesMissing", {'tts2face_processes_ready{instance="a"}': "0x60"}, 6, A),
    "a slow start": Case("Tts2faceProcessesMissing", {'tts2face_processes_ready{instance="a"}': "0x8 2x60"}, 6, None),
    "refused clients": Case("Tts2faceUnavailable", {requests(503): "0+3x60"}, 8, A),
    "refused probes": Case("Tts2faceUnavailable", {requests(503, "/readyz"): "0+5x60"}, 8, None),
    "a full disk": Case(
        "Tts2faceDiskIsFull", {'tts2face_ready{check="data",instance="a"}': "1x4 0x20"}, 5, A | {"check": "data"}
    ),
    "a disk with room": Case("Tts2faceDiskIsFull", {'tts2face_ready{check="data",instance="a"}': "1x20"}, 5, None),
    "no database": Case(
        "Tts2faceDatabaseIsAway", {'tts2face_ready{check="database",instance="a"}': "1x4 0x40"}, 8,
        A | {"check": "database"},
    ),
    "a database that starts again": Case(
        "Tts2faceDatabaseIsAway", {'tts2face_ready{check="database",instance="a"}': "1x4 0x12 1x40"}, 8, None
    ),
    "no worker": Case(
        "Tts2faceWorkersMissing", {'tts2face_ready{check="workers",instance="a"}': "0x40"}, 8, A | {"check": "workers"}
    ),
    "a long queue": Case("Tts2faceQueueIsLong", {'tts2face_oldest_waiting_seconds{instance="a"}': "9x60"}, 12, A),
    "a short queue": Case("Tts2faceQueueIsLong", {'tts2face_oldest_waiting_seconds{instance="a"}': "3x60"}, 12, None),
    "load": Case("Tts2faceRefusesForLoad", {requests(429): "0+1x100", requests(200): "0+2x100"}, 22, A),
    "load beside many probes": Case(
        "Tts2faceRefusesForLoad",
        {requests(429): "0+1x100", requests(200): "0+2x100", requests(200, "/readyz"): "0+90x100"}, 22, A,
    ),
    "little load": Case("Tts2faceRefusesForLoad", {requests(429): "0+1x100", requests(200): "0+9x100"}, 22, None),
    "late first bytes": Case(
        "Tts2faceFirstByteIsLate",
        {f"tts2face_first_byte_seconds_bucket{BUCKETS % le}": f"0+{n}x100" for le, n in (("5", 8), ("10", 10))}
        | {f"tts2face_first_byte_seconds_bucket{BUCKETS % '+Inf'}": "0+10x100"}, 22, A,
    ),
    "jobs that wait": Case(
        "Tts2faceJobsWait", {'tts2face_jobs_oldest_waiting_seconds{instance="a"}': "1900x60"}, 12, {}
    ),
    "slow releases": Case(
        "Tts2faceCancelIsSlow",
        {f'tts2face_cancel_seconds_bucket{{instance="a",le="{le}"}}': f"0+{n}x100"
         for le, n in (("2", 8), ("5", 10), ("+Inf", 10))}, 22, A,
    ),
}  # fmt: skip


def test_every_alert_has_a_case_in_which_it_fires() -> None:
    assert {case.alert for case in CASES.values() if case.labels is not None} == set(RULES)


@pytest.mark.skipif(shutil.which("promtool") is None, reason="needs promtool (Debian's package prometheus)")
def test_prometheus_fires_the_alerts(tmp_path: Path) -> None:
    tests = []
    for name, case in CASES.items():
        rule = RULES[case.alert]
        fired = [] if case.labels is None else [
            {"exp_labels": {**case.labels, **rule["labels"]}, "exp_annotations": rule["annotations"]}
        ]  # fmt: skip
        tests.append({
            "name": name, "interval": f"{INTERVAL_S}s",
            "input_series": [{"series": series, "values": values} for series, values in case.series.items()],
            "alert_rule_test": [
                {"eval_time": f"{round(60 * case.minutes)}s", "alertname": case.alert, "exp_alerts": fired}
            ],
        })  # fmt: skip
    path = tmp_path / "cases.yaml"
    path.write_text(json.dumps({"rule_files": [str(FILE)], "evaluation_interval": f"{INTERVAL_S}s", "tests": tests}))
    for arguments in (["check", "rules", str(FILE)], ["test", "rules", str(path)]):
        done = subprocess.run(["promtool", *arguments], capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr


def test_what_alerts_count_is_there_before_it_happens() -> None:
    """Prometheus sees no increase in a series that begins with its first event."""
    registry = create_app(ServiceSettings(processes=1)).state.service.metrics.registry
    samples = [one for family in registry.collect() for one in family.samples]
    begun = {(one.name, value) for one in samples for value in one.labels.values()}
    for rule in RULES.values():
        for name, inner in re.findall(r"\b(tts2face_\w+)\{([^}]*)\}", rule["expr"]):
            for value in re.findall(r'="([^"]+)"', inner):
                assert (name, value) in begun, rule["alert"]
    for family in registry.collect():
        if family.type in {"counter", "histogram"}:
            assert family.samples, family.name
            assert {one.value for one in family.samples} == {0.0}, family.name
