"""Contents of a wheel: the builders of the shipped models stay in the repository."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

from tests.packages import package

ROOT = Path(__file__).parents[2]
BUILDERS = "corpus_tools.shipped"
WITHOUT_BUILDERS = f"""
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if ".".join(name.split(".")[:2]) == {BUILDERS!r}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Absent())
import corpus_tools.dense.build_face
try:
    import {BUILDERS}
except ModuleNotFoundError:
    print("without the builders")
"""


def shipped_packages() -> list[str]:
    """Packages that setuptools finds, as when it builds a wheel."""
    options = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]["find"]
    finder = package("setuptools.discovery").PEP420PackageFinder
    found: list[str] = finder.find(str(ROOT), exclude=options["exclude"], include=options["include"])
    return found


def imported_modules(path: Path) -> set[str]:
    """Modules that a file imports anywhere, also inside functions; nothing of a file that names no builder."""
    found, text = set(), path.read_text(encoding="utf-8")
    if not any(name in text for name in (BUILDERS, "from corpus_tools import")):
        return found
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
    return found


def is_builder(name: str) -> bool:
    """Whether a package or module is one of a builder."""
    return f"{name}.".startswith(f"{BUILDERS}.")


def test_a_wheel_has_no_builders() -> None:
    packages = shipped_packages()
    assert {"cli", "lexicon", "tts2face", "corpus_tools", "corpus_tools.dense", "corpus_tools.studies"} <= set(packages)
    assert not [name for name in packages if is_builder(name)]


def test_type_checkers_of_users_read_the_types_of_the_package() -> None:
    """PEP 561; that the types hold is checked by mypy, which reads the tests as well."""
    assert all((ROOT / package / "py.typed").is_file() for package in ("tts2face", "lexicon"))


def test_no_shipped_module_imports_a_builder() -> None:
    files = [file for name in shipped_packages() for file in (ROOT / name.replace(".", "/")).glob("*.py")]
    assert len(files) > 100
    users = {str(file.relative_to(ROOT)) for file in files for name in imported_modules(file) if is_builder(name)}
    assert users == set()


def test_corpus_face_imports_without_the_builders() -> None:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_BUILDERS], cwd=ROOT, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "without the builders"
