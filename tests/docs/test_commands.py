"""Every command line of the documentation is parsed by the real command line; those of README and cli.md are executed.

`tests.docs.blocks.NOT_EXECUTED` lists what is not executed, with the reason; lines that need video of a
person are executed by `tests/doors/commands`.
"""

import pytest
from cyclopts import App

from cli.flags import check_options, option_names
from cli.main import app
from tests.docs.blocks import (
    CLI_PAGE,
    EXECUTED_PAGES,
    NOT_EXECUTED,
    PAGES,
    README,
    own_commands,
    shell_lines,
)

OWN_LINES = [(page.name, line) for page in PAGES for line in shell_lines(page) if own_commands(line)]


def commands_of(command: App, path: tuple[str, ...] = ()) -> dict[tuple[str, ...], App]:
    """Every command that does something, by the words that call it."""
    found = {path: command} if command.default_command is not None else {}
    for name in command:
        if not name.startswith("-"):
            found |= commands_of(command[name], (*path, name))
    return found


@pytest.mark.parametrize(("page", "line"), OWN_LINES, ids=lambda text: text[:60])
def test_every_command_line_is_understood(page: str, line: str) -> None:
    for words in own_commands(line):
        if {"--help", "--version"} & set(words):
            continue
        check_options(app, words)
        app.parse_args(words, exit_on_error=False, print_error=False)


def test_every_command_is_on_the_cli_page() -> None:
    shown = [tuple(words) for line in shell_lines(CLI_PAGE) for words in own_commands(line)]
    missing = [path for path in commands_of(app) if path and not any(words[: len(path)] == path for words in shown)]
    assert not missing


def test_options_named_in_the_documentation_exist() -> None:
    known = {name for command in commands_of(app).values() for name in option_names(command)}
    known |= {"--help", "--version", "--", "--strict", "--noise"}
    words = {word.split("=")[0] for _, line in OWN_LINES for own in own_commands(line) for word in own}
    assert {word for word in words if word.startswith("--") and word != "--five"} <= known


def test_reasons_name_command_lines_that_exist() -> None:
    lines = [line.partition("tts2face ")[2] for page in EXECUTED_PAGES for line in shell_lines(page)]
    assert not [start for start in NOT_EXECUTED if not any(line.startswith(start) for line in lines)]


def test_readme_holds_the_two_promised_commands() -> None:
    lines = shell_lines(README)
    text = "We were away a year ago, but Bob may move five big maps."
    assert f'pip install . && tts2face "{text}" --out clip.mp4' in lines
    assert "pip install '.[test]' && pytest" in lines
