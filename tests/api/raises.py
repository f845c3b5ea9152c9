"""Sections ``Raises`` that nobody reads: those of functions that no other room and no user calls.

``python -m tests.api.raises --fix PATH...`` removes them from files.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tests.api.rooms import PACKAGES, ROOT, nodes, python_files, room_of

USER_PAGES = ("README.md", "docs/python.md", "docs/plugins.md")
SECTION = re.compile(
    r"\n+(?P<indent>[ \t]*)Raises\n[ \t]*-{6}\n.*?(?=\n+(?P=indent)\w[\w ]*\n[ \t]*-{3,}\n|\s*\Z)", re.DOTALL
)

Defined = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def names_used(path: Path) -> Iterator[str]:
    """Names that a file imports, reads as attributes, or passes as strings, such as ``module:function``."""
    for node in nodes(path):
        if isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.ImportFrom):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and re.fullmatch(r"[\w.:]+", node.value):
            yield node.value.rpartition(":")[2]


@cache
def users() -> dict[str, set[str]]:
    """Rooms that use a name, by name; what pages for users and examples name is used by the room ``users``."""
    found: dict[str, set[str]] = defaultdict(set)
    for path in python_files([ROOT / package for package in PACKAGES]):
        room = room_of(path)
        for name in names_used(path):
            found[name].add(room)
    pages = [ROOT / page for page in USER_PAGES] + sorted((ROOT / "examples").rglob("*.py"))
    pages += [ROOT / "tts2face/__init__.py", ROOT / "tts2face/plugins.py"]
    for page in pages:
        for name in re.findall(r"\w+", page.read_text(encoding="utf-8")):
            found[name].add("users")
    return found


def is_called_from_outside(names: list[str], room: str) -> bool:
    """Whether another room uses a function by its names (with its class); private names are used by their room."""
    if any(name.startswith("_") and not name.startswith("__") for name in names):
        return False
    name = names[-2] if names[-1].startswith("__") and len(names) > 1 else names[-1]
    return bool(users()[name] - {room})


def superfluous_raises(path: Path) -> list[Defined]:
    """Functions and classes of a file with a section ``Raises`` that no other room and no user calls."""
    room = room_of(path)
    return [
        node
        for names, node in _defined(nodes(path)[0], [])
        if SECTION.search(ast.get_docstring(node, clean=False) or "") and not is_called_from_outside(names, room)
    ]


def _defined(tree: ast.AST, outer: list[str]) -> Iterator[tuple[list[str], Defined]]:
    """Classes and functions under a node with their names; a function within a function is private."""
    for node in (*getattr(tree, "body", ()), *getattr(tree, "orelse", ())):
        if isinstance(node, Defined):
            names = [*outer, node.name]
            yield names, node
            yield from _defined(node, names if isinstance(node, ast.ClassDef) else [*names, "_"])
        else:
            yield from _defined(node, outer)


def without_raises(text: str, nodes: list[Defined]) -> str:
    """The text of a file without the sections ``Raises`` of functions."""
    lines = text.splitlines(keepends=True)
    for node in sorted(nodes, key=lambda node: -node.lineno):
        docstring = node.body[0]
        first, last = docstring.lineno - 1, docstring.end_lineno or docstring.lineno
        written = "".join(lines[first:last])
        body, quotes = written.rstrip()[:-3], written.rstrip()[-3:]
        body = SECTION.sub("", body.rstrip())
        closing = quotes if "\n" not in body else "\n" + " " * docstring.col_offset + quotes
        lines[first:last] = [f"{body}{closing}\n"]
    return "".join(lines)


def main(arguments: list[str]) -> None:
    """Remove superfluous sections from the files and folders of the arguments; print how many there were."""
    if arguments[:1] != ["--fix"]:
        raise SystemExit("usage: python -m tests.api.raises --fix PATH...")
    for path in python_files([Path(argument).resolve() for argument in arguments[1:]]):
        if found := superfluous_raises(path):
            path.write_text(without_raises(path.read_text(encoding="utf-8"), found), encoding="utf-8")
            print(f"{path.relative_to(ROOT)}: {len(found)}")


if __name__ == "__main__":
    main(sys.argv[1:])
