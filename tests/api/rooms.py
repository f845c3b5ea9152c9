"""Packages, rooms and files of the product, and the nodes of a file."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("lexicon", "tts2face", "corpus_tools", "cli")


@cache
def rooms() -> list[list[str]]:
    """Rooms of tts2face, from top to bottom, as the import contracts have them."""
    return contract_layers("rooms of tts2face")


@cache
def contract_layers(contract: str) -> list[list[str]]:
    """Modules of an import contract by layers, from top to bottom."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    layers = next(entry["layers"] for entry in contracts if entry["name"] == contract)
    return [re.findall(r"[\w.]+", layer) for layer in layers]


@cache
def room_of(path: Path, root: Path = ROOT) -> str:
    """Dotted name of the room of a file: a folder of tts2face, serving and corpus_tools, or a package.

    The modules of tts2face beside its rooms, and those of corpus_tools and cli beside their folders, are a room.
    """
    parts = path.resolve().relative_to(root).with_suffix("").parts
    depth = {"tts2face": 2, "corpus_tools": 2, "tests": 2}.get(parts[0], 1)
    if parts[:2] in {("tts2face", "serving"), ("tts2face", "interchange")}:
        depth = 3
    return ".".join(parts[: min(depth, len(parts) - 1)])


def python_files(paths: list[Path]) -> list[Path]:
    """Python files of paths and folders."""
    return [file for path in paths for file in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]


@cache
def nodes(path: Path) -> list[ast.AST]:
    """All nodes of a file, its module first; parsed once, since several checks walk the whole product."""
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
