import math
import os
import socket
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from lexicon.inputs import (
    MAX_DEPTH,
    check_fields,
    check_limits,
    check_regular_file,
    parse_json,
    parse_toml,
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


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("a = ", r"a\.toml is not TOML \(Invalid value"),
        ("a = " + "[" * 5000, r"a\.toml is not TOML of at most 64 levels"),
        ("a = " + "[" * 65 + "]" * 65, r"a\.toml is nested too deep: at most 64"),
        ("a.a" * 70 + " = 1", r"a\.toml, line 1: has more than 64 dots outside quotes"),
        ("\n[" + "a." * 5000 + "a]", r"a\.toml, line 2: has more than 64 dots outside quotes"),
        ("a = " + "7" * 5000, r"a\.toml contains a number of thousands of digits"),
        ("a = 1" + "0" * 400, r"a\.toml: a is too large a number; the maximum is 1\.8e308"),
        ("b = [{a = 0x" + "f" * 5000 + "}]", r"a\.toml: a is too large a number"),
        ("a = 1e999", r"a\.toml: a must be a number, not Infinity"),
        ("[b]\na = nan", r"a\.toml: a must be a number, not NaN"),
    ],
)
def test_toml_that_is_refused(content: str, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        parse_toml(content, "a.toml")


def test_toml_that_is_read() -> None:
    hosts = [f"{number}.example.org" for number in range(70)]
    assert parse_toml(f"a = {hosts!r} # {'.' * 70}\n[b]\nc = -1.5\nd = {2**63}", "a.toml") == {
        "a": hosts,
        "b": {"c": -1.5, "d": 2**63},
    }


def test_a_key_of_many_parts_is_refused_before_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tomllib.loads", lambda content: pytest.fail("read, in the cube of the parts"))
    with pytest.raises(DataError, match="has more than 64 dots"):
        parse_toml("a." * 100_000 + "a = 1", "a.toml")


def test_text_of_quotes_is_read_once() -> None:
    with pytest.raises(DataError, match="not TOML"):  # takes minutes if the rest of the line is tried from each quote
        parse_toml('"' + '\\"' * 300_000 + "." * 70, "a.toml")


@pytest.mark.parametrize(("value", "shown"), [(10**400, "a number of more than 60 digits"), (10**20, "1" + "0" * 20)])
def test_a_number_of_any_size_outside_its_limits_is_named(value: int, shown: str) -> None:
    with pytest.raises(InputError, match=f"x must lie between 0 and 1 s, not {shown} s"):
        check_limits("x", value, (0, 1), " s")


def test_of_a_word_without_end_a_message_shows_the_beginning() -> None:
    assert str(InputError(f"there is no {'x' * 5000}; choose y")) == f"there is no {'x' * 60}... choose y"
    assert len(str(DataError(f"{'x' * 900} is missing"))) == 911


@dataclass(frozen=True)
class Options:
    """Fields of all types that options have."""

    text: str = ""
    count: int = 0
    factor: float = 1.0
    switch: bool = False
    file: Path | None = None

    def __post_init__(self) -> None:
        check_fields(self)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"text": 7}, "text must be a text in quotes, not 7"),
        ({"text": None}, "text must be a text in quotes, not null"),
        ({"count": 1.5}, r"count must be a whole number, not 1\.5"),
        ({"count": True}, "count must be a whole number, not true"),
        ({"count": 10**5000}, "count is too large a number; the maximum is 1.8e308"),
        ({"factor": "3"}, 'factor must be a number, not "3"'),
        ({"factor": math.inf}, "factor must be a number, not Infinity"),
        ({"switch": 1}, "switch must be true or false, not 1"),
        ({"file": 7}, "file must be a path, not 7"),
        ({"file": "a\0b"}, r"file is a path with the character U\+0000"),
        ({"text": [10**5000]}, "text must be a text in quotes, not a list"),
        ({"text": Fraction(1, 2)}, 'text must be a text in quotes, not "1/2"'),
    ],
)
def test_options_of_another_type_are_refused(given: dict[str, Any], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        Options(**given)


def test_options_of_python_users_are_taken() -> None:
    assert Options(file="a", text=Path("b")) == Options(file=Path("a"), text="b")  # type: ignore[arg-type]
    for number in (np.float32(0.5), Fraction(30_000, 1001), 2):
        assert Options(factor=number).factor == number  # type: ignore[arg-type]
    assert Options(count=np.int64(3)).count == 3  # type: ignore[arg-type]


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


def test_a_text_is_read_of_a_file_or_of_a_pipe_given_on_purpose(tmp_path: Path) -> None:
    (tmp_path / "zero").symlink_to("/dev/zero")
    with pytest.raises(DataError, match="zero is a device, not a file"):
        read_text(tmp_path / "zero", 7)
    os.mkfifo(tmp_path / "pipe")
    end = os.open(tmp_path / "pipe", os.O_RDWR)
    try:
        os.write(end, b"Hello there.")
        with pytest.raises(DataError, match="pipe is a pipe, not a file; remove it or use a file"):
            read_text(tmp_path / "pipe", 7)
        with pytest.raises(DataError, match="pipe contains more than"):  # it is read
            read_text(tmp_path / "pipe", 7, may_be_pipe=True)
    finally:
        os.close(end)
    given, end = os.pipe()
    os.write(end, b"Hello there.")
    os.close(end)
    assert read_text(Path(f"/dev/fd/{given}")) == "Hello there."
    os.close(given)


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
