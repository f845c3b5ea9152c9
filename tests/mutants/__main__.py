"""Puts each listed fault into a copy of the project and runs the tests that are to catch it.

``python -m tests.mutants [NAME ...]`` prints a line for each fault. The exit code is 1 unless each one is caught: a
test fails within `LIMIT_S` that passes without the fault, and not since its code cannot be imported or compiled. The
list is `mutants.toml`. The copy holds the files that git knows, as they are in the working tree, and has its own cache
of compiled kernels.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.first_failure import NOTE
from tests.mutants.listed import ROOT, Mutant, listed_mutants
from tts2face.numeric.kernels import CACHE_VARIABLE, cache_folder
from tts2face.storage.user_folders import user_cache

LIMIT_S = 60.0  # of the tests of one fault on an idle machine
FAILED = 1  # exit code of pytest if a test has failed
PYTEST = ("-m", "pytest", "-n", "0", "-x", "-q", "-p", "no:cacheprovider", "-p", "tests.mutants.first_failure")


@dataclass(frozen=True, slots=True)
class Run:
    """What pytest has done: its exit code, None if it took too long; seconds; the first failure, if there is one."""

    code: int | None
    seconds: float
    test: str = ""
    could_run: bool = False
    text: str = ""


class Copy:
    """A copy of the project in a folder, in which one file at a time is changed."""

    def __init__(self, folder: Path) -> None:
        self._root, self._note = folder / "project", folder / "failure.json"
        for name in _tracked_files():
            target = self._root / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
        cache = folder / "cache"
        _copy_folder(user_cache(), cache / user_cache().name)
        _copy_folder(cache_folder(), folder / "kernels")
        # Real recordings, where there are some, are not needed to catch a fault and take long.
        kept = {name: value for name, value in os.environ.items() if name not in {"TTS2FACE_SHARED", "PYTEST_ADDOPTS"}}
        self._environment = kept | {
            "PYTHONPATH": str(self._root), CACHE_VARIABLE: str(folder / "kernels"), NOTE: str(self._note),
            "XDG_CACHE_HOME": str(cache), "TTS2FACE_TEST_CACHE": str(cache / user_cache().name / "tests"),
        }  # fmt: skip

    def try_mutant(self, mutant: Mutant, limit_s: float) -> tuple[str, Run]:
        """Verdict and run of the tests of a fault; the verdict is ``caught``, or what is wrong."""
        file = self._root / mutant.file
        text = mutant.changed(file.read_text(encoding="utf-8")) if file.is_file() else None
        if text is None:
            return "no longer applies", Run(None, 0.0)
        if mutant.missing_tests(self._root):
            return "its tests are gone", Run(None, 0.0)
        file.write_text(text, encoding="utf-8")
        try:
            run = self._run(mutant.tests, limit_s)
        finally:
            shutil.copy2(ROOT / mutant.file, file)
        found = verdict(run)
        if found == "caught" and self._run([run.test], limit_s).code != 0:
            return "fails without it", run
        return found, run

    def _run(self, tests: "tuple[str, ...] | list[str]", limit_s: float) -> Run:
        self._note.unlink(missing_ok=True)
        began = time.monotonic()
        try:
            done = subprocess.run(
                [sys.executable, *PYTEST, *tests], cwd=self._root, env=self._environment, timeout=limit_s,
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return Run(None, time.monotonic() - began)
        seconds = time.monotonic() - began
        failure = json.loads(self._note.read_text(encoding="utf-8")) if self._note.is_file() else {}
        return Run(done.returncode, seconds, **failure)


def verdict(run: Run) -> str:
    """``caught`` if a test has run and failed; else what has happened in its place."""
    if run.code is None:
        return "too slow"
    if run.code == 0:
        return "survived"
    if run.code != FAILED or not run.test:
        return f"no test failed (exit code {run.code})"
    return "caught" if run.could_run else "the code is broken"


def _tracked_files() -> list[str]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def _copy_folder(source: Path, target: Path) -> None:
    """Copy a folder; where there is none, make an empty one."""
    if source.is_dir():
        shutil.copytree(source, target)
    else:
        target.mkdir(parents=True)


def main() -> int:
    """Try the faults, print a line for each, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description="Are the listed faults caught?")
    parser.add_argument("names", nargs="*", metavar="NAME", help="names of faults; all without any")
    parser.add_argument(
        "--limit", type=float, default=LIMIT_S, metavar="SECONDS", help="for the tests of one fault (%(default)g)"
    )
    asked = parser.parse_args()
    mutants = listed_mutants(asked.names)
    if unknown := set(asked.names) - {mutant.name for mutant in mutants}:
        parser.error(f"there is no fault {', '.join(sorted(unknown))}")
    n_caught = 0
    with tempfile.TemporaryDirectory(prefix="tts2face-mutants-") as folder:
        copy = Copy(Path(folder))
        for mutant in mutants:
            found, run = copy.try_mutant(mutant, asked.limit)
            n_caught += found == "caught"
            shown = run.test or mutant.fault
            print(f"{mutant.group:9} {mutant.name:20} {found:10} {run.seconds:5.1f} s  {shown}", flush=True)
            if run.text:
                print(f"{'':10}{run.text.strip().splitlines()[0]:.110}", flush=True)
    print(f"{n_caught} of {len(mutants)} faults are caught")
    return 0 if n_caught == len(mutants) else 1


if __name__ == "__main__":
    sys.exit(main())
