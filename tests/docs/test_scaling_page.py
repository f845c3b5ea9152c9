"""The table of docs/scaling.md is the one that its script prints, and follows from its formulas."""

import importlib.util
import sys
from types import ModuleType

import pytest

from tests.docs.blocks import DOCS


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_scaling", DOCS / "make_scaling.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "make_scaling", module)
    spec.loader.exec_module(module)
    return module


def test_the_page_has_the_table_of_the_script(script: ModuleType) -> None:
    page = (DOCS / "scaling.md").read_text(encoding="utf-8")
    assert script.markdown(script.rows(script.Wish())) in page, "run docs/make_scaling.py"


def test_core_hours_days_and_cost_of_a_round_number(script: ModuleType) -> None:
    """1,000 cues of 5 s at 4 + 0.08 core seconds: 1.13 hours of a core."""
    wish = script.Wish(hours=5000 / 3600, workers=4, cpu_price=100.0)
    values = {name: first for name, first, *_ in script.rows(wish)}
    assert values["core hours, rendering and joining"] == "1"
    assert values["cost of cores"] == "113"
    assert values["cues/s"] == "1"
    assert values["days with 4 workers"] == f"{1000 / 86_400:.1f}"
