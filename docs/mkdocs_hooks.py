"""Hooks of MkDocs: options come from the command line, programs from their files, decisions from their index."""

import re
from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Any

from cyclopts import App

from cli.main import app

PLACE = "<!-- options -->"
PROGRAM = re.compile(r"<!-- (examples/\w+\.(py|html)) -->")
LANGUAGES = {"py": "python", "html": "html"}
DECISIONS = Path(__file__).with_name("decisions") / "index.md"


def on_config(config: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """The settings with the decisions as the last part of the navigation, by room."""
    config["nav"].append({"Decisions": ["decisions/index.md", *decisions_by_room()]})
    return config


def decisions_by_room() -> list[dict[str, list[str]]]:
    """Sections of the index of decisions, each with the pages that it lists."""
    sections = re.split(r"^## ", DECISIONS.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    return [
        {
            section.partition("\n")[0]: [
                f"decisions/{name}" for name in re.findall(r"^- \[\d{3}\]\((\S+)\)", section, re.M)
            ]
        }
        for section in sections
    ]


def on_page_markdown(markdown: str, **_: object) -> str:
    """A page with the tables of options and the example programs in their places."""
    if PLACE in markdown:
        markdown = markdown.replace(PLACE, "\n".join(command_tables()))
    return PROGRAM.sub(_program, markdown)


def _program(place: re.Match[str]) -> str:
    content = (Path(__file__).parent / place[1]).read_text(encoding="utf-8")
    return f"```{LANGUAGES[place[2]]}\n{content}```"


def walk_commands(command: App, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], App]]:
    """Every command that does something, with the words that call it."""
    if command.default_command is not None:
        yield path, command
    for name in command:
        if not name.startswith("-"):
            yield from walk_commands(command[name], (*path, name))


def command_tables() -> Iterator[str]:
    """Lines of Markdown: a heading, a sentence and a table for each command."""
    for path, command in walk_commands(app):
        words = " ".join(("tts2face", *path))
        yield f"\n## {words}\n\n{command.help}\n"
        rows = list(_rows(command))
        if rows:
            yield "| option | meaning | default |\n| --- | --- | --- |"
            yield from rows


def _rows(command: App) -> Iterator[str]:
    for argument in command.assemble_argument_collection():
        names = [name for name in argument.names if name.startswith("-")]
        shown = ", ".join(f"`{name}`" for name in names) or f"`{argument.name.lstrip('-').upper()}`"
        default = "required" if argument.required else _default(argument.field_info.default)
        yield f"| {shown} | {_cell(argument.parameter.help or '')} | {default} |"


def _default(value: object) -> str:
    return "" if value is None or value is False or not isinstance(value, bool | int | float | str) else f"`{value}`"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", r"\|").replace("[", r"\[")
