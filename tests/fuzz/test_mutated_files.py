"""Thousands of mutated files of each kind: each is read, or refused with one sentence; none is slow or large."""

import resource
from pathlib import Path

import pytest

from tests.fuzz.mutated_files import Kind, failures, kinds, n_cases

NAMES = ("model", "project", "timeline", "cast", "mapping", "settings", "track")
MOST_GROWTH_KB = 500_000  # of the peak memory of the process; the longest text and the largest picture are far below


@pytest.fixture(scope="module")
def every_kind(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Kind, ...]]:
    return kinds(tmp_path_factory.mktemp("made"))


@pytest.mark.parametrize("name", NAMES)
def test_a_mutated_file_is_read_or_refused(name: str, every_kind: dict[str, tuple[Kind, ...]], tmp_path: Path) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert list(failures(every_kind[name], tmp_path, n_cases())) == []
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < MOST_GROWTH_KB
