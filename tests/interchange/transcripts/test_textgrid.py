"""TextGrids against Praat: every form that it writes, and what it reads of files of others."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import parselmouth
import pytest
from parselmouth.praat import call

from lexicon.errors import DataError
from tests.interchange.transcripts.grids import PHONES, WORDS, textgrid
from tts2face.interchange.transcripts.file_text import MAX_BYTES
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.interchange.transcripts.textgrid import read_textgrid

pytestmark = pytest.mark.formats

SAVED = ("Save as text file...", "Save as short text file...", "Save as chronological text file...",
         "Save as binary file...")  # fmt: skip
LABELS = ("", "say", 'say ""hi"" there', "1e-05", "12 seconds", "! no comment", "ñandú", "東京", "😀 up", "a\nb",
          "x\\y", "<exists>", "[1]:", "item [2]:")  # fmt: skip
SHORT = 'File type = "ooTextFile"\n"TextGrid"\n\n0\n2.5\n<exists>\n1\n"IntervalTier"\n"said"\n0\n2.5\n{}\n'


def read_by_praat(path: Path) -> list[tuple[str, list[tuple[float, float, str]]]]:
    """Names and labels of the tiers, as Praat reads them."""
    grid = parselmouth.read(str(path))
    tiers = []
    for tier in range(1, int(call(grid, "Get number of tiers")) + 1):
        rows = []
        if call(grid, "Is interval tier", tier):
            for at in range(1, int(call(grid, "Get number of intervals", tier)) + 1):
                start, end = (call(grid, f"Get {edge} time of interval", tier, at) for edge in ("start", "end"))
                rows.append((start, end, call(grid, "Get label of interval", tier, at).strip()))
        else:
            for at in range(1, int(call(grid, "Get number of points", tier)) + 1):
                time = call(grid, "Get time of point", tier, at)
                rows.append((time, time, call(grid, "Get label of point", tier, at).strip()))
        tiers.append((call(grid, "Get tier name", tier), rows))
    return tiers


def read_by_us(path: Path) -> list[tuple[str, list[tuple[float, float, str]]]]:
    return [
        (tier.name, [(label.start, label.end, label.text) for label in tier.labels]) for tier in read_textgrid(path)
    ]


def made_grid(generator: np.random.Generator) -> str:
    """A TextGrid in the long form with random edges and labels, and a tier of points."""
    edges = np.concatenate([[0.0], np.sort(generator.uniform(0, 2.95, generator.integers(1, 12)))])
    edges[1] = generator.choice([1e-05, 1.3877787807814457e-17, 0.1 + 0.2, edges[1]])
    edges = np.append(np.sort(edges), 2.95)
    rows = [
        (float(start), float(end), str(generator.choice(LABELS)).replace('""', '"')) for start, end in pairwise(edges)
    ]
    grid = textgrid(words=rows, other=WORDS, phones=PHONES)
    points = (
        '    item [4]:\n        class = "TextTier"\n        name = "beeps"\n        xmin = 0\n        xmax = 2.95\n'
    )
    points += '        points: size = 1\n        points [1]:\n            number = 0.125\n            mark = "!"\n'
    return grid.replace("size = 3\nitem", "size = 4\nitem") + points


@pytest.mark.parametrize("command", SAVED)
@pytest.mark.parametrize("seed", range(6))
def test_every_form_that_praat_writes_is_read_as_praat_does(command, seed, tmp_path):
    (tmp_path / "a.TextGrid").write_text(made_grid(np.random.default_rng(seed)), encoding="utf-8")
    call(parselmouth.read(str(tmp_path / "a.TextGrid")), command, str(tmp_path / "b.TextGrid"))
    for name in ("a.TextGrid", "b.TextGrid"):
        assert read_by_us(tmp_path / name) == read_by_praat(tmp_path / name)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_and_ends_of_lines(encoding, end, tmp_path):
    grid = textgrid(words=[(0, 1e-05, "été"), (1e-05, 2.95, 'a "b"')])
    (tmp_path / "a.TextGrid").write_bytes(grid.replace("\n", end).encode(encoding))
    assert read_by_us(tmp_path / "a.TextGrid") == [("words", [(0, 1e-05, "été"), (1e-05, 2.95, 'a "b"')])]


@pytest.mark.parametrize(
    "rows",
    [
        '1 0 2.5 "a"', '2 0 1e-05 "a" 1e-05 2.5 "b"', '1 0 12seconds "a"', '2 0 50% "a" 0.5 2.5 "b"', '1 0 5/2 "a"',
        '1 0 2.5; "a"', '1 xmin=0 0 2.5 "a"', '1 ! comment 3 "x"\n0 2.5 "a"', '1 0 +2.5 "a""b"',
        '2 0 1 "a" 1 1 "z"', '1 0 2.5 "a\nb"', '1 -1 2.5 "a"', '1 0 2.5 x"a" "b"', '1 0 2\t.5 "a"',
        '3 0 1 "a" 0.5 2 "b" 2 2.5 "c"', 'intervals [1]: 1 0 - seconds 2.5 ! seconds\n"a" "rest" 3',
    ],
)  # fmt: skip
def test_free_numbers_texts_and_comments_mean_what_they_mean_to_praat(rows, tmp_path):
    (tmp_path / "a.TextGrid").write_text(SHORT.format(rows))
    try:
        expected = read_by_praat(tmp_path / "a.TextGrid")
    except parselmouth.PraatError:
        with pytest.raises(DataError, match="damaged TextGrid: line"):
            read_textgrid(tmp_path / "a.TextGrid")
    else:
        assert read_by_us(tmp_path / "a.TextGrid") == expected


def test_a_decimal_comma_is_one_number(tmp_path):
    (tmp_path / "a.TextGrid").write_text(SHORT.format('2 0 0,75 "a" 0,75 2,5 "b"'))
    assert read_by_us(tmp_path / "a.TextGrid") == [("said", [(0, 0.75, "a"), (0.75, 2.5, "b")])]


@pytest.mark.parametrize("command", SAVED[:2])
def test_a_collection_and_a_single_tier(command, tmp_path):
    (tmp_path / "a.TextGrid").write_text(textgrid(words=WORDS))
    grid = parselmouth.read(str(tmp_path / "a.TextGrid"))
    call([grid, grid], command, str(tmp_path / "b.Collection"))
    assert read_by_us(tmp_path / "b.Collection") == 2 * read_by_us(tmp_path / "a.TextGrid")
    call(call(grid, "Extract one tier", 1), command, str(tmp_path / "c.TextGrid"))
    assert read_by_us(tmp_path / "c.TextGrid") == read_by_us(tmp_path / "a.TextGrid")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (SHORT.format('1 0 2.5 "a"b'), "line 12: a text has no closing quote, or a quote in it is not doubled"),
        (SHORT.format("1 0 2.5"), "it ends where a text is expected"),
        (SHORT.format('1 0 <x> "a"'), "line 12: '<x>' stands where a number is expected"),
        (SHORT.format('1 0 --undefined-- "a"'), "line 12: '--undefined--' is no number"),
        (SHORT.format('1 2 1 "a"'), "the label 'a' lies from 2.0 s to 1.0 s"),
        (SHORT.replace("IntervalTier", "PitchTier").format('1 0 2.5 "a"'), "there is no tier of class 'PitchTier'"),
        (SHORT.replace('"TextGrid"', '"PitchTier"').format(""), "holds a PitchTier of Praat and no TextGrid"),
    ],
)
def test_damage_is_named(content, reason, tmp_path):
    (tmp_path / "a.TextGrid").write_text(content)
    with pytest.raises(DataError, match=reason):
        read_textgrid(tmp_path / "a.TextGrid")


def test_a_binary_file_that_is_cut_is_damaged(tmp_path):
    (tmp_path / "a.TextGrid").write_text(textgrid(words=WORDS))
    call(parselmouth.read(str(tmp_path / "a.TextGrid")), SAVED[3], str(tmp_path / "b.TextGrid"))
    whole = (tmp_path / "b.TextGrid").read_bytes()
    for length in (20, 60, len(whole) - 1):
        (tmp_path / "b.TextGrid").write_bytes(whole[:length])
        with pytest.raises(DataError, match="damaged TextGrid: it ends early"):
            read_textgrid(tmp_path / "b.TextGrid")


@pytest.mark.parametrize("name", ["v.TextGrid", "v.txt"])
def test_a_textgrid_may_be_longer_than_subtitles(name, tmp_path):
    (tmp_path / name).write_text(textgrid(words=WORDS) + "\n" * (9 << 20))
    assert read_transcript(tmp_path / name).text == "bin red by k seven now"


@pytest.mark.parametrize("head", [textgrid(words=WORDS).encode(), b"ooBinaryFile\x08TextGrid"])
def test_a_textgrid_of_any_length_is_not_read(head, tmp_path):
    with (tmp_path / "v.TextGrid").open("wb") as file:
        file.write(head)
        file.truncate(MAX_BYTES + 100)
    with pytest.raises(DataError, match=r"v\.TextGrid is larger than 64 MiB"):
        read_textgrid(tmp_path / "v.TextGrid")
