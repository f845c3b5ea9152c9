"""Walks of data through the product: what is counted, and that the page of the architecture has a row for each."""

import re
from pathlib import Path

from tests.docs.size import PAGE
from tests.docs.walks import WALKS, Called, Walk, counted

MADE = (
    "def chosen(style):\n    return 1 if style is None else 2\n\n\n"
    "def passed_on(style):\n    return chosen(style)\n\n\n"
    "class Idle:\n    def pieces(self):\n        return ()\n\n\n"
    "def of_rate(rate):\n    return rate > 1\n\n\n"
    "def from_table(style):\n    return TABLE[style.name]\n\n\n"
    "def of_numpy(rate):\n    return rate > np.style(rate)\n"
)
LINES = {"chosen": 1, "passed_on": 5, "Idle.pieces": 10, "of_rate": 14, "from_table": 18, "of_numpy": 22}


def walked(root: Path, walk: Walk, *functions: str) -> tuple[list[str], list[str], int]:
    """Files that run, functions that decide, and moves, where each function is of a room of its own."""
    called = [Called(f"tts2face/room{n}/a.py", LINES[name], name) for n, name in enumerate(functions)]
    for function in called:
        path = root / function.file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(MADE)
    files, to_open, moves = counted(walk, root, called)
    return files, [name for names in to_open.values() for name in names], moves


def test_files_to_open_are_those_that_decide_about_the_datum(tmp_path: Path) -> None:
    style = Walk(lambda _: None, "styles?", kinds=frozenset(["Idle"]))
    files, decide, moves = walked(tmp_path, style, *LINES)
    assert (len(files), moves) == (6, 5)
    assert decide == ["chosen", "Idle.pieces", "from_table"]
    at_home = Walk(lambda _: None, "", home=("tts2face/room",), within=("tts2face/room3", "tts2face/room1"))
    files, decide, moves = walked(tmp_path, at_home, *LINES)
    assert (files, decide, moves) == (["tts2face/room1/a.py", "tts2face/room3/a.py"], ["of_rate"], 1)


def test_the_page_has_a_row_for_each_walk_with_its_bound() -> None:
    rows = re.findall(r"^\| (.+?) \| \d+; \d+ \| \d+; (\d+) \| (\d*) ?\| \d+; \d+ \|", PAGE.read_text(), re.M)
    assert [(name, most) for name, _, most in rows] == [(name, str(walk.most or "")) for name, walk in WALKS.items()]
