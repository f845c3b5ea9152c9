"""Tables of labels as Audacity exports them, under any name."""

import pytest

from tts2face.interchange.transcripts.label_table import is_label_table
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.interchange.transcripts.spoken import SpokenCue

TABLE = "0.350000\t0.620000\tbin\n0.620000\t0.840000\tred\n0.840000\t1.010000\tby\n"
WORDS = (SpokenCue(0.35, 0.62, "bin"), SpokenCue(0.62, 0.84, "red"), SpokenCue(0.84, 1.01, "by"))


@pytest.mark.parametrize(
    "content",
    [
        TABLE,
        "\ufeff" + TABLE.replace("\n", "\r\n"),
        TABLE.replace("\tred\n", "\tred\n\\\t120.500000\t8000.000000\n"),
        TABLE.replace(".", ","),
        "start\tend\tlabel\n" + TABLE,
        TABLE.replace("\t", " "),
        TABLE + "1.010000\t2.000000\t\n",
        TABLE + "1.010000\t2.000000\n",
        "".join(reversed(TABLE.splitlines(keepends=True))),
    ],
    ids=["plain", "windows", "frequencies", "commas", "names", "spaces", "empty label", "no label", "order"],
)
def test_a_table_gives_words_with_their_times(content, tmp_path):
    (tmp_path / "v.txt").write_bytes(content.encode())
    assert read_transcript(tmp_path / "v.txt").words == WORDS


def test_labels_of_points_are_words_without_length(tmp_path):
    (tmp_path / "v.txt").write_text("0.35\t0.35\tbin\n0.62\t0.62\tred\n")
    assert [(word.start, word.end, word.text) for word in read_transcript(tmp_path / "v.txt").words] == [
        (0.35, 0.35, "bin"), (0.62, 0.62, "red"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "text",
    ["", "bin red by k", "1 2 buckle my shoe\n3 4 knock at the door", "0.35\tbin", "2.0\t1.0\tbackwards", "1.\n2."],
)
def test_text_is_no_table(text):
    assert not is_label_table(text)
