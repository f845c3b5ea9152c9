"""Progress bars: one at a time, with the name of the stage, and none without a terminal."""

import sys

import pytest

from cli.progress import progress_bar, stage_bar


def test_a_bar_starts_again_with_each_stage(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with stage_bar() as stages:
        stages("reading recordings")(3, 4)
        stages("learning phone network")(1, 2)
    output = capsys.readouterr().err
    assert "learning phone network" in output
    assert "50%" in output


@pytest.mark.parametrize("quiet", [True, False])
def test_no_bar_is_shown_without_a_terminal_or_with_quiet(quiet: bool, capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("reading", quiet) as report, stage_bar(quiet) as stages:
        report(1, 2)
        stages("learning phone network")(1, 2)
    assert capsys.readouterr() == ("", "")
