"""Number of files and lines of the product's Python, in the table of packages of docs/architecture.md.

``python -m tests.docs.size`` writes them into the table.
"""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/architecture.md"
ALL = "all four"
ROW = re.compile(
    r"^\| (?P<name>`\w+`|all four) \|(?P<text>.*)\| (?P<files>[\d,]+) \| (?P<lines>[\d,]+) \|$", re.MULTILINE
)
LINES_TOLERANCE = 500  # by which they may differ, so that few commits have to renew them


class Size(NamedTuple):
    """Files and lines of Python."""

    files: int
    lines: int


def measured_sizes(root: Path, packages: list[str]) -> dict[str, Size]:
    """Size of each package, and of all together as `ALL`."""
    found = {}
    for package in packages:
        texts = [path.read_text(encoding="utf-8") for path in (root / package).rglob("*.py")]
        found[package] = Size(len(texts), sum(text.count("\n") for text in texts))
    return found | {ALL: Size(*map(sum, zip(*found.values(), strict=True)))}


def stated_sizes(page: str) -> dict[str, Size]:
    """Sizes that the page states, by package."""
    numbers = {row["name"].strip("`"): (row["files"], row["lines"]) for row in ROW.finditer(page)}
    return {name: Size(*(int(one.replace(",", "")) for one in pair)) for name, pair in numbers.items()}


def with_sizes(page: str, sizes: dict[str, Size]) -> str:
    """The page with other sizes."""

    def row(old: re.Match[str]) -> str:
        size = sizes[old["name"].strip("`")]
        return f"| {old['name']} |{old['text']}| {size.files:,} | {round(size.lines, -2):,} |"

    return ROW.sub(row, page)


def wrong_sizes(stated: dict[str, Size], measured: dict[str, Size]) -> list[str]:
    """Packages whose stated number of files is wrong, or whose lines differ by more than the tolerance."""
    return [
        f"{name} has {size.files} files with {size.lines:,} lines, not {stated[name].files} with {stated[name].lines:,}"
        for name, size in measured.items()
        if size.files != stated[name].files or abs(size.lines - stated[name].lines) > LINES_TOLERANCE
    ]


def main() -> None:
    """Write the sizes into the page."""
    page = PAGE.read_text(encoding="utf-8")
    packages = [name for name in stated_sizes(page) if name != ALL]
    PAGE.write_text(with_sizes(page, measured_sizes(ROOT, packages)), encoding="utf-8")


if __name__ == "__main__":
    main()
