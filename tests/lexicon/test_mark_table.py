"""The table of marks, and a user's own."""

from pathlib import Path

import pytest

from lexicon.errors import DataError
from lexicon.mark_table import COLUMNS, read_marks_table, shipped_marks
from lexicon.ssml_leniency import nearest_style
from lexicon.text_marks import parse_marks
from tts2face.models.palette_file import load_palette

HEADING = "\t".join(COLUMNS)


def test_every_style_of_the_table_has_one_of_the_palette() -> None:
    names = load_palette("starter").names
    used = {mark.style for rows in shipped_marks().marks.values() for mark in rows.values() if mark.style}
    assert all(style in names or nearest_style(style) in names for style in used)


def test_a_user_s_rows_precede_those_of_the_package(tmp_path: Path) -> None:
    path = tmp_path / "marks.tsv"
    path.write_text(f"{HEADING}\n🎉\temoji\tsad\tshake\t0.5\t\t\nhooray\ttag\tdelighted\nshake fist\taction\tangry\n")
    table = read_marks_table(path)
    found = parse_marks("[hooray] Yes 🎉. *shakes his fist* Go!", table=table)
    assert found.text.split() == ["Yes", ".", "Go!"]
    assert {style for run in found.runs for style in run.styles} == {"delighted", "sad", "angry"}
    assert [(mark.name, mark.size) for mark in found.marks] == [("shake", 0.5)]
    assert read_marks_table(None) is shipped_marks()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("a,b\n", "the first line must name columns of mark, kind, style, .*, not a,b"),
        (f"{HEADING}\n🎉\tpicture\n", "line 2: there is no kind 'picture' of marks; choose emoji, emoticon, tag"),
        (f"{HEADING}\n\temoji\n", "line 2: a mark has 1 to 40 characters, not ''"),
        (f"{HEADING}\n🎉\temoji\t\tjump\n", "line 2: cannot read the gesture 'jump'; write one as wink left"),
        (f"{HEADING}\n🎉\temoji\t\tnod\t9\n", "line 2: the size of the gesture nod must lie between 0.1 and 2, not 9"),
        (f"{HEADING}\nhm\ttag\t\t\t\t60\n", "line 2: a pause must lie between 0 and 10 s, not 60"),
        ("mark\tkind\tkind\n🎉\temoji\ttag\n", "the first line names a column twice; remove one of them"),
        ("mark\tkind\nhooray\ttag\tsad\n", "line 2: 3 cells stand below 2 columns; correct the tabs"),
        (f"{HEADING}\nhooray\ttag\n\nHooray\ttag\n", "line 4: 'Hooray' stands in line 2, too; remove one of them"),
        (f"{HEADING}\nfox\temoji\n", "line 2: a mark of kind emoji is an emoji, not 'fox'; correct it, or the kind"),
        (f"{HEADING}\n(\temoticon\n", "kind emoticon is two or more characters, not '\\('"),
        (f"{HEADING}\nwell done\ttag\n", "kind tag is a single word of letters, not 'well done'"),
        (f"{HEADING}\n2x\taction\n", "kind action is a verb, perhaps with words behind it, not '2x'"),
        (f"{HEADING}\n🎉\temoji\t\tnod\tbig\n", "line 2: strength must be a number of 0 or more, not 'big'"),
        (f"{HEADING}\n🎉\temoji\t\tnod\t\tlong\n", "line 2: seconds must be a number of 0 or more, not 'long'"),
        (f"{HEADING}\n🎉\temoji\thappy\t\t0.5\n", "line 2: a strength has no effect without a gesture; name one"),
        (f"{HEADING}\nhooray\ttag\t\t\t\t\tyes\n", "line 2: a word is said for emoji and emoticons only"),
    ],
)
def test_a_wrong_table_is_refused(content: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "marks.tsv"
    path.write_text(content)
    with pytest.raises(DataError, match=reason):
        read_marks_table(path)


def test_a_missing_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"none\.tsv cannot be read"):
        read_marks_table(tmp_path / "none.tsv")
