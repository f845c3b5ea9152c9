"""Cost of the check of an uploaded model, with its picture, and of a talker's building: CPU seconds and memory."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from lexicon.errors import BackendError
from tests.characters.made import write_character_file
from tts2face import Session
from tts2face.jobs.talker_job import BUILDER, LIMITS
from tts2face.storage.files import find_file
from tts2face.video.landmark_models import find_bundle

TEXT = "We were away a year ago. Bob may move. The boy will buy a pie for you. She saw the ship near the shore."


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "words").write_text("Siobhan  SH IH0 V AO1 N\n" * 1000)
        files = {
            "talker": find_file("grid_s1", "talker"), "face": find_file("head", "face"),
            "palette": find_file("starter", "palette"), "dictionary": folder / "words",
        }  # fmt: skip
        for kind, path in files.items():
            report(kind, check(kind, path, folder / kind), path)
        try:
            find_bundle(None)
        except BackendError as missing:
            print(missing)
            return
        report(
            "face of a character", check("face", write_character_file(folder / "a.glb"), folder / "b"), folder / "a.glb"
        )
        for appearance in (False, True):
            report(f"talker of a recording, appearance {appearance}", *build(folder / str(appearance), appearance))


def check(kind: str, path: Path, out: Path) -> tuple[float, float]:
    out.mkdir()
    return cost([sys.executable, "-m", "tts2face.service.uploads.decode_process", kind, str(path), str(out), "1e9"], "")


def build(folder: Path, appearance: bool) -> tuple[tuple[float, float], Path]:
    (folder / "recordings").mkdir(parents=True)
    take = folder / "recordings" / "take.mp4"
    Session().write(TEXT, take, size="256x256", fps=25)
    take.with_suffix(".txt").write_text(TEXT)
    order = {
        "folder": str(folder), "name": "anna", "provenance": {}, "consent": "I agree to this." if appearance else None,
        "with_appearance": appearance, "with_report": False, "max_bytes": 1e9,
        "limits": {"memory_bytes": LIMITS.memory_bytes, "cpu_s": 1200, "file_bytes": LIMITS.file_bytes, "n_files": 256},
    }  # fmt: skip
    return cost([sys.executable, "-m", BUILDER], json.dumps(order) + "\n"), take


def cost(command: list[str], given: str) -> tuple[float, float]:
    """CPU seconds and MB of a process."""
    environment = os.environ | {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, env=environment, text=True)
    assert child.stdin is not None
    child.stdin.write(given)
    child.stdin.flush()
    _, status, usage = os.wait4(child.pid, 0)
    assert status == 0, command
    child.stdin.close()
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def report(what: str, measured: tuple[float, float], path: Path) -> None:
    print(f"{what}: {path.stat().st_size / 1e6:.1f} MB, {measured[0]:.1f} s of CPU, {measured[1]:.0f} MB of memory")


if __name__ == "__main__":
    main()
