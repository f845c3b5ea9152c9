"""The list of faults belongs to the present code: each fault can be put into it, and its tests exist.

Whether the tests catch them, `python -m tests.mutants` finds out.
"""

import ast
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from tests.mutants.__main__ import Run, verdict
from tests.mutants.listed import GROUPS, ROOT, Mutant, listed_mutants

MUTANTS = listed_mutants()


def test_there_are_ten_faults_of_each_group_and_each_has_a_name() -> None:
    assert Counter(mutant.group for mutant in MUTANTS) == dict.fromkeys(GROUPS, 10)
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS)
    assert [mutant.name for mutant in listed_mutants(["top-left-rule"])] == ["top-left-rule"]


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_fault_can_be_put_into_the_code_and_its_tests_exist(mutant: Mutant) -> None:
    text = (ROOT / mutant.file).read_text(encoding="utf-8")
    changed = mutant.changed(text)
    assert changed is not None, f"{mutant.file} has the old text {text.count(mutant.old)} times"
    assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(text))
    assert not mutant.missing_tests(ROOT)


def test_what_no_longer_applies_is_noticed(tmp_path: Path) -> None:
    mutant = replace(MUTANTS[0], old="a + b", new="a - b", tests=("test_x.py::test_a[1]", "test_x.py::test_b"))
    assert mutant.changed("c = a + b\n") == "c = a - b\n"
    assert mutant.changed("c = a + b + a + b\n") is None
    assert mutant.changed("c = b + a\n") is None
    assert mutant.missing_tests(tmp_path) == list(mutant.tests)
    (tmp_path / "test_x.py").write_text("async def test_a(x):\n    pass\n")
    assert mutant.missing_tests(tmp_path) == ["test_x.py::test_b"]


def test_only_a_test_that_could_run_catches_a_fault() -> None:
    failed = Run(1, 1.0, "test_x.py::test_a", could_run=True)
    assert verdict(failed) == "caught"
    assert verdict(replace(failed, could_run=False)) == "the code is broken"
    assert verdict(replace(failed, code=2)) == "no test failed (exit code 2)"
    assert verdict(Run(1, 1.0)) == "no test failed (exit code 1)"
    assert verdict(Run(5, 1.0)) == "no test failed (exit code 5)"
    assert verdict(Run(0, 1.0)) == "survived"
    assert verdict(Run(None, 60.0)) == "too slow"
