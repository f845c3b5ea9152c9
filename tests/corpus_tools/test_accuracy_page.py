"""The accuracy page states the measured figures, with the present default options."""

import importlib.util
import json
from dataclasses import asdict
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def writer():
    spec = importlib.util.spec_from_file_location("make_accuracy", DOCS / "make_accuracy.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_tables_are_those_of_the_figures():
    page = (DOCS / "accuracy.md").read_text(encoding="utf-8")
    figures = json.loads((DOCS / "accuracy.json").read_text(encoding="utf-8"))
    assert writer().with_tables(page, figures) == page


def test_the_figures_are_those_of_the_default():
    figures = json.loads((DOCS / "accuracy.json").read_text(encoding="utf-8"))
    assert figures["options"] == {name: asdict(options) for name, options in writer().METHODS.items()}, (
        "the synthesis has changed: run docs/make_accuracy.py"
    )
