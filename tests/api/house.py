"""Form of the project's modules: one title, constants above functions, plain words, no packed lines.

``python -m tests.api.house PATH...`` prints by file what is wrong; ``--table`` counts it by room into `TABLE`, which
`test_house.py` lets only become less.
"""

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from tests.api.raises import superfluous_raises
from tests.api.rooms import PACKAGES, ROOT, nodes, python_files, room_of

TABLE = ROOT / "tests/api/house.tsv"
MAX_LINES = 400
MIN_PACKED = 3  # values that one statement assigns to as many names

Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
Functions = (ast.FunctionDef, ast.AsyncFunctionDef)

# A sentence ends before another one; "e.g. x", "et al. 2007" and "J. Acoust." end none.
SENTENCE_END = re.compile(
    r"(?<!\be\.g)(?<!\bi\.e)(?<!\bal)(?<!\bcf)(?<!\beq)(?<!\bFig)(?<!\bvs)(?<!\b[A-Z])[.?!][)\"'`]*\s+(?=[A-Z`\"(0-9])"
)
LIST_ITEM = re.compile(r"^\s*(?:[-*]|\d+[.)]|``.*``\s|.*::$)")
DETERMINER = r"\b(?:a|an|the|its|their|each|every|no|from|at|between|two)\s"
NOUN_PLURAL = r"\b(?:all|the|of|many|other|running|waiting|failed|fewer|over|these|its|their|too many|for|and)\s"
# Words by the reason why they are wrong, in docstrings and comments; texts that users read are not searched.
WRONG_TEXT = {
    "begin as a noun": rf"{DETERMINER}(?:(?!begin\b)\w*[^s\W]\s)?begin\b|\bbegin(?: and|,)(?: \w+)? end\b",
    "told, tells": r"\b(?:told|tells)\b",
    "look for a read": rf"{DETERMINER}looks?\b(?!-)|\blooks? (?:at|for) |\blooked (?:at|for)\b",
    "works for tasks": rf"{NOUN_PLURAL}works\b|\ba work\b|^works\b",
}
WRONG_NAMES = {
    "begin as a noun": re.compile(r"(?:^|_)begins?(?:$|_s$|_sample$|_spread)", re.IGNORECASE),
    "told, tells": re.compile(r"(?:^|_)(?:told|tells)(?:$|_)", re.IGNORECASE),
    "look for a read": re.compile(r"(?:^|_)looks?(?:$|_(?!up|ahead|down))", re.IGNORECASE),
    "works for tasks": re.compile(r"(?:^|_)works(?:$|_)", re.IGNORECASE),
    "one as a name": re.compile(r"^one$"),
}
EYES = re.compile(r"gaze|gesture_marks|listening|presentation|timeline|gestures/stream")  # files in which eyes look
BUILDERS = re.compile(r"corpus_tools/(?:shipped|dense)/")  # a look is how a person is drawn


class Finding(NamedTuple):
    """What is wrong in a line of a module."""

    line: int
    text: str


class Module:
    """A module and what is checked of it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.text = path.read_text(encoding="utf-8")
        self.nodes = nodes(path)

    @property
    def tree(self) -> ast.Module:
        """The module's own node."""
        assert isinstance(self.nodes[0], ast.Module)
        return self.nodes[0]

    @cached_property
    def docstrings(self) -> list[tuple[Documented, ast.Constant]]:
        """Docstrings of the module, its classes and functions."""
        return [
            (node, node.body[0].value)
            for node in self.nodes
            if isinstance(node, Documented)
            and node.body
            and isinstance(node.body[0], ast.Expr)
            and isinstance(node.body[0].value, ast.Constant)
        ]

    @cached_property
    def comments(self) -> list[tuple[int, str]]:
        """Lines and texts of the comments."""
        tokens = tokenize.generate_tokens(io.StringIO(self.text).readline)
        return [(token.start[0], token.string.lstrip("# ")) for token in tokens if token.type == tokenize.COMMENT]

    @cached_property
    def names(self) -> list[tuple[int, str, bool]]:
        """Lines of the names that the module gives, and whether the name is that of a function."""
        found = []
        for node in self.nodes:
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                found.append((node.lineno, node.id, False))
            elif isinstance(node, ast.arg):
                found.append((node.lineno, node.arg, False))
            elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
                found.append((node.lineno, node.attr, False))
            elif isinstance(node, Functions):
                found.append((node.lineno, node.name, True))
            elif isinstance(node, ast.ClassDef):
                found.append((node.lineno, re.sub(r"(?<=[a-z])(?=[A-Z])", "_", node.name), False))
        return found


def titles(module: Module) -> Iterator[Finding]:
    """Docstrings of modules that are not one sentence and at most one paragraph or list."""
    if not module.tree.body:
        return
    text = ast.get_docstring(module.tree)
    if text is None:
        yield Finding(1, "no docstring")
        return
    first, *rest = re.split(r"\n\s*\n", text)
    if SENTENCE_END.search(first):
        yield Finding(1, "title of several sentences")
    if not first.rstrip(")\"'`").endswith((".", "?", ":")):
        yield Finding(1, "title without an end")
    if len(blocks := _blocks(rest)) > 1:
        yield Finding(1, f"{len(blocks)} paragraphs after the title")


def _blocks(paragraphs: list[str]) -> list[list[str]]:
    """Paragraphs by what belongs together: a list, and what a colon or a headline introduces, is one with it."""
    found: list[list[str]] = []
    for paragraph in paragraphs:
        continues = found and (
            found[-1][-1].rstrip().endswith(":")
            or re.search(r"^-{3,}$", found[-1][0], re.MULTILINE) is not None
            or paragraph.startswith((" ", ">>>"))
            or (LIST_ITEM.match(paragraph) and LIST_ITEM.match(found[-1][-1]))
        )
        if continues:
            found[-1].append(paragraph)
        else:
            found.append([paragraph])
    return found


def low_constants(module: Module) -> Iterator[Finding]:
    """Constants after the first function that name nothing of the module that stands below its first function."""
    below: set[str] = set()
    has_function = False
    for node in module.tree.body:
        if isinstance(node, (*Functions, ast.ClassDef)):
            has_function = has_function or isinstance(node, Functions)
            below |= {node.name} if has_function else set()
        elif has_function and isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = [part.id for one in targets for part in ast.walk(one) if isinstance(part, ast.Name)]
            used = {part.id for part in ast.walk(node) if isinstance(part, ast.Name) and part.id not in names}
            if used & below:
                below |= set(names)
            elif names != ["__all__"]:
                yield Finding(node.lineno, f"constant {', '.join(names)} after the first function")


def long_files(module: Module) -> Iterator[Finding]:
    """Files of more lines than `MAX_LINES`."""
    if (n := module.text.count("\n")) > MAX_LINES:
        yield Finding(1, f"{n} lines")


def wrong_words(module: Module) -> Iterator[Finding]:
    """Words of the list in docstrings, comments and names."""
    may_look = any(pattern.search(module.path.as_posix()) for pattern in (EYES, BUILDERS))
    texts = [(value.lineno, str(value.value)) for _, value in module.docstrings] + module.comments
    for reason in WRONG_NAMES.keys() - ({"look for a read"} if may_look else set()):
        yield from _wrong_texts(reason, texts)
        for line, name, is_function in module.names:
            is_verb = is_function and reason == "begin as a noun"
            if WRONG_NAMES[reason].search(name) and not is_verb:
                yield Finding(line, f"{reason}: {name}")
    for _, value in module.docstrings:
        if str(value.value).lstrip().startswith("What "):
            yield Finding(value.lineno, "docstring that begins with What")


def _wrong_texts(reason: str, texts: list[tuple[int, str]]) -> Iterator[Finding]:
    """Findings of a kind of word in texts by their first line."""
    pattern = re.compile(WRONG_TEXT.get(reason, r"(?!)"), re.MULTILINE | re.IGNORECASE)
    for line, text in texts:
        for match in pattern.finditer(text):
            yield Finding(line + text.count("\n", 0, match.start()), f"{reason}: {match[0].splitlines()[0]}")


def packed_lines(module: Module) -> Iterator[Finding]:
    """Statements that assign three or more values to as many names."""
    for node in module.nodes:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple):
            for target in node.targets:
                if isinstance(target, ast.Tuple) and len(target.elts) >= MIN_PACKED:
                    yield Finding(node.lineno, f"{len(target.elts)} assignments in one")


def needless_raises(module: Module) -> Iterator[Finding]:
    """``Raises`` at functions that no other room and no user calls."""
    for node in superfluous_raises(module.path):
        yield Finding(node.lineno, f"Raises of {node.name}, which no other room calls")


CHECKS: dict[str, Callable[[Module], Iterator[Finding]]] = {
    "titles": titles,
    "constants": low_constants,
    "long": long_files,
    "words": wrong_words,
    "packed": packed_lines,
    "raises": needless_raises,
}


def findings(paths: list[Path]) -> Iterator[tuple[Path, str, Finding]]:
    """All that is wrong in files, with the name of the check."""
    for path in python_files(paths):
        module = Module(path)
        yield from ((path, name, found) for name, check in CHECKS.items() for found in check(module))


def counts() -> dict[str, Counter[str]]:
    """Numbers of what is wrong in the four packages, by room and check."""
    found: dict[str, Counter[str]] = {}
    for path, name, _ in findings([ROOT / package for package in PACKAGES]):
        found.setdefault(room_of(path), Counter())[name] += 1
    return found


def read_table() -> dict[str, Counter[str]]:
    """The numbers of `TABLE`."""
    header, *rows = (line.split("\t") for line in TABLE.read_text(encoding="utf-8").splitlines())
    return {room: Counter(dict(zip(header[1:], map(int, numbers), strict=True))) for room, *numbers in rows}


def write_table(found: dict[str, Counter[str]]) -> None:
    """Write numbers into `TABLE`."""
    rows = [["room", *CHECKS], *([room, *(str(found[room][name]) for name in CHECKS)] for room in sorted(found))]
    TABLE.write_text("".join("\t".join(row) + "\n" for row in rows), encoding="utf-8")


def main(arguments: list[str]) -> None:
    """Print what is wrong in files by the paths, or write the table."""
    if arguments == ["--table"]:
        write_table(counts())
        return
    listed = list(findings([Path(argument).resolve() for argument in arguments]))
    for path, name, (line, text) in listed:
        print(f"{path.relative_to(ROOT)}:{line}: {name}: {text}")
    print(", ".join(f"{n} {name}" for name, n in Counter(name for _, name, _ in listed).items()) or "nothing is wrong")


if __name__ == "__main__":
    main(sys.argv[1:])
