"""The form of the four packages becomes no worse, room by room, and the checks of it find what they are for."""

import ast
from collections import Counter
from pathlib import Path

import pytest

from tests.api.house import CHECKS, Module, counts, read_table
from tests.api.raises import without_raises

TITLES = {
    '"""Reads waves."""': 0,
    '"""Reads waves, e.g. PCM (Ju et al. 2008)."""': 0,
    '"""Reads waves.\n\nUnits are seconds.\n"""': 0,
    '"""Reads waves. Writes them."""': 1,
    '"""Reads waves.\n\nUnits are seconds.\n\nPoints of a mouth.\n"""': 1,
    '"""Reads waves.\n\nThe next one:\n\n1. Write a class.\n2. Add a row.\n"""': 0,
    '"""Reads waves.\n\nExamples\n--------\n>>> 1\n1\n\n>>> 2\n2\n"""': 0,
    '"""Reads waves"""': 1,
    "X = 1": 1,
    "": 0,
}
PARTS = {
    "constants": (
        '"""T."""\nA = 1\nclass B: pass\nC = B()\ndef f(): pass\nD = 2\nE = {"f": f}\nF = [E]\n__all__ = ["f"]\n'
        "class G: pass\nH: G | None = None\nJ, K = 1, 2\n",
        ["constant D after the first function", "constant J, K after the first function"],
    ),
    "words": (
        '"""The begin of a piece tells all works."""\nbegin = 1  # between two looks\n'
        'def begin_now(one): "What it is."\n'
        'raise ValueError("it tells the begin")\n',
        [
            "begin as a noun: The begin", "begin as a noun: begin", "told, tells: tells", "look for a read: two looks",
            "works for tasks: all works", "one as a name: one", "docstring that begins with What",
        ],
    ),
    "packed": ("a, b, c = 1, 2, 3\na, b, c = f()\na, b = 1, 2\n", ["3 assignments in one"]),
    "long": ("x = 1\n" * 401, ["401 lines"]),
}  # fmt: skip


def made(folder: Path, text: str) -> Module:
    path = folder / "made.py"
    path.write_text(text)
    return Module(path)


def test_the_form_of_no_room_becomes_worse() -> None:
    table = read_table()
    more = [
        f"{room}: {number} {name}, not {table.get(room, Counter())[name]}"
        for room, found in counts().items()
        for name, number in found.items()
        if number > table.get(room, Counter())[name]
    ]
    assert not more, "\n".join(["python -m tests.api.house PATH shows the lines", *more])


@pytest.mark.parametrize("text", TITLES)
def test_titles_are_one_sentence_and_at_most_one_paragraph(tmp_path: Path, text: str) -> None:
    assert len(list(CHECKS["titles"](made(tmp_path, text)))) == TITLES[text]


@pytest.mark.parametrize("name", PARTS)
def test_each_check_finds_what_it_is_for(tmp_path: Path, name: str) -> None:
    text, expected = PARTS[name]
    found = [finding.text for finding in CHECKS[name](made(tmp_path, text))]
    assert sorted(found) == sorted(expected)


def test_sections_are_removed_and_nothing_else() -> None:
    section = "\n\n    Raises\n    ------\n    InputError\n        It is wrong."
    notes = "\n\n    Notes\n    -----\n    Source.\n    "
    text = f'def f():\n    """One.{section}\n    """\n    return 1\n\n\ndef g():\n    """Two.{section}{notes}"""\n'
    functions = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
    expected = f'def f():\n    """One."""\n    return 1\n\n\ndef g():\n    """Two.{notes}"""\n'
    assert without_raises(text, functions) == expected
