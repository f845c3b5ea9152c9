"""Decisions have numbers of their own, are short, and the index and the navigation name each once."""

import re
from collections import Counter
from pathlib import Path
from typing import Any

from docs.mkdocs_hooks import on_config

FOLDER = Path(__file__).parents[2] / "docs/decisions"
MAX_WORDS = 150


def test_each_decision_has_its_own_number_and_one_line_in_the_index() -> None:
    files = [path.name for path in FOLDER.glob("[0-9]*.md")]
    assert max(Counter(name[:3] for name in files).values()) == 1
    listed = re.findall(r"\[(\d{3})\]\((\S+\.md)\)", (FOLDER / "index.md").read_text(encoding="utf-8"))
    assert sorted(name for _, name in listed) == sorted(files)
    assert all(name.startswith(number) for number, name in listed)


def test_each_decision_is_in_the_navigation_once() -> None:
    config: dict[str, Any] = {"nav": []}
    on_config(config)
    (index, *rooms) = config["nav"][-1]["Decisions"]
    assert index == "decisions/index.md"
    shown = [page for room in rooms for pages in room.values() for page in pages]
    assert sorted(shown) == sorted(f"decisions/{path.name}" for path in FOLDER.glob("[0-9]*.md"))


def test_no_decision_is_longer_than_150_words() -> None:
    words = {path.name: len(path.read_text(encoding="utf-8").split()) for path in FOLDER.glob("[0-9]*.md")}
    assert {name: n for name, n in words.items() if n > MAX_WORDS} == {}
