"""Subtitles, tables and plain text in files of any name: what they are is seen in their lines."""

import pytest

from lexicon.errors import DataError, InputError
from tests.interchange.transcripts.grids import WORDS, textgrid
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.interchange.transcripts.written_words import is_subtitle_file, read_written_words

SRT = "1\n00:00:00,500 --> 00:00:02,000\nbin red by k\n\n2\n00:00:02,000 --> 00:00:03,000\nseven now\n"
WHISPER = "[00:00.500 --> 00:02.000]  bin red by k\n[00:02.000 --> 00:03.000]  seven now\n"
PANEL = "0:00\nbin red\n0:02\nby k\n1:00:05\nseven now\n"
TSV = "start\tend\ttext\n500\t2000\tbin red by k\n2000\t3000\tseven now\n"
PRAAT_TABLE = (
    "tmin\ttier\ttext\ttmax\n0.5\twords\tbin\t0.8\n0.5\tphones\tb\t0.6\n0.6\tphones\tI\t0.7\n0.7\tphones\tn\t0.8\n"
    "0.8\twords\tred by k seven now\t3\n"
)
SAID = "bin red by k seven now"


@pytest.mark.parametrize(
    "content",
    [
        SRT,
        "\ufeff" + SRT.replace("\n", "\r\n"),
        SRT.replace("1\n", "", 1).replace("2\n", "", 1),
        "WEBVTT\n\n00:00.500 --> 00:02.000\nbin red by k\n\nb\n00:02.000 --> 00:03.000\nseven now\n",
        WHISPER,
        WHISPER.replace("[00:", "[00:00:").replace("> 00:", "> 00:00:"),
        PANEL,
        "Anna Smith  0:03\nbin red\n\nSpeaker 2  0:05\nby k\n\nAnna Smith  1:00:05\nseven now\n",
        "Anna (00:03):\nbin red by\nk\n\nBen (00:05):\nseven\n\nAnna (00:05):\nnow\n",
        "(0:00) bin red by\n(0:01) k\n(0:02) seven now\n",
        "[ti:x]\n[00:00.50]bin red by k\n[00:02.00]seven now\n",
        "00:00:01:bin red|by k\n00:00:02:seven now\n",
        "[00:00:01]\nbin red by k\n[00:00:02]\nseven now\n[00:00:03]\n",
        "<timedtext><body><p t='500' d='1500'>bin red by k</p><p t='2000' d='900'>seven now</p></body></timedtext>",
        "{0}{50}bin red by k\n{50}{75}seven now\n",
        "0:00:00.500,0:00:02.000\nbin red by k\n\n0:00:02.000,0:00:03.000\nseven now\n",
        "<SAMI><BODY><SYNC Start=500><P Class=EN>bin red by k<SYNC Start=2000><P Class=EN>seven now</BODY></SAMI>",
        "[Script Info]\n\n[Events]\nFormat: Start, End, Text\nDialogue: 0:00:00.50,0:00:02.00,bin red by k\n"
        "Dialogue: 0:00:02.00,0:00:03.00,seven now\n",
        "<?xml version='1.0'?><tt xmlns='http://www.w3.org/ns/ttml'><body><div><p begin='0.5s' end='2s'>bin red by k"
        "</p><p begin='2s' end='3s'>seven now</p></div></body></tt>",
    ],
)
@pytest.mark.parametrize("name", ["v.txt", "v.log"])
def test_subtitles_of_any_name_are_subtitles(content, name, tmp_path):
    (tmp_path / name).write_text(content, encoding="utf-8")
    found = read_written_words(tmp_path / name)
    assert found is not None
    assert " ".join(found.text.split()) == SAID
    assert found.notes[0] == f"{name} holds subtitles by its lines, whose times are not words"
    with pytest.raises(InputError, match="--tier has no effect on"):
        read_written_words(tmp_path / name, "words")


@pytest.mark.parametrize(
    "text",
    [
        "bin red by k",
        "Go left --> right at 10:00 and so on.\nAt 10:30 --> 11:00 we rest.\n",
        "9:00 Breakfast\n10:00 Walk\n11:00 Lunch\n",
        "0:00 is when it begins.\nThen we go.\nAnd go.\nAnd rest.\nAt 0:30 it ends.\n",
        "Intro 0:00\nVerse 0:30\nChorus 1:00\n",
        "[1] The first note.\n[2] The second.\n",
        "{0}{1} are sets, and so is the rest.\nNothing else.\nNothing.\n",
        "tt and the other band",
        "At half time: 2:1, and then 3:1.",
        "",
    ],
)
def test_text_with_times_and_brackets_is_text(text, tmp_path):
    (tmp_path / "v.txt").write_text(text)
    assert read_written_words(tmp_path / "v.txt") is None
    assert not is_subtitle_file(tmp_path / "v.txt")


def test_texts_to_speak_are_never_subtitles(tmp_path):
    for name in ("v.md", "v.ssml", "v"):
        (tmp_path / name).write_text(SRT)
        assert read_written_words(tmp_path / name) is None


@pytest.mark.parametrize("name", ["v.txt", "v.srt"])
def test_lines_of_whisper_keep_their_times(name, tmp_path):
    (tmp_path / name).write_text(WHISPER)
    cues = read_subtitles(tmp_path / name).cues
    assert [(cue.begin_s, cue.end_s, cue.text) for cue in cues] == [(0.5, 2, "bin red by k"), (2, 3, "seven now")]


def test_words_after_an_instant_last_to_the_next(tmp_path):
    (tmp_path / "v.txt").write_text(PANEL)
    first, second, last = read_subtitles(tmp_path / "v.txt").cues
    assert (first.begin_s, first.end_s, second.begin_s, last.begin_s) == (0, 2, 2, 3605)
    assert last.has_estimated_end


def test_speakers_above_their_words_are_known(tmp_path):
    (tmp_path / "v.txt").write_text("Anna (0:03):\nbin red\n\nBen (0:05):\nby k\n\nAnna (0:09):\nseven\n")
    cues = read_subtitles(tmp_path / "v.txt").cues
    assert [(cue.begin_s, cue.speaker, cue.text) for cue in cues] == [
        (3, "Anna", "bin red"), (5, "Ben", "by k"), (9, "Anna", "seven"),
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["v.tsv", "v.txt"])
def test_the_table_of_whisper_has_milliseconds(name, tmp_path):
    (tmp_path / name).write_text(TSV)
    found = read_transcript(tmp_path / name)
    assert found.text == SAID
    assert (found.words[0].start, found.words[3].end, found.words[-1].end) == (0.5, 2.0, 3.0)
    assert found.notes[0].startswith(f"times of {name} are read as milliseconds: as seconds half of its words last")


@pytest.mark.parametrize(
    ("content", "start", "end"),
    [
        (TSV.replace("500\t2000", "0\t2").replace("2000\t3000", "2\t3"), 0.0, 3.0),
        ("0\t1500\tbin red by k\n1500\t2000\tseven now\n", 0.0, 2.0),
        ("Start Time\tEnd Time\tSpeaker\tText\n0.5\t2\tAnna\tbin red by k\n2\t3\tBen\tseven now\n", 0.5, 3.0),
        ("text\tstart\tend\nbin red by k\t0.5\t2\nseven now\t2\t3\n", 0.5, 3.0),
    ],
)
def test_columns_and_units_of_tables(content, start, end, tmp_path):
    (tmp_path / "v.tsv").write_text(content)
    found = read_transcript(tmp_path / "v.tsv")
    assert (found.text, found.words[0].start, found.words[-1].end) == (SAID, start, end)


def test_a_table_of_praat_has_tiers(tmp_path):
    (tmp_path / "v.txt").write_text(PRAAT_TABLE)
    assert read_transcript(tmp_path / "v.txt").text == SAID
    assert read_transcript(tmp_path / "v.txt", "phones").text == "b I n"


def test_words_beside_their_phones_are_said_once(tmp_path):
    rows = (("", "sil"), *(("very", phone) for phone in "veriveri"), ("go", "g"), ("go", "@U"))
    table = "phone\tstart\tend\tword\n" + "".join(
        f"{phone}\t{at / 10}\t{(at + 1) / 10}\t{word}\n" for at, (word, phone) in enumerate(rows)
    )
    (tmp_path / "v.tsv").write_text(table)
    found = read_transcript(tmp_path / "v.tsv")
    assert [(word.text, word.start, word.end) for word in found.words] == [
        ("very", 0.1, 0.5), ("very", 0.5, 0.9), ("go", 0.9, 1.1),
    ]  # fmt: skip
    assert "its tier 'words'; 'phones' is taken for phones or notes" in found.notes[0]
    (tmp_path / "v.tsv").write_text(table.replace("word", "note"))
    with pytest.raises(DataError, match="has no tier with words; 'phones' seems to hold phones"):
        read_transcript(tmp_path / "v.tsv")


def test_other_tables_are_no_transcripts(tmp_path):
    (tmp_path / "v.tsv").write_text("timecode\tjawOpen\n0\t0.5\n")
    assert read_written_words(tmp_path / "v.tsv") is None
    with pytest.raises(DataError, match="is no transcript with times"):
        read_transcript(tmp_path / "v.tsv")


def test_a_textgrid_of_any_name_has_tiers(tmp_path):
    (tmp_path / "v.praat").write_text(textgrid(words=WORDS))
    assert read_written_words(tmp_path / "v.praat", "words").text == SAID
