"""Tables of comma-separated values."""

from pathlib import Path

import pytest

from lexicon.errors import DataError
from lexicon.values.tables import parse_table, read_table


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


@pytest.mark.parametrize("above", ["", "a; b; c; d\n", "take\t3\tgood\n\n", '"x;y";z;\n'])
def test_the_delimiter_is_that_of_the_heading(above: str) -> None:
    found = parse_table(above + "time,value,unit\n1,2;5,s\n", ",;\t", lambda row: row[:2] == ["time", "value"])
    assert found[-2:] == [["time", "value", "unit"], ["1", "2;5", "s"]]


def test_without_a_heading_the_first_row_has_the_delimiter() -> None:
    for is_heading in (None, lambda row: False):
        assert parse_table("a;b;c,d\n1;2;3\n", ",;", is_heading) == [["a", "b", "c,d"], ["1", "2", "3"]]
