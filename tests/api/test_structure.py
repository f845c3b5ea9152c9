"""Counts of the code that may only shrink: what is listed here is to go, and nothing is to join it.

Circles among files are counted by `test_import_graph.py`; there are none.
"""

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.api.rooms import PACKAGES, ROOT, rooms

Find = Callable[[str, str], Iterator[str]]  # of the text and the name of a module

# Places that start Python, outside the room of child processes, which is to start all of them.
PROCESS_ROOM = "tts2face.processes"
STARTS_PYTHON = ("tts2face.sound.espeak",)
# Modules that read JSON or TOML themselves; `lexicon.values` does it for others.
PARSES = (
    "corpus_tools.shipped.head.assets", "lexicon.part_of_speech", "lexicon.values.json_text",
    "lexicon.values.toml_text",
    "tts2face.processes.message", "tts2face.serving.studio.preview_bundle", "tts2face.serving.work.resources",
    "tts2face.serving.work.jobs", "tts2face.sound.espeak", "tts2face.sound.espeak_child",
    "tts2face.storage.tensors",
)  # fmt: skip
# Strings that name a module of a package above their own, or of a room of tts2face above theirs.
NAMES_HIGHER = ()
# Modules that name a type of arrays for themselves which `tts2face.numeric.arrays` names for all.
ARRAY_ROOM = "tts2face.numeric.arrays"
NAMES_ARRAYS = ()
ARRAY_NAME = re.compile(
    r"^(?:Array|Floats|FloatArray|Float32Array|Ints|IntArray|Mask|Pixels|RealArray) = NDArray\[[\w.]+\]$",
    re.MULTILINE,
)
PARSERS = {"json": {"load", "loads", "JSONDecoder"}, "tomllib": {"load", "loads"}}


@cache
def texts() -> dict[str, str]:
    """Texts of all modules by dotted name."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return {module_name(path): path.read_text(encoding="utf-8") for path in paths}


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def uses(text: str, wanted: dict[str, set[str]]) -> Iterator[str]:
    """Names of modules that are read as ``module.name``, also under another name, or imported from them."""
    if not any(module in text for module in wanted):  # most files: not parsed, which takes a hundred times as long
        return
    tree, aliases = ast.parse(text), {name: name for name in wanted}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            aliases |= {one.asname: one.name for one in node.names if one.asname and one.name in wanted}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module = aliases.get(node.value.id, "")
            if node.attr in wanted.get(module, ()):
                yield f"{module}.{node.attr}"
        elif isinstance(node, ast.ImportFrom) and node.module in wanted:
            yield from (f"{node.module}.{one.name}" for one in node.names if one.name in wanted[node.module])


def starts_of_python(text: str, name: str) -> Iterator[str]:
    """The module, once for each time that it reads the path of Python."""
    if not f"{name}.".startswith(f"{PROCESS_ROOM}.") and "executable" in text:
        yield from (name for _ in uses(text, {"sys": {"executable"}}))


def parsers(text: str, name: str) -> Iterator[str]:
    """The module, if it reads JSON or TOML."""
    if any(uses(text, PARSERS)):
        yield name


def array_names(text: str, name: str) -> Iterator[str]:
    """The module, if it names a type of arrays for itself."""
    if name != ARRAY_ROOM and ARRAY_NAME.search(text):
        yield name


def names_above(name: str) -> list[str]:
    """Patterns of the names of modules of higher packages, and of higher rooms of tts2face."""
    above = rooms()
    own = next((n for n, row in enumerate(above) for room in row if f"{name}.".startswith(f"{room}.")), 0)
    packages = PACKAGES[PACKAGES.index(name.partition(".")[0]) + 1 :]
    return [rf"{one}\.\w+" for one in packages] + [rf"{re.escape(one)}(?=[.:])" for row in above[:own] for one in row]


def higher_names(text: str, name: str) -> Iterator[str]:
    """Strings that contain the dotted name of a module of a higher package or room; docstrings may."""
    higher = names_above(name)
    pattern = re.compile(rf"\b(?:{'|'.join(higher)})(?:\.\w+)*")
    if not higher or not pattern.search(text):
        return
    tree = ast.parse(text)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            named = (one[0] for one in pattern.finditer(node.value))
            yield from (f"{name}: {one}" for one in named if is_module(one))


def is_module(name: str) -> bool:
    """Whether a dotted name begins with a module below a package: a logger of another name is none."""
    path = ROOT.joinpath(*name.split(".")[:2])
    return path.is_dir() or path.with_suffix(".py").is_file()


COUNTS: dict[str, tuple[Find, tuple[str, ...], str]] = {
    "starts of Python": (starts_of_python, STARTS_PYTHON, f"start it in {PROCESS_ROOM}"),
    "readers of JSON or TOML": (parsers, PARSES, "use lexicon.values.json_text.parse_json or a reader that exists"),
    "names of types of arrays": (array_names, NAMES_ARRAYS, f"import the type from {ARRAY_ROOM}"),
    "names of higher modules": (higher_names, NAMES_HIGHER, "let the higher package or room pass what is needed"),
}


def difference(found: list[str], listed: tuple[str, ...], remedy: str) -> list[str]:
    """What is found and not listed, with the remedy, and what is listed and no longer found."""
    new, gone = Counter(found) - Counter(listed), Counter(listed) - Counter(found)
    return [f"new: {one}; {remedy}" for one in new.elements()] + [
        f"gone: {one}; remove it from the list in {Path(__file__).name}" for one in gone.elements()
    ]


@pytest.mark.parametrize("what", COUNTS)
def test_exceptions_only_become_fewer(what: str) -> None:
    find, listed, remedy = COUNTS[what]
    found = [one for name, text in texts().items() for one in find(text, name)]
    wrong = difference(found, listed, remedy)
    assert not wrong, "\n".join(wrong)


def test_every_way_to_write_an_exception_is_found() -> None:
    made = (
        '"""Serves corpus_tools.tools."""\n'
        "import json as j, sys\nfrom json import loads, dumps\nfrom sys import executable\nimport tomllib\n"
        'run(sys.executable, "-m", "corpus_tools.run_options", f"cli.main {loads}", "tts2face.types", "cli.nothing")\n'
        "j.load(file); j.dumps({}); tomllib.loads(text)\n"
    )
    assert list(starts_of_python(made, "tts2face.x")) == ["tts2face.x"] * 2
    assert list(starts_of_python(made, PROCESS_ROOM)) == []
    assert sorted(uses(made, PARSERS)) == ["json.load", "json.loads", "tomllib.loads"]
    assert list(higher_names(made, "tts2face.x")) == [
        "tts2face.x: corpus_tools.run_options", "tts2face.x: cli.main"
    ]  # fmt: skip
    assert list(array_names("import x\nFloats = NDArray[np.float64]\n", "cli.x")) == ["cli.x"]
    assert list(array_names("FloatArray = NDArray[np.float64]\n", ARRAY_ROOM)) == []
    assert "lexicon.x: tts2face.types" in list(higher_names(made, "lexicon.x"))
    assert list(higher_names(made, "cli.x")) == []
    given = 'run("tts2face.serving.x.tasks:TASKS", "tts2face.models:run", "tts2face.serving")'
    assert list(higher_names(given, "tts2face.session.x")) == ["tts2face.session.x: tts2face.serving.x.tasks"]
    assert list(higher_names(given, "tts2face.serving.x")) == []


def test_what_is_new_and_what_is_gone_is_named() -> None:
    assert difference(["a", "b", "b"], ("b", "c"), "move it") == [
        "new: a; move it", "new: b; move it", "gone: c; remove it from the list in test_structure.py"
    ]  # fmt: skip
    assert difference(["b", "a"], ("a", "b"), "") == []
