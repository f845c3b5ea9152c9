"""Rows of docs/leaderboard.md: dates fall, and each command begins with a program that exists."""

import re
import shlex

from cli.flags import check_options
from cli.main import app
from tests.docs.blocks import DOCS, ROOT

ROW = re.compile(r"^\| .+ \| .+ \| (\d{4}-\d{2}-\d{2}) \| `[0-9a-f]{8}` \| `(.+)` \|$")
LINES = (DOCS / "leaderboard.md").read_text(encoding="utf-8").partition("| --- |")[2].splitlines()[1:]
ROWS = [ROW.match(line) for line in LINES]


def test_each_row_has_a_date_a_commit_and_a_command() -> None:
    assert LINES
    assert all(ROWS), [line for line, row in zip(LINES, ROWS, strict=True) if row is None]


def test_newest_figures_come_first() -> None:
    dates = [row[1] for row in ROWS if row]
    assert dates == sorted(dates, reverse=True)


def test_commands_exist() -> None:
    for row in filter(None, ROWS):
        program, *words = shlex.split(row[2])
        if program == "tts2face":
            check_options(app, words)
            app.parse_args(words, exit_on_error=False, print_error=False)
        else:
            assert program == "python"
            path = words[1].replace(".", "/") + ".py" if words[0] == "-m" else words[0]
            assert (ROOT / path).is_file(), row[2]
