"""TOML is parsed to a depth, and refused by its line."""

import pytest

from lexicon.errors import DataError
from lexicon.values.toml_text import parse_toml


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
