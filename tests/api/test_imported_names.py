"""Names that a module imports from the packages or from tests exist, also where no test imports the module."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("cli", "corpus_tools", "lexicon", "tests", "tts2face")
# Benches, scripts and helpers need packages, models or recordings that a test has not: they are read, not imported.
SCRIPTS = ("tests", "corpus_tools")


@cache
def names_of(module: str) -> frozenset[str] | None:
    """Names that a module has, and modules of a package; None if there is no such module."""
    place = ROOT.joinpath(*module.split("."))
    path = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    parts = {part.stem for part in place.iterdir()} if place.is_dir() else set()
    if not path.is_file():
        return frozenset(parts) if place.is_dir() else None
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            parts.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            parts.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            parts |= {alias.asname or alias.name for alias in node.names}
    return frozenset(parts)


def missing_names(path: Path) -> list[str]:
    """Imports of a module that lead nowhere."""
    missing = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] in PACKAGES:
            names = names_of(node.module)
            is_open = names is not None and "__getattr__" in names
            missing += [
                f"{path.name}:{node.lineno}: {node.module} has no {alias.name}"
                for alias in node.names
                if not is_open and (names is None or alias.name not in names)
            ]
    return missing


def test_imported_names_exist() -> None:
    paths = [path for folder in SCRIPTS for path in (ROOT / folder).rglob("*.py") if not path.name.startswith("test_")]
    assert [missing for path in sorted(paths) for missing in missing_names(path)] == []


def test_names_that_are_gone_are_found(tmp_path: Path) -> None:
    gone = tmp_path / "bench.py"
    gone.write_text(
        "from tests.api.house import no_such_name\nfrom tests.api.no_such import name\nfrom tests import api\n"
    )
    assert missing_names(gone) == [
        "bench.py:1: tests.api.house has no no_such_name",
        "bench.py:2: tests.api.no_such has no name",
    ]
