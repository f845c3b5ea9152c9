"""The page of the architecture states how large the product is."""

import tomllib
from pathlib import Path

from tests.docs.size import (
    ALL,
    MOST_STATEMENTS,
    PAGE,
    ROOT,
    Size,
    measured_sizes,
    stated_sizes,
    with_sizes,
    wrong_sizes,
)  # fmt: skip


def test_the_page_of_the_architecture_states_the_sizes_and_no_package_grows() -> None:
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    stated, measured = stated_sizes(PAGE.read_text(encoding="utf-8")), measured_sizes(ROOT, rules["root_packages"])
    assert sorted(stated) == sorted([*rules["root_packages"], ALL])
    wrong = wrong_sizes(stated, measured)
    assert not wrong, "\n".join(["docs/architecture.md is not true; run: python -m tests.docs.size", *wrong])
    assert measured[ALL].statements <= MOST_STATEMENTS


def test_sizes_are_counted_written_and_compared(tmp_path: Path) -> None:
    (tmp_path / "cli/room").mkdir(parents=True)
    (tmp_path / "cli/room/a.py").write_text("x\n" * 1234)
    (tmp_path / "cli/b.py").write_text('"""Title."""\nimport y\nif y:\n    x, z = (\n        1), 2\n')
    (tmp_path / "cli/table.json").write_text("{}\n")
    measured = measured_sizes(tmp_path, ["cli"])
    assert measured == {"cli": Size(2, 1239, 1237), ALL: Size(2, 1239, 1237)}
    page = "| `cli` | a, | b | 1 | 12,000 | 9 |\n| all four | | | 0 | 0 | 0 |\n| `x` | y |\n"
    assert wrong_sizes(stated_sizes(page), measured)[:3] == [
        "cli has 2 files, not 1", "cli has 1,239 lines, not 12,000", "cli has 1,237 statements, not 9"
    ]  # fmt: skip
    written = with_sizes(page, measured)
    assert written == "| `cli` | a, | b | 2 | 1,200 | 1,200 |\n| all four | | | 2 | 1,200 | 1,200 |\n| `x` | y |\n"
    assert wrong_sizes(stated_sizes(written), measured) == []
    assert wrong_sizes({"cli": Size(2, 1735, 0)}, {"cli": Size(2, 1235, 500)}) == []
    assert len(wrong_sizes({"cli": Size(2, 1736, 0)}, {"cli": Size(2, 1235, 501)})) == 2
