import os
import re
import socket
from pathlib import Path

import pytest

from lexicon.errors import DataError
from lexicon.inputs import (
    MAX_DEPTH,
    check_regular_file,
    parse_json,
    read_bounded,
    read_json,
    read_table,
    read_text,
)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("[1", r"a\.json, line 1: not JSON"),
        ('{"a": 1,\n "b": }', r"a\.json, line 2: not JSON"),
        ("[" * 100_000, r"a\.json is nested too deep"),
        ("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), r"a\.json is nested too deep: at most 64"),
        ('{"a": ' * 70 + "1" + "}" * 70, r"a\.json is nested too deep"),
        ('{"a": ' + "7" * 5000 + "}", r"a\.json: a number of 5000 characters is too long \(77777"),
        ('{"a": 0.' + "7" * 5000 + "}", "a number of 5002 characters is too long"),
        ('{"a": 1e999}', r"the number 1e999 is too large"),
        ('{"a": -1e999}', r"the number -1e999 is too large"),
        ('{"a": NaN}', "NaN is not a JSON number"),
        ('{"a": -Infinity}', "-Infinity is not a JSON number"),
        ('{"a": {"b": 1, "b": 2}}', "'b' occurs twice in one object"),
        ('{"a": ["\\ud800"]}', r"contains the unpaired surrogate \\ud800"),
        ('"' + '\\"' * 200_000, "not JSON"),
    ],
)
def test_json_that_is_refused(content: str, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        parse_json(content, "a.json")


def test_json_that_is_read() -> None:
    nested = "[" * MAX_DEPTH + "]" * MAX_DEPTH
    assert parse_json(nested, "a.json") is not None
    brackets = '["' + "[{" * 200 + '", "\\"[", "\\ud83d\\ude00", 12345678901234567890, -1.5e3]'
    assert parse_json(brackets, "a.json") == ["[{" * 200, '"[', "😀", 12345678901234567890, -1500.0]


def test_files_are_read_to_a_size_and_no_further(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes(b"\xef\xbb\xbfHello")
    assert read_text(file, 8) == "Hello"
    with pytest.raises(DataError, match=r"a\.txt contains more than 0 MB; split it"):
        read_text(file, 7)
    with pytest.raises(DataError, match="zero contains more than 2 MB"), Path("/dev/zero").open("rb") as endless:
        read_bounded(endless, "zero", 2_000_000)
    file.write_bytes(b"h\xe9")
    with pytest.raises(DataError, match=r"a\.txt is not UTF-8 text \(byte 1\)"):
        read_json(file)


def test_a_table_is_its_rows_without_empty_ones(tmp_path: Path) -> None:
    table = tmp_path / "a.csv"
    table.write_bytes(b'\xef\xbb\xbfname,value\r\n\r\n"a,\r\nb",1\r\n')
    assert read_table(table) == [["name", "value"], ["a,\r\nb", "1"]]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"a,b\n" * 100_000, r"a\.csv contains more than 0 MB; split it"),
        (b"a,\xff\n", r"a\.csv is not UTF-8 text \(byte 2\)"),
        (b"a" * 200_000, r"a\.csv is not a CSV file \(field larger than field limit"),
    ],
)
def test_tables_that_are_refused(content: bytes, reason: str, tmp_path: Path) -> None:
    table = tmp_path / "a.csv"
    table.write_bytes(content)
    with pytest.raises(DataError, match=reason):
        read_table(table, 300_000)


def test_only_ordinary_files_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file.mp4").touch()
    Path("folder.mp4").mkdir()
    os.mkfifo("pipe.mp4")
    Path("loop.mp4").symlink_to("loop.mp4")
    Path("link.mp4").symlink_to("file.mp4")
    Path("astray.mp4").symlink_to("none.mp4")
    check_regular_file(Path("file.mp4"))
    check_regular_file(Path("link.mp4"))
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("socket.mp4")
        for name, reason in (
            ("folder.mp4", r"folder\.mp4 is a folder, not a file"),
            ("pipe.mp4", r"pipe\.mp4 is a pipe, not a file"),
            ("socket.mp4", r"socket\.mp4 is a socket, not a file"),
            ("/dev/null", "/dev/null is a device, not a file"),
            ("loop.mp4", r"loop\.mp4 cannot be read \(Too many levels of symbolic links\)"),
            ("astray.mp4", r"astray\.mp4 cannot be read \(No such file"),
            ("x" * 304, "cannot be read \\(File name too long"),
        ):
            with pytest.raises(DataError, match=reason):
                check_regular_file(Path(name))


def test_nothing_else_reads_json_from_outside() -> None:
    root = Path(__file__).parents[2]
    own = {
        "inputs.py": 1,
        "part_of_speech.py": 2,  # of a package
        "espeak.py": 1,
        "espeak_child.py": 1,
        "tensors.py": 1,
        "render_process.py": 1,
        "child_process.py": 2,
        "assets.py": 1,  # of a package with a known hash
        "job_records.py": 1,
        "job_table.py": 1,
        "resource_table.py": 1,
        "answers.py": 1,
        "state.py": 2,
        "synthesis_process.py": 1,
        "alignment_process.py": 1,
        "remote_aligner.py": 1,
        "warm_process.py": 2,
        "bundle.py": 1,
        "requests.py": 1,
    }  # but for the first, of what the program wrote
    found = {
        path.name: count
        for room in ("cli", "corpus_tools", "lexicon", "tts2face")
        for path in (root / room).rglob("*.py")
        if (count := len(re.findall(r"json\.loads?\(", path.read_text(encoding="utf-8"))))
    }
    assert found == own
