"""Words of files of other programs as the text of a command."""

from pathlib import Path

import pytest

from cli.main import run
from cli.transcript import TextFile
from lexicon.errors import InputError
from tests.interchange.transcripts.grids import PHONES, WORDS, relabelled, textgrid

SAID = "bin red by k seven now"
TABLE = "".join(f"{start:.6f}\t{end:.6f}\t{word}\n" for start, end, word in WORDS)
SRT = "1\n00:00:00,500 --> 00:00:02,000\nbin red by k\n\n2\n00:00:02,000 --> 00:00:03,000\nseven now\n"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.TextGrid", textgrid(phones=PHONES, words=WORDS)),
        ("a.txt", textgrid(phones=PHONES, words=WORDS)),
        ("a.txt", TABLE),
        ("labels", f"{SAID}"),
        ("a.ctm", "".join(f"a 1 {start} {end - start} {word}\n" for start, end, word in WORDS if word)),
        ("a.lab", SAID),
        ("a.srt", SRT),
    ],
)
def test_words_are_read_and_not_their_numbers(name: str, content: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    assert " ".join(TextFile(tmp_path / name, None, quiet=True).read().split()) == SAID


def test_the_choice_is_said_and_can_be_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.TextGrid"
    path.write_text(textgrid(Anna_words=WORDS, Ben_words=relabelled(WORDS, seven="two")))
    assert TextFile(path, None, quiet=False).read() == SAID
    assert "note: the words of a.TextGrid are those of its tier 'Anna words'; 'Ben" in capsys.readouterr().err
    assert TextFile(path, "Ben words", quiet=False).read() == "bin red by k two now"
    (tmp_path / "a.txt").write_text(SAID)
    with pytest.raises(InputError, match=r"--tier has no effect on .*a\.txt, which has no tiers"):
        TextFile(tmp_path / "a.txt", "words", quiet=True).read()


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["Hello.", "--tier", "words", "--out", "a.wav"], "--tier belongs to a file of words; give it with --file"),
        (["--file", "none.TextGrid", "--out", "a.wav"], "cannot read the text from none.TextGrid: No such file"),
        (["--file", "a.TextGrid", "--tier", "x", "--out", "a.wav"], "a.TextGrid has no tier 'x'; it has 'words'"),
    ],
)
def test_wrong_tiers_and_files_are_refused(
    arguments: list[str],
    reason: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.TextGrid").write_text(textgrid(words=WORDS))
    assert run(arguments) == 2
    assert reason in capsys.readouterr().err
    assert not (tmp_path / "a.wav").exists()


@pytest.mark.parametrize(
    ("beside", "shown"),
    [
        (["a.TextGrid", "a.ctm"], "a.TextGrid"),
        (["a.txt", "a.TextGrid"], "a.txt"),
        (["a.vtt"], "a.vtt"),
        (["a.tsv"], ""),
        (["b.TextGrid", "a.TextGrid.bak", "a.png"], ""),
    ],
)
def test_words_beside_a_recording_are_named_and_not_taken(
    beside: list[str], shown: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.wav", *beside):
        (tmp_path / name).write_text("no table")
    assert run(["--audio", "a.wav", "--out", "a.mp4"]) == 3
    said = capsys.readouterr().err
    note = f"note: {shown} lies beside the recording: --transcript {shown} uses its words"
    assert (note in said) == bool(shown)
    assert shown or "lies beside" not in said
    for words in (["--text", "Hello."], ["--quiet"], ["--audio-map", "network"]):
        run(["--audio", "a.wav", "--out", "a.mp4", *words])
        assert "lies beside" not in capsys.readouterr().err
