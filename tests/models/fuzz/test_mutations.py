"""Mutated model files are refused with a DataError or can be used; none crashes or hangs."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.models.made import write_made_face, write_made_palette, write_made_talker

N_MUTATIONS = 60  # of each kind; tests/fuzz reads thousands, tests/bench uses 1000 of each shipped file
MOST_S = 2.0  # of processor time beyond that of the unchanged file
ROOT = Path(__file__).resolve().parents[3]


def write_own_talker(path: Path) -> None:
    write_made_talker(path, has_face=True)


MADE = {"face": write_made_face, "palette": write_made_palette, "talker": write_own_talker}


@pytest.mark.parametrize("kind", ["face", "talker", pytest.param("palette", marks=pytest.mark.smoke)])
def test_a_mutated_file_is_refused_or_usable(kind: str, tmp_path: Path) -> None:
    file = tmp_path / f"made.{kind}"
    MADE[kind](file)
    words = [sys.executable, "-m", "tests.models.usage", kind, str(file), "0", str(N_MUTATIONS)]
    tried = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    rows = [json.loads(line) for line in tried.stdout.splitlines()]
    assert tried.returncode == 0, f"ended after {rows[-1:]}: {tried.stderr[-2000:]}"
    assert len(rows) == 1 + N_MUTATIONS
    assert rows[0]["answer"] == "used"
    for row in rows[1:]:
        assert row["answer"] == "used" or row["answer"].startswith("DataError"), f"{row['what']}: {row['answer']}"
        assert row["seconds"] < MOST_S + rows[0]["seconds"], row["what"]
    refused = sum(row["answer"] != "used" for row in rows)
    assert N_MUTATIONS / 2 < refused < N_MUTATIONS
