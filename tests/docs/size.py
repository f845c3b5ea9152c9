"""Number of files, lines and statements of the product's Python, in the table of packages of docs/architecture.md.

``python -m tests.docs.size`` writes them into the table.
"""

import ast
import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/architecture.md"
ALL = "all four"
ROW = re.compile(
    r"^\| (?P<name>`\w+`|all four) \|(?P<text>.*)"
    r"\| (?P<files>[\d,]+) \| (?P<lines>[\d,]+) \| (?P<statements>[\d,]+) \|$",
    re.MULTILINE,
)
TOLERANCES = (0, 500, 500)  # by which they may differ, so that few commits have to renew them
# Of all packages. They had 56,843 when the files had been divided by subject, 56,967 before it. Since then came readers
# of subtitles, transcripts, captures and films of other programs, and what says how they were read (4,400), names of
# characters' shapes, their calibration, VRM Animation and materials of scenes (900), heads without shapes (1,000),
# repairs of their scans (250), and voices: their rate, pitch, questions and pauses (800), those of faces, of servers
# and that are added (800), words in no dictionary and of other languages (600), SSML of other services, emphasis
# (400), and what makes a face alive: motion by sentence and its statistics (750), moods against rest and consent (350),
# mouths, eyes and hair as drawn (450), lids and mouths of photographs (250), hair, glasses and children of avatars
# (500). Since then came the text of language models: numbers, dates, units and words in sixteen languages (2,000),
# marks, Markdown, SSML and growing text (1,000), gestures that text names (300), hats, hair and lids of
# photographs (300); then its formulas, lists, scripture and grammar of other languages (500), a live face on a clock
# with lines, threads and plans of sound that arrives (1,250, of which the service's stream gave 80), targets of live
# faces (1,100), agents (200), marks of synthesis in every format, signatures and what reads them (750), marks over
# HTTP, in subtitles and in the studio (150).
MOST_STATEMENTS = 76_700


class Size(NamedTuple):
    """Files, lines and statements of Python (`count_statements`)."""

    files: int
    lines: int
    statements: int


def measured_sizes(root: Path, packages: list[str]) -> dict[str, Size]:
    """Size of each package, and of all together as `ALL`."""
    found = {}
    for package in packages:
        texts = [path.read_text(encoding="utf-8") for path in (root / package).rglob("*.py")]
        statements = sum(count_statements(ast.parse(text)) for text in texts)
        found[package] = Size(len(texts), sum(text.count("\n") for text in texts), statements)
    return found | {ALL: Size(*map(sum, zip(*found.values(), strict=True)))}


def count_statements(tree: ast.Module) -> int:
    """Number of statements of a module that do something, however many lines they take.

    Imports and docstrings do not count: a file that is divided by subject has more of both. An assignment of several
    values counts once for each, so that packing them on one line is no gain.
    """
    counted = 0
    for node in ast.walk(tree):
        match node:
            case ast.Import() | ast.ImportFrom() | ast.Expr(value=ast.Constant()):
                pass
            case ast.Assign(targets=[ast.Tuple(elts=names), *_], value=ast.Tuple()):
                counted += len(names)
            case ast.stmt():
                counted += 1
    return counted


def stated_sizes(page: str) -> dict[str, Size]:
    """Sizes that the page states, by package."""
    rows = {row["name"].strip("`"): [row[field] for field in Size._fields] for row in ROW.finditer(page)}
    return {name: Size(*(int(number.replace(",", "")) for number in numbers)) for name, numbers in rows.items()}


def with_sizes(page: str, sizes: dict[str, Size]) -> str:
    """The page with other sizes."""

    def row(old: re.Match[str]) -> str:
        files, *rounded = sizes[old["name"].strip("`")]
        numbers = " | ".join(f"{number:,}" for number in [files, *(round(number, -2) for number in rounded)])
        return f"| {old['name']} |{old['text']}| {numbers} |"

    return ROW.sub(row, page)


def wrong_sizes(stated: dict[str, Size], measured: dict[str, Size]) -> list[str]:
    """Packages of which a stated number differs from the measured one by more than the tolerance."""
    return [
        f"{name} has {true:,} {field}, not {said:,}"
        for name, size in measured.items()
        for field, true, said, tolerance in zip(Size._fields, size, stated[name], TOLERANCES, strict=True)
        if abs(true - said) > tolerance
    ]


def main() -> None:
    """Write the sizes into the page."""
    page = PAGE.read_text(encoding="utf-8")
    packages = [name for name in stated_sizes(page) if name != ALL]
    PAGE.write_text(with_sizes(page, measured_sizes(ROOT, packages)), encoding="utf-8")


if __name__ == "__main__":
    main()
