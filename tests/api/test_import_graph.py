"""No module imports itself through others, so that each can be imported first."""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

from tests.api.rooms import PACKAGES, ROOT


def modules() -> dict[str, Path]:
    """Files of all modules by dotted name; scripts that run as a process of their own excepted."""
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            if path.name not in {"__main__.py", "espeak_child.py"}:
                found[name] = path
    return found


def imports(path: Path, known: dict[str, Path]) -> set[str]:
    """Modules of the project that a file imports, lazily or not; for type checkers too."""
    found = set()
    for node in _statements(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if name in known else node.module for name in names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found & set(known)


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All statements under a node; imports are statements, and most nodes of a file are expressions."""
    for child in ast.iter_child_nodes(tree):
        if not isinstance(child, ast.expr):
            yield child
            yield from _statements(child)


def test_no_import_circle_even_by_lazy_imports() -> None:
    known = modules()
    public = {"tts2face"}  # its names are imported when they are first used (PEP 562)
    graph = {name: imports(path, known) - {name} - public for name, path in known.items() if name not in public}
    order = list(TopologicalSorter(graph).static_order())  # raises CycleError with the circle
    assert set(order) == set(graph)
