"""The table of lines: what it changes, what is refused, and that a written table is read back to the same plan."""

import csv
from pathlib import Path

import pytest

from cli.main import run
from lexicon.errors import DataError
from tests.serving.batch.conftest import SMALL, SRT
from tests.tones import LetterVoice
from tests.world import World
from tts2face.request import Request
from tts2face.serving.batch.lines import COLUMNS, read_lines, write_lines
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.output import Plan
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.report import fitted_lines, line_notes, line_rows, summarise
from tts2face.serving.batch.segment_result import SegmentResult

DIALOGUE = SRT + "\n4\n00:00:13,000 --> 00:00:15,000\n- No. - Yes.\n"


def plan(tmp_path: Path, table: str | None = None, name: str = "lines.csv", **options: object) -> Plan:
    (tmp_path / "one.srt").write_text(DIALOGUE, encoding="utf-8")
    path = None if table is None else tmp_path / name
    if table is not None and path is not None:
        path.write_text(table, encoding="utf-8")
    return plan_batch(
        [tmp_path / "one.srt"], BatchOptions(**options), request=Request(fps=10), picture=SMALL, lines=path
    )


def test_rate_voice_and_offset_of_single_lines(tmp_path: Path) -> None:
    table = "cue,part,rate,voice,offset_s\n1,,1.3,espeak,\n3,,,,-0.5\n4,1,,,0.2\n4,2,,espeak-female,\n"
    before, after = plan(tmp_path).lines, plan(tmp_path, table).lines
    assert (after[0].segment.request["rate"], after[0].segment.request["voice"]) == (1.3, "espeak")
    assert (after[0].segment.max_rate, after[0].segment.min_rate, after[0].segment.overflow) == (1.3, 1.3, "report")
    alone = plan(tmp_path, "cue,rate,voice\n1,1.3,espeak\n").lines
    assert [a.segment.address == b.segment.address for a, b in zip(before, alone, strict=True)] == [False] + [True] * 4
    assert [round(b.begin_s - a.begin_s, 6) for a, b in zip(before, after, strict=True)] == [0.0, 0.0, -0.5, 0.2, 0.2]
    assert after[4].segment.request["voice"] == "espeak-female"
    assert after[3].segment.request == before[3].segment.request


def test_lines_are_left_out_and_taken_in(tmp_path: Path) -> None:
    assert [line.segment is None for line in plan(tmp_path, "cue,spoken\n2,no\n1,yes\n").lines[:3]] == [
        False, True, False,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("table", "rate"),
    [
        ("\ufefffile;cue;rate\r\none;1;1,25\r\n", 1.25),
        ("file\tcue\trate\none.srt\t1\t1.25\n", 1.25),
        ('"cue","text","Rate"\n1,"a, ""b""\nc",1.25\n', 1.25),
        ("cue,rate,,\n1,1.25,,\n", 1.25),
        (f"{','.join(COLUMNS)}\n,1,,,,,,,1.25\n", 1.25),
    ],
)
def test_tables_of_spreadsheets_are_read(table: str, rate: float, tmp_path: Path) -> None:
    assert plan(tmp_path, table).lines[0].segment.request["rate"] == rate


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ("", "there is no column cue"),
        ("number,rate\n1,1\n", "there is no column cue; the first row names the columns: file, cue, part"),
        ("cue,ratte\n1,1.5\n", "there is no column ratte; a column is one of file, cue, part"),
        ("cue,rate,rate\n1,1.5,1\n", "the column rate is there twice; remove one of them"),
        ("cue,rate\n1,1,5\n", "line 2: there are more cells than columns"),
        ("cue,rate\n1,fast\n", "line 2: 'fast' is not a number"),
        ("cue,rate\n1,9\n", "line 2: rate must lie between 0.5 and 2, not 9"),
        ("cue,rate\n1,nan\n", "line 2: 'nan' is not a number"),
        ("cue,offset_s\n1,100\n", "line 2: offset_s must lie between -60 and 60, not 100"),
        ("cue,spoken\n1,maybe\n", "line 2: spoken must be yes, no or empty, not 'maybe'"),
        ("cue,rate\nfirst,1\n", "line 2: 'first' is not a number"),
        ("cue,rate\n1.5,1\n", "line 2: cue must be a whole number from 1"),
        ("cue,rate\n1,1\n1,1.1\n", "line 3: cue 1 has a row already; remove one of them"),
        ("cue,rate\n99,1.1\n", "one has no cue 99 with words; correct or remove the row"),
        ("cue,part,rate\n4,3,1.1\n", "one has no part 3 of cue 4 with words"),
        ("file,cue,rate\ntwo,1,1.1\n", "line 2: there is no subtitle file 'two'; it is one of one"),
    ],
)
def test_rows_that_cannot_be_used_are_refused(table: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=reason):
        plan(tmp_path, table)


def test_offsets_that_cannot_be_kept_are_warnings(tmp_path: Path) -> None:
    found = plan(tmp_path, "cue,part,offset_s\n1,,-5\n3,,-5\n4,2,0.5\n")
    assert [(one.line, one.message) for one in found.warnings if "offset" in one.message] == [
        (2, "cue 1 begins at 0 s: an offset of -5 s is before the start"),
        (14, "the offset of part 2 of cue 4 has no effect: it moves with part 1"),
    ]


def test_what_the_table_sets_is_in_the_notes_and_counts(tmp_path: Path) -> None:
    found = plan(tmp_path, "cue,part,rate,offset_s\n1,,1.3,\n2,,0.8,0.25\n3,,,-0.5\n")
    rates = (1.3, 0.8, 1.0, 1.0, 1.0)
    results = {
        line.segment.address: SegmentResult(10, 10.0, rate) for line, rate in zip(found.lines, rates, strict=True)
    }
    assert [line_notes(line, result) for line, result in fitted_lines(found, results)] == [
        ["rate 1.30 from the table of lines"],
        ["rate 0.80 from the table of lines", "offset +0.25 s"],
        ["rate 1.00", "offset -0.5 s"],
        [],
        [],
    ]
    summary = summarise(found, results)
    assert (summary.n_faster, summary.n_slower, summary.n_over_limit) == (1, 1, 0)


def test_a_table_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"none\.csv cannot be read"):
        read_lines(tmp_path / "none.csv", ["one"])


def test_a_voice_of_the_table_is_checked_before_anything_is_rendered(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no voice 'nosuch'"):
        plan(tmp_path, "cue,voice\n1,nosuch\n")


def test_a_written_table_is_read_back_to_the_same_plan(tmp_path: Path) -> None:
    table = "cue,part,rate,voice,offset_s,spoken\n1,,1.3,espeak,,\n3,,,,-0.5,\n4,2,,espeak-female,,\n2,,,,,no\n"
    first = plan(tmp_path, table)
    results = {line.segment.address: SegmentResult(10, 10.0, 1.2, 0.7) for line in first.lines if line.segment}
    write_lines(tmp_path / "back.csv", line_rows(first, results))
    content = (tmp_path / "back.csv").read_text(encoding="utf-8-sig")
    rows = list(csv.DictReader(content.splitlines()))
    assert tuple(rows[0]) == COLUMNS
    assert [row["used_rate"] for row in rows] == ["1.200", "", "1.200", "1.200", "1.200"]
    again = plan(tmp_path, content, "again.csv")
    assert [line.segment and line.segment.address for line in again.lines] == [
        line.segment and line.segment.address for line in first.lines
    ]
    assert [line.settings for line in again.lines] == [line.settings for line in first.lines]


def test_the_command_lists_speakers_rates_and_cuts_and_writes_the_table(
    voices: list[LetterVoice],
    world: World,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    long = "\n4\n00:00:13,000 --> 00:00:13,500\nBOB: abcdefgh ijklmno qrstuvw.\n"
    Path("one.srt").write_text(f"{SRT}{long}\n5\n00:00:13,500 --> 00:00:14,500\nEVE: Yes.\n", encoding="utf-8")
    words = ["batch", "one.srt", "--out", "out", "--per", "file", "--size", "64x64", "--fps", "10", *world.models]
    assert run([*words, "--dry-run", "--write-lines", "lines.csv"]) == 0
    printed = capsys.readouterr().out
    assert f"speaker (no name): 2 lines, no role, face {world.face_file}, voice heart\n" in printed
    assert f"speaker ANN: 1 line, no role, face {world.face_file}, voice heart\n" in printed
    assert "one, cue 4: rate 2.00; the rate 2.00 exceeds 1.4, as the next cue begins; 'qrstuvw.' is not" in printed
    assert "5 lines: 1 faster than usual (1 than --max-rate), 0 slower, 1 sound on into the next cue, 1 lose" in printed
    assert not Path("out").exists()
    text = Path("lines.csv").read_text(encoding="utf-8-sig")
    (row,) = [row for row in csv.DictReader(text.splitlines()) if row["cue"] == "4"]
    assert (row["speaker"], row["used_rate"], row["rate"]) == ("BOB", "2.000", "")
    Path("lines.csv").write_text(text.replace("qrstuvw.,,", "qrstuvw.,no,"), encoding="utf-8")
    assert run([*words, "--dry-run", "--lines", "lines.csv"]) == 0
    printed = capsys.readouterr().out
    assert "4 lines: 0 faster than usual" in printed
    assert "speaker BOB: silent, 1 line, no role\n" in printed
    assert run([*words, "--dry-run", "--write-lines", "one.srt"]) == 2
    assert "would replace the subtitles one.srt" in capsys.readouterr().err
    assert run([*words, "--dry-run", "--write-lines", "none/lines.csv"]) == 2
    assert "there is no folder none; create it, or choose another" in capsys.readouterr().err
