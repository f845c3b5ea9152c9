"""Every ```python block of the documentation runs, page by page in one namespace, in an empty folder."""

from pathlib import Path

import pytest

from tests.docs.blocks import PAGES, code_blocks

SERVICE_PAGE = "http.md"  # its examples need a service: tests/serving/service/server/test_http_page.py
WITH_EXAMPLES = [page for page in PAGES if code_blocks(page, "python") and page.name != SERVICE_PAGE]


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.smoke] * (page.name == "animator.md"), id=page.name)
        for page in WITH_EXAMPLES
    ],
)
def test_python_examples_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {}
    for block in code_blocks(page, "python"):
        exec(compile(block, str(page), "exec"), namespace)


@pytest.mark.smoke
def test_pages_with_examples_are_found() -> None:
    assert {"python.md", "animator.md", "subtitles.md", "speech-science.md", "developer.md"} <= {
        page.name for page in WITH_EXAMPLES
    }
