"""Programs of docs/examples and packages of plugins, run as a stranger does: in a folder that holds nothing else."""

import ast
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from textwrap import dedent

from tests.docs.blocks import DOCS, ROOT

EXAMPLES = sorted((DOCS / "examples").glob("*.py"))
ENVIRONMENT: Mapping[str, str] = os.environ | {"PYTHONPATH": str(ROOT)}
_FILE = re.compile(r"^([\w.]+\.\w+):\n\n((?:    .*\n|\n)+)", re.MULTILINE)  # of a docstring
_COMMAND = re.compile(r"^    (.+)$", re.MULTILINE)


def prepare_example(name: str, folder: Path) -> list[str]:
    """The program and the files of its docstring, put into a folder; the command lines of the docstring."""
    path = DOCS / "examples" / f"{name}.py"
    content = path.read_text(encoding="utf-8")
    (folder / path.name).write_text(content, encoding="utf-8")
    text = ast.get_docstring(ast.parse(content), clean=False) or ""
    for file, lines in _FILE.findall(text):
        (folder / file).write_text(dedent(lines).strip() + "\n", encoding="utf-8")
    return _COMMAND.findall(_FILE.sub("", text))


def run(
    command: str, folder: Path, *more: str, environment: Mapping[str, str] = ENVIRONMENT
) -> "subprocess.CompletedProcess[str]":
    """Run a command line of `python` or `tts2face` in a folder, with further arguments, by this Python."""
    program, *arguments = shlex.split(command)
    modules = {"python": [], "tts2face": ["-m", "tts2face"]}
    return subprocess.run(
        [sys.executable, *modules[program], *arguments, *more], cwd=folder, env=environment, capture_output=True,
        text=True, timeout=300, check=False,
    )  # fmt: skip


def install(source: Path, target: Path) -> Mapping[str, str]:
    """Install a package from its folder into another; variables with which Python finds it there."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--no-build-isolation"]
    subprocess.run([*pip, "--target", str(target), str(source)], check=True, timeout=120)
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(target)])}
