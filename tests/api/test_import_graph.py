"""No module imports itself through others, and every module can be imported alone."""

import ast
import os
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("lexicon", "tts2face", "corpus_tools", "cli")
ALONE = """
import importlib, os, sys, traceback
for name in ("numpy", "scipy.optimize", "scipy.signal", "numba", "av", "PIL.Image"):
    importlib.import_module(name)
failed = []
for name in sys.stdin.read().split():
    child = os.fork()
    if child == 0:
        try:
            importlib.import_module(name)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    if os.waitpid(child, 0)[1]:
        failed.append(name)
print(" ".join(failed))
"""


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
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if name in known else node.module for name in names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found & set(known)


def test_no_import_circle_even_by_lazy_imports() -> None:
    known = modules()
    public = {"tts2face"}  # its names are imported when they are first used (PEP 562)
    graph = {name: imports(path, known) - {name} - public for name, path in known.items() if name not in public}
    order = list(TopologicalSorter(graph).static_order())  # raises CycleError with the circle
    assert set(order) == set(graph)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks a fresh process for each module")
def test_every_module_can_be_imported_alone() -> None:
    answer = subprocess.run(
        [sys.executable, "-c", ALONE], input="\n".join(modules()), capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not answer.stdout.split(), answer.stderr
