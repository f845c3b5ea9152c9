"""The scripts that make pictures and tables of the documentation find what they import."""

import runpy
from pathlib import Path

import pytest

from tests.docs.blocks import DOCS


@pytest.mark.parametrize("path", sorted(DOCS.glob("make_*.py")), ids=lambda path: path.stem)
def test_a_script_of_the_docs_can_be_loaded(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)  # as of a script that is run
    assert callable(runpy.run_path(str(path), run_name=path.stem)["main"])
