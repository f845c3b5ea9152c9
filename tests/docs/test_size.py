"""The page of the architecture states how large the product is."""

import tomllib
from pathlib import Path

from tests.docs.size import ALL, PAGE, ROOT, Size, measured_sizes, stated_sizes, with_sizes, wrong_sizes


def test_the_page_of_the_architecture_states_files_and_lines() -> None:
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    stated = stated_sizes(PAGE.read_text(encoding="utf-8"))
    assert sorted(stated) == sorted([*rules["root_packages"], ALL])
    wrong = wrong_sizes(stated, measured_sizes(ROOT, rules["root_packages"]))
    assert not wrong, "\n".join(["docs/architecture.md is not true; run: python -m tests.docs.size", *wrong])


def test_sizes_are_counted_written_and_compared(tmp_path: Path) -> None:
    (tmp_path / "cli/room").mkdir(parents=True)
    (tmp_path / "cli/room/a.py").write_text("x\n" * 1234)
    (tmp_path / "cli/b.py").write_text("y\n")
    (tmp_path / "cli/table.json").write_text("{}\n")
    measured = measured_sizes(tmp_path, ["cli"])
    assert measured == {"cli": Size(2, 1235), ALL: Size(2, 1235)}
    page = "| `cli` | a, | b | 1 | 12,000 |\n| all four | | | 0 | 0 |\n| `x` | y |\n"
    assert wrong_sizes(stated_sizes(page), measured)[0] == "cli has 2 files with 1,235 lines, not 1 with 12,000"
    written = with_sizes(page, measured)
    assert written == "| `cli` | a, | b | 2 | 1,200 |\n| all four | | | 2 | 1,200 |\n| `x` | y |\n"
    assert wrong_sizes(stated_sizes(written), measured) == []
    assert wrong_sizes({"cli": Size(2, 1735)}, {"cli": Size(2, 1235)}) == []
    assert len(wrong_sizes({"cli": Size(2, 1736)}, {"cli": Size(2, 1235)})) == 1
