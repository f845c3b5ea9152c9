"""JSON is parsed to a depth, and refused by its line."""

import pytest

from lexicon.errors import DataError
from lexicon.values.json_text import MAX_DEPTH, parse_json


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
