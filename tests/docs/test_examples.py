"""Every program of docs/examples is short, says how it is run, and stands on the page of examples."""

import runpy
from pathlib import Path

import pytest

from tests.docs.blocks import DOCS
from tests.docs.programs import EXAMPLES, prepare_example

PAGE = (DOCS / "examples.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_on_the_page(path: Path, tmp_path: Path) -> None:
    content = path.read_text(encoding="utf-8")
    assert len(content.splitlines()) < 60
    assert prepare_example(path.stem, tmp_path)
    on_page_markdown = runpy.run_path(str(DOCS / "mkdocs_hooks.py"))["on_page_markdown"]
    assert on_page_markdown(PAGE).count(f"\n```python\n{content}```\n") == 1
