"""Killed runs leave nothing behind, and the markers of tests follow from their folders."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests import started
from tests.conftest import DEFAULT, GROUPS, NIGHTLY, SMOKE, TESTS, may_run_by_default
from tests.running import eventually

STARTS = """
import os, subprocess, tempfile, time

def test_starts_others_and_is_killed():
    child = subprocess.Popen(["sh", "-c", "env -i sleep 600; :"])
    with open(os.environ["REPORT"] + ".part", "w") as report:
        report.write(f"{child.pid} {tempfile.mkdtemp()}")
    os.rename(os.environ["REPORT"] + ".part", os.environ["REPORT"])
    time.sleep(600)
"""


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc")
def test_a_killed_run_leaves_no_processes_and_no_files(tmp_path: Path) -> None:
    """A shell, and a process that it has started with an environment of its own."""
    (tmp_path / "test_it.py").write_text(STARTS)
    report = tmp_path / "report"
    command = [sys.executable, "-m", "pytest", "-p", "tests.started", "-c", os.devnull, "--rootdir", str(tmp_path)]
    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    environment = own | {"REPORT": str(report), "PYTHONPATH": str(TESTS.parent)}
    with subprocess.Popen([*command, str(tmp_path)], env=environment, stdout=subprocess.DEVNULL) as run:
        eventually(report.exists)
        shell, folder = report.read_text().split()
        number = Path(folder).parent.name.rsplit("-", 1)[1]
        assert len(eventually(lambda: [one for one in started.processes_of(number) if one != int(shell)])) == 1
        run.send_signal(signal.SIGKILL)
    eventually(lambda: not started.processes_of(number))
    eventually(lambda: not Path(folder).parent.exists())
    assert int(shell) not in started.running_processes()


def test_the_default_run_leaves_out_the_groups(pytestconfig: pytest.Config) -> None:
    assert DEFAULT in pytestconfig.getini("addopts")
    folders = {path.name for path in TESTS.rglob("*") if path.is_dir()}
    assert set(GROUPS) <= folders
    shown = subprocess.run(
        [sys.executable, "-m", "pytest", "--markers"], cwd=TESTS.parent, capture_output=True, text=True, check=True
    )
    assert all(f"@pytest.mark.{name}: tests in folders of this name" in shown.stdout for name in GROUPS)
    assert f"@pytest.mark.{NIGHTLY}: " in shown.stdout


def test_what_runs_by_default_in_a_folder_of_a_group_is_named_in_its_module() -> None:
    """By the marker, or by the list that gives it: other modules there are not read by a default run."""
    marking = [path for path in TESTS.rglob("*.py") if "mark.smoke" in path.read_text(encoding="utf-8")]
    lists = {path.relative_to(TESTS.parent) for path in marking if not path.name.startswith("test_")}
    assert {".".join(path.with_suffix("").parts) for path in lists} == {name for name in SMOKE if "." in name}
    assert all(may_run_by_default(path) for path in marking)
    assert may_run_by_default(TESTS / "face/build/test_people.py")
    assert not may_run_by_default(TESTS / "build/test_rendered_takes.py")


def test_nightly_tests_are_in_no_other_group(request: pytest.FixtureRequest) -> None:
    found = [item for item in request.session.items if item.get_closest_marker(NIGHTLY)]
    assert [item.nodeid for item in found if {mark.name for mark in item.iter_markers()} & {*GROUPS, "smoke"}] == []
