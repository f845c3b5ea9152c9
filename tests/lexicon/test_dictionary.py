"""CMUdict and the user's dictionary."""

from pathlib import Path

import pytest

from lexicon import dictionary
from lexicon.dictionary import cmudict_lookup, cmudict_words, parse_dictionary, read_dictionary
from lexicon.errors import DataError


def _phones(word: str) -> str | None:
    segments = cmudict_lookup(word)
    return None if segments is None else " ".join(segment.phone for segment in segments)


@pytest.mark.parametrize(
    ("word", "phones"),
    [
        ("hello", "h ə l oʊ"),
        ("Water", "w ɔ t ɚ"),
        ("don’t", "d oʊ n t"),
        ("aalborg", "ɔ l b ɔ ɹ ɡ"),
        ("zzxq", None),
        ("", None),
        ("a b", None),
    ],
)
def test_words_are_found(word: str, phones: str | None) -> None:
    assert _phones(word) == phones


def test_every_word_of_cmudict_is_found() -> None:
    lines = dictionary._cmudict_text().splitlines()[1:]
    missing = []
    for line in lines[::7] + lines[-3:]:
        word, _, names = line.partition(" ")
        if dictionary._cmudict_names(word) != names:
            missing.append(word)
    assert set(missing) <= {"stilton"}  # out of order in CMUdict; pronunciations.tsv has it
    assert dictionary._cmudict_names("no-such-word") is None
    assert "".join(segment.phone for segment in dictionary.own_pronunciation("Stilton") or ()) == "stɪltən"


def test_user_entries() -> None:
    own = parse_dictionary("# names\nSiobhan   SH IH0 V AO1 N  # Irish\n\nNguyen\t/ŋwiˈən/\nsiobhan /ʃɪˈvɔːn/\n")
    assert [s.phone for s in own.lookup("SIOBHAN") or ()] == ["ʃ", "ɪ", "v", "ɔ", "n"]
    assert [(s.phone, s.stress) for s in own.lookup("nguyen") or ()] == [
        ("ŋ", 0),
        ("w", 0),
        ("i", 0),
        ("ə", 1),
        ("n", 0),
    ]
    assert own.lookup("other") is None


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("word", "dictionary, line 2: 'word' has no pronunciation"),
        ("word XX", "line 2: 'XX' is not an ARPABET name"),
        ("word /həˈloʊ", "line 2: IPA must be enclosed in two slashes"),
        ("word /hЖ/", "line 2: 'Ж' .* is not a phone"),
        ("word //", "line 2: the pronunciation of 'word' contains no phone"),
        ("word " + "AA1 " * 41, "line 2: the pronunciation of 'word' has 41 phones; a word has at most 40"),
        ("word /" + "a" * 300 + "/", "line 2: the pronunciation of 'word' has 300 phones"),
    ],
)
def test_wrong_lines_are_named(line: str, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        parse_dictionary(f"good G UH1 D\n{line}\n")


def test_a_dictionary_without_end_is_not_read(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="/dev/zero is a device, not a file"):
        read_dictionary(Path("/dev/zero"))
    with open(tmp_path / "long.txt", "wb") as file:
        file.truncate(1 << 30)
    with pytest.raises(DataError, match=r"long\.txt contains more than 17 MB"):
        read_dictionary(tmp_path / "long.txt")


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "own.txt"
    path.write_bytes(b"\xef\xbb\xbfword W ER1 D\r\n")
    assert read_dictionary(path).lookup("word") is not None
    with pytest.raises(DataError, match="cannot be read"):
        read_dictionary(tmp_path / "missing.txt")
    path.write_bytes(b"w\xff")
    with pytest.raises(DataError, match=r"is not UTF-8 text \(byte 1\)"):
        read_dictionary(path)


def test_every_word_of_cmudict_is_found_in_it() -> None:
    words = cmudict_words()
    assert len(words) == len(set(words)) > 100_000
    assert {"zoo", "measure", "o'neill"} < set(words)
    assert all(cmudict_lookup(word) for word in words[::500])
