"""Decisions have numbers of their own, and the index names each once."""

import re
from collections import Counter
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "docs/decisions"


def test_each_decision_has_its_own_number_and_one_line_in_the_index() -> None:
    files = [path.name for path in FOLDER.glob("[0-9]*.md")]
    assert max(Counter(name[:3] for name in files).values()) == 1
    listed = re.findall(r"\[(\d{3})\]\((\S+\.md)\)", (FOLDER / "index.md").read_text(encoding="utf-8"))
    assert sorted(name for _, name in listed) == sorted(files)
    assert all(name.startswith(number) for number, name in listed)
