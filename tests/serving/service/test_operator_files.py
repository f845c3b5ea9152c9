"""What an operator picks up: board, alerts and runbook name the metrics, events and codes that exist, all of them."""

import ast
import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.docs.blocks import DOCS, ROOT
from tts2face.serving.service.errors import STATUS
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState

BOARD: dict[str, Any] = json.loads((DOCS / "deploy/grafana.json").read_text())
ALERTS: dict[str, Any] = yaml.safe_load((DOCS / "deploy/alerts.yaml").read_text())
RUNBOOK = (DOCS / "runbook.md").read_text(encoding="utf-8")
SERVING = sorted((ROOT / "tts2face/serving").rglob("*.py"))
LABELS = {"path", "status", "kind", "state", "samples", "frames", "check", "le"}  # of our metrics
OF_PROMETHEUS = {"instance", "job"}


@pytest.fixture(scope="module")
def exposed(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """Names of the samples of a service that has all metrics."""
    settings = ServiceSettings(data=tmp_path_factory.mktemp("data"), cache_mb=1)
    names = set()
    for family in ServiceState(settings).metrics.registry.collect():
        suffixes = {"counter": ["_total"], "histogram": ["_bucket", "_sum", "_count"]}.get(family.type, [""])
        names |= {family.name + suffix for suffix in suffixes}
    return names


def expressions() -> list[str]:
    rules = [rule["expr"] for group in ALERTS["groups"] for rule in group["rules"]]
    return rules + [target["expr"] for panel in BOARD["panels"] for target in panel["targets"]]


def words(kind: str) -> set[str]:
    """First arguments of the calls of a function in the service, as far as they are written there."""
    found = set()
    for path in SERVING:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == kind:
                place = 1 if kind == "RefusedError" else 0
                if len(node.args) > place and isinstance(node.args[place], ast.Constant):
                    found.add(str(node.args[place].value))
    return found


def rows(heading: str) -> set[str]:
    """Names in the first column of the table of a section."""
    section = re.split(r"^## ", RUNBOOK, flags=re.MULTILINE)
    (text,) = [part for part in section if part.startswith(heading)]
    columns = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    return {name for column in columns for name in re.findall(r"`([^`]+)`", column)}


def test_board_and_alerts_read_metrics_that_exist(exposed: set[str]) -> None:
    for expression in expressions():
        named = set(re.findall(r"\btts2face_\w+", expression))
        assert named, expression
        assert named <= exposed, (expression, sorted(named - exposed))
        labels = {name for inner in re.findall(r"\{([^}]*)\}", expression) for name in re.findall(r"(\w+)[!=]", inner)}
        labels |= {name.strip() for inner in re.findall(r"by \(([^)]*)\)", expression) for name in inner.split(",")}
        assert labels <= LABELS | OF_PROMETHEUS, expression
        assert expression.count("(") == expression.count(")")


def test_every_metric_is_on_the_board(exposed: set[str]) -> None:
    shown = set(re.findall(r"\btts2face_\w+", " ".join(expressions())))
    bare = {re.sub(r"_(bucket|sum|count)$", "", name) for name in exposed} - {"tts2face_cache_bytes"}
    assert {re.sub(r"_bucket$", "", name) for name in shown} == bare


def test_every_alert_leads_to_a_section_of_the_runbook() -> None:
    anchors = {title.lower().replace(" ", "-") for title in re.findall(r"^### (.+)$", RUNBOOK, re.MULTILINE)}
    named = {rule["annotations"]["runbook"] for group in ALERTS["groups"] for rule in group["rules"]}
    assert {name.removeprefix("runbook.md#") for name in named} == anchors


def test_the_runbook_has_every_event_of_the_log() -> None:
    written = {"lines dropped", "library"}  # by the log itself
    assert rows("Lines of the log") == words("log_event") | written


def test_the_runbook_has_every_code_of_a_refusal() -> None:
    assert rows("Codes of refused requests") == words("RefusedError") | {code for _, code in STATUS.values()}


def test_panels_lie_side_by_side() -> None:
    places = [panel["gridPos"] for panel in BOARD["panels"]]
    cells = [(x, y) for one in places for x in range(one["x"], one["x"] + one["w"])
             for y in range(one["y"], one["y"] + one["h"])]  # fmt: skip
    assert len(cells) == len(set(cells))
    assert max(x for x, _ in cells) < 24
    assert len({panel["id"] for panel in BOARD["panels"]}) == len(places)


def test_files_are_named_on_the_page_of_deployment() -> None:
    page = (DOCS / "deploy.md").read_text(encoding="utf-8")
    assert {path.name for path in Path(DOCS / "deploy").iterdir()} == set(re.findall(r"\(deploy/([^)]+)\)", page))
