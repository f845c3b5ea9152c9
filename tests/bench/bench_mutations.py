"""A thousand structural mutations of every shipped model file and of a talker with an appearance.

``python -m tests.bench.bench_mutations [COUNT]`` prints, for each file, how many were refused, served or failed.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.models.made import write_made_talker
from tts2face.storage.shipped import SHIPPED_FOLDER

BATCH = 50  # mutations in one process; one that crashes ends its batch


def batch(kind: str, file: Path, first: int, last: int) -> list[dict]:
    """Outcomes of mutations; the one at which the process ended has the answer ``crash``."""
    words = [sys.executable, "-m", "tests.models.usage", kind, str(file), str(first), str(last)]
    tried = subprocess.run(words, capture_output=True, text=True, check=False)
    rows = [json.loads(line) for line in tried.stdout.splitlines()]
    reached = first + len(rows) - 1
    if tried.returncode == 0 or not rows:
        return rows
    crash = {"seed": reached, "what": "", "seconds": 0.0, "answer": f"crash {tried.returncode} {tried.stderr[-500:]}"}
    return [*rows, crash, *(batch(kind, file, reached + 1, last) if reached + 1 < last else [])]


def main(count: int) -> None:
    """Print a line for each file, and what failed."""
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder) / "own.talker"
        write_made_talker(own, has_face=True)
        files = [SHIPPED_FOLDER / name for name in ("head.face", "ada.face", "starter.palette", "grid_s1.talker")]
        for file in (*files, own):
            rows = []
            for first in range(0, count, BATCH):
                rows += batch(file.suffix[1:], file, first, min(first + BATCH, count))
            usual = max((row["seconds"] for row in rows if row["seed"] < 0), default=0.0)
            rows = [row for row in rows if row["seed"] >= 0]
            refused = [row for row in rows if row["answer"].startswith("DataError")]
            served = [row for row in rows if row["answer"] == "used"]
            slowest = max(row["seconds"] for row in rows)
            print(
                f"{file.name}: {len(rows)} mutations, {len(refused)} refused, {len(served)} served, "
                f"{len(rows) - len(refused) - len(served)} failed; slowest {slowest:.2f} s, unchanged {usual:.2f} s, "
                f"slowest refusal {max(row['seconds'] for row in refused):.2f} s"
            )
            for row in rows:
                if row["answer"] != "used" and not row["answer"].startswith("DataError"):
                    print(f"  {row['seed']} {row['what']}: {row['answer'].strip().splitlines()[-1]}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
