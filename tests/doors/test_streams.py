"""The command line where standard streams are closed, full, endless, or of a terminal with few characters."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

COMMAND = [sys.executable, "-m", "tts2face"]
FULL = Path("/dev/full")


def run_redirected(*words: str, redirect: str = "", **environment: str) -> "subprocess.CompletedProcess[str]":
    """A command whose streams the shell redirects."""
    return subprocess.run(
        ["sh", "-c", f'"$@" {redirect}', "sh", *COMMAND, *words],
        capture_output=True, encoding="utf-8", check=False, timeout=120,
        env={**os.environ, "PYTHONUNBUFFERED": "", **environment},  # what is held is written at the end, as for users
    )  # fmt: skip


@pytest.mark.skipif(not FULL.exists(), reason="needs the device /dev/full of Linux")
@pytest.mark.parametrize("words", [("phones", "Hello."), ("--help",), ("--version",), ("faces", "--json")])
def test_a_full_standard_output_is_one_sentence(words: tuple[str, ...]) -> None:
    completed = run_redirected(*words, redirect=">/dev/full")
    assert completed.returncode == 4
    assert completed.stderr == (
        "tts2face: cannot write to standard output: No space left on device; check where it is redirected to\n"
    )


def test_a_closed_standard_output_is_one_sentence() -> None:
    completed = run_redirected("phones", "Hello.", redirect=">&-")
    assert completed.returncode == 4
    assert completed.stderr.startswith("tts2face: cannot write to standard output: ")
    assert len(completed.stderr.splitlines()) == 1


@pytest.mark.commands
def test_a_closed_or_full_standard_error_changes_neither_answer_nor_exit_code() -> None:
    plain = run_redirected("phones", "Hello.")
    assert "həˈloʊ" in plain.stdout
    for redirect in ("2>&-", "2>/dev/full" if FULL.exists() else "2>&-"):
        answered = run_redirected("phones", "Hello.", redirect=redirect)
        assert (answered.returncode, answered.stdout) == (0, plain.stdout)
        refused = run_redirected("Hello.", "--quite", redirect=redirect)
        assert (refused.returncode, refused.stdout) == (2, "")


def test_a_closed_standard_input_holds_no_text(tmp_path: Path) -> None:
    completed = run_redirected("--out", str(tmp_path / "x.mp4"), redirect="<&-")
    assert completed.returncode == 2
    assert "the text is empty" in completed.stderr


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_an_answer_for_a_terminal_with_few_characters_is_escaped(encoding: str) -> None:
    completed = run_redirected("phones", "Hello.", PYTHONIOENCODING=encoding)
    assert completed.returncode == 0, completed.stderr
    assert "h\\u0259\\u02c8lo\\u028a" in completed.stdout
    listed = run_redirected("languages", "--json", PYTHONIOENCODING="ascii")
    names = {entry["code"]: entry["name"] for entry in json.loads(listed.stdout)}
    assert names["mi"] == "Māori"


def test_a_result_in_the_c_locale_is_escaped() -> None:
    completed = run_redirected("phones", "Hello.", LC_ALL="C", LANG="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0")
    assert completed.returncode == 0, completed.stderr
    assert "h\\u0259\\u02c8lo\\u028a" in completed.stdout


def test_text_without_end_is_refused(tmp_path: Path) -> None:
    out = str(tmp_path / "x.mp4")
    for words, redirect, source in (
        (("--file", "/dev/zero"), "", "/dev/zero"),
        ((), "</dev/zero", "standard input"),
    ):
        completed = run_redirected(*words, "--out", out, redirect=redirect)
        assert completed.returncode == 2
        assert completed.stderr == f"tts2face: {source} contains more than 17 MB; split it into smaller files\n"
