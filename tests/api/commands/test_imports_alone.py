"""Every module can be imported alone."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.api.test_import_graph import ROOT, modules

# Imports each module named on standard input in a fork that has imported no module of the project, and prints those
# that fail. Modules of other packages are imported before the first fork. The bytecode of the project is written to a
# folder of its own, so that each file is compiled once even where Python writes none.
IMPORT_EACH_ALONE = """
import gc, importlib, os, sys, traceback
for name in ("numpy", "scipy.optimize", "scipy.signal", "numba", "av", "PIL.Image", "concurrent.futures.process",
             "concurrent.futures.thread", "multiprocessing.connection", "xml.parsers.expat", "fastapi", "nicegui",
             "pydantic_settings", "sqlalchemy", "dbos", "httpx", "uvicorn", "prometheus_client", "cyclopts"):
    importlib.import_module(name)
sys.path.insert(0, sys.argv[1])
sys.pycache_prefix, sys.dont_write_bytecode = sys.argv[2], False
gc.freeze()
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


needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="forks a fresh process for each module")


@needs_fork
def test_every_module_can_be_imported_alone(tmp_path: Path) -> None:
    assert modules_that_fail_alone(list(modules()), ROOT, tmp_path) == ([], "")


@needs_fork
def test_modules_that_need_another_one_first_are_found(tmp_path: Path) -> None:
    """Imported in the order of their names all of them succeed; alone, those that rely on an earlier import fail."""
    package = tmp_path / "made"
    package.mkdir()
    contents = {
        "__init__": "",
        "a": "VALUE = 1",
        "b": "import made\nmade.a.VALUE",
        "c": "def late():\n    from made import e",
        "d": "VALUE = 1\nfrom made.e import OWN",
        "e": "from made.d import VALUE\nOWN = 2",
    }
    for name, content in contents.items():
        (package / f"{name}.py").write_text(content)
    names = ["made", *(f"made.{name}" for name in contents if name != "__init__")]
    in_order = subprocess.run(
        [sys.executable, "-c", f"import {', '.join(names)}"], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert in_order.stderr == ""
    failed, errors = modules_that_fail_alone(names, tmp_path, tmp_path / "bytecode")
    assert failed == ["made.b", "made.e"]
    assert "has no attribute 'a'" in errors
    assert "cannot import name 'OWN' from partially initialized module 'made.e'" in errors


def modules_that_fail_alone(names: list[str], root: Path, bytecode: Path) -> tuple[list[str], str]:
    """Modules that cannot be imported in a process without other modules of the project, and their tracebacks."""
    answer = subprocess.run(
        [sys.executable, "-c", IMPORT_EACH_ALONE, str(root), str(bytecode)],
        input="\n".join(names),
        capture_output=True,
        text=True,
        check=True,
        cwd=root,
    )
    return answer.stdout.split(), answer.stderr
