"""The listed faults: what each changes in which file, and the tests that are to fail of it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lexicon.values.records import checked
from lexicon.values.toml_text import parse_toml

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_name("mutants.toml")
GROUPS = ("kernels", "refusals", "times")


@dataclass(frozen=True, slots=True)
class Mutant:
    """A fault: the text `old`, which stands in `file` once, is replaced by `new`, and one of `tests` fails.

    Parameters
    ----------
    group
        One of `GROUPS`.
    fault
        What the changed program does wrong, in a sentence.
    file
        Path from the root of the project.
    tests
        Files, folders or single tests, as pytest takes them.
    """

    name: str
    group: str
    fault: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def changed(self, text: str) -> str | None:
        """Text of the file with the fault; None if `old` does not stand in it exactly once."""
        return text.replace(self.old, self.new) if text.count(self.old) == 1 else None

    def missing_tests(self, root: Path) -> list[str]:
        """Tests that do not exist."""
        return [test for test in self.tests if not _exists(root, test)]


@dataclass(frozen=True, slots=True)
class _List:
    mutant: tuple[Mutant, ...]


def listed_mutants(names: Sequence[str] = ()) -> tuple[Mutant, ...]:
    """Mutants of the list, or those of some names.

    Raises
    ------
    DataError
        The list has a mistake.
    """
    found = checked(_List, parse_toml(LIST.read_text(encoding="utf-8"), LIST.name), LIST.name).mutant
    return tuple(mutant for mutant in found if not names or mutant.name in names)


def _exists(root: Path, test: str) -> bool:
    """Whether a path exists, and its file has the function of a test that is named behind ``::``."""
    path, _, function = test.partition("::")
    if not function:
        return (root / path).exists()
    pattern = rf"^(?:async )?def {re.escape(function.partition('[')[0])}\("
    return (root / path).is_file() and re.search(pattern, (root / path).read_text("utf-8"), re.MULTILINE) is not None
