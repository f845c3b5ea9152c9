"""Nothing leaves the machine, and nothing is written but the output, temporary files and the cache folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TEXT = "We were away a year ago, but Bob may move five big maps. Zyxwo said so."
SPEAK = "from cli.main import main; main()"
# Python's own sockets and files, by audit events; strace records native code.
AUDITED = f"""
import os, sys
def look(event, arguments):
    if event.startswith("socket.") and event not in ("socket.__new__",):
        print("NETWORK", event, arguments[1:], file=sys.stderr)
sys.addaudithook(look)
{SPEAK}
"""
VOICES = {"heart": [], "espeak": ["--voice", "espeak"]}


def environment(home: Path, **more: str) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("ORT_", "XDG_", "HIBARI_"))}
    return kept | {"HOME": str(home)} | more


def arguments(home: Path, *more: str) -> list[str]:
    return [TEXT, "--out", str(home / "x.mp4"), "--size", "64x64", "--fps", "5", "--quiet", *more]


def files_in(home: Path) -> set[str]:
    """Files in a home folder, except those of the caches, which docs/developer.md names."""
    found = {str(path.relative_to(home)) for path in home.rglob("*") if path.is_file()}
    return {path for path in found if not path.startswith(".cache/tts2face/")}


@pytest.mark.parametrize(
    "voice",
    [pytest.param(words, marks=[pytest.mark.smoke] * (name == "heart"), id=name) for name, words in VOICES.items()],
)
def test_a_run_opens_no_socket_and_leaves_only_its_output(tmp_path: Path, voice: list[str]) -> None:
    command = [sys.executable, "-c", AUDITED, *arguments(tmp_path, *voice)]
    done = subprocess.run(command, env=environment(tmp_path), capture_output=True, text=True, check=True)
    assert "NETWORK" not in done.stderr
    assert files_in(tmp_path) == {"x.mp4"}


def test_the_session_reads_no_telemetry_setting_of_the_user(tmp_path: Path) -> None:
    command = [sys.executable, "-c", SPEAK, *arguments(tmp_path)]
    subprocess.run(command, env=environment(tmp_path, ORT_DISABLE_TELEMETRY="0"), capture_output=True, check=True)
    assert files_in(tmp_path) == {"x.mp4"}


def can_trace() -> bool:
    if shutil.which("strace") is None:
        return False
    return subprocess.run(["strace", "-o", os.devnull, "true"], capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not can_trace(), reason="needs strace and the right to trace")
def test_no_system_call_of_a_run_reaches_the_network(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    command = ["strace", "-f", "-e", "trace=%network", "-o", str(trace), sys.executable, "-c", SPEAK]
    subprocess.run([*command, *arguments(tmp_path)], env=environment(tmp_path), capture_output=True, check=True)
    calls = re.findall(r"^\d+ +(?:connect|send\w+|bind|socket)\(.*AF_INET6?.*$", trace.read_text(), re.MULTILINE)
    assert calls == []


def test_telemetry_is_switched_off_where_the_runtime_is_loaded_already() -> None:
    code = (
        "import onnxruntime, os; calls = []\n"
        "onnxruntime.disable_telemetry_events = lambda: calls.append(1)\n"
        "import tts2face\n"
        "assert 'ORT_DISABLE_TELEMETRY' not in os.environ\n"
        "from tts2face.sound.heart import NeuralVoice; NeuralVoice({})\n"
        "assert calls and os.environ['ORT_DISABLE_TELEMETRY'] == '1'"
    )
    kept = {name: value for name, value in os.environ.items() if name != "ORT_DISABLE_TELEMETRY"}
    subprocess.run([sys.executable, "-c", code], env=kept, check=True)
