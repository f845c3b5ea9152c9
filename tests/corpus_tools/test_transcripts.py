"""Transcripts of every kind, whole and damaged."""

import contextlib

import av
import numpy as np
import pytest

from corpus_tools.recordings.folder import find_recordings, pronounce_recording, recording_notes
from corpus_tools.recordings.observe import recordings_to_check
from corpus_tools.recordings.subtitle_cues import find_subtitles, read_cues, subtitle_notes
from corpus_tools.recordings.transcripts import read_transcript
from lexicon.errors import DataError
from tts2face.interchange.subtitles.decoding import MAX_BYTES, read_text
from tts2face.interchange.transcripts.beside import find_transcript
from tts2face.interchange.transcripts.reader import READERS
from tts2face.interchange.transcripts.reader import read_transcript as read_timed
from tts2face.interchange.transcripts.spoken import SpokenCue

SRT = """1
00:00:01,000 --> 00:00:02,500
<i>Place blue</i>
at F two

2
00:01:00,250 --> 00:01:01,000
[door slams]

3
00:01:02,000 --> 00:01:03,000
ANNA: now – café
"""
VTT = """WEBVTT

00:01.000 --> 00:02.500
Place blue

NOTE nothing

01:02:03.000 --> 01:02:04.000
again
"""
LONG_GRID = """File type = "ooTextFile"
Object class = "TextGrid"

xmin = 0
xmax = 2.5
tiers? <exists>
size = 2
item []:
    item [1]:
        class = "IntervalTier"
        name = "phones"
        xmin = 0
        xmax = 2.5
        intervals: size = 1
        intervals [1]:
            xmin = 0
            xmax = 2.5
            text = "b"
    item [2]:
        class = "IntervalTier"
        name = "words"
        xmin = 0
        xmax = 2.5
        intervals: size = 3
        intervals [1]:
            xmin = 0
            xmax = 0.5
            text = ""
        intervals [2]:
            xmin = 0.5
            xmax = 1.25
            text = "say ""hi"" [2]"
        intervals [3]:
            xmin = 1.25
            xmax = 2.5
            text = "sp"
"""
SHORT_GRID = 'File type = "ooTextFile"\n"TextGrid"\n\n0\n2.5\n<exists>\n2\n"TextTier"\n"beeps"\n0\n2.5\n1\n0.5\n"x"\n'
SHORT_GRID += '"IntervalTier"\n"said"\n0\n2.5\n1\n0.5\n2\n"blue"\n'
ALIGN = "0 23750 sil\n23750 29500 bin\n29500 34000 blue\n34000 70000 sil\n"
WHOLE = {".srt": SRT, ".vtt": VTT, ".TextGrid": LONG_GRID, ".align": ALIGN}


@pytest.fixture
def write(tmp_path):
    def written(suffix, content, encoding="utf-8"):
        path = tmp_path / f"take{suffix}"
        path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
        return path

    return written


def cues_of(path):
    return read_timed(path).words if path.suffix.lower() in READERS else read_cues(path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32", "cp1252"])
def test_every_encoding_gives_the_same_text(write, encoding):
    assert [cue.text for cue in read_cues(write(".srt", SRT, encoding))][-1] == "now – café"


@pytest.mark.parametrize("header", ["WEBVTT\n\n", "\ufeffWEBVTT\n\n", ""])
def test_vtt_keeps_its_first_cue_with_and_without_header(write, header):
    cues = cues_of(write(".vtt", VTT.replace("WEBVTT\n\n", header)))
    assert [cue.text for cue in cues] == ["Place blue", "again"]
    assert cues[1].start < 3723.0 < cues[1].end


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_long_textgrid_gives_its_tier_of_words(write, encoding):
    assert cues_of(write(".TextGrid", LONG_GRID, encoding)) == (
        SpokenCue(0.5, pytest.approx(0.875, abs=1e-3), "say"),
        SpokenCue(pytest.approx(0.875, abs=1e-3), 1.25, '"hi"'),
    )


def test_a_short_textgrid_without_a_tier_of_words_gives_its_first_intervals(write):
    assert cues_of(write(".TextGrid", SHORT_GRID)) == (SpokenCue(0.5, 2.0, "blue"),)


def test_word_times_are_samples_of_25_khz(write):
    assert cues_of(write(".align", ALIGN)) == (SpokenCue(0.95, 1.18, "bin"), SpokenCue(1.18, 1.36, "blue"))


@pytest.mark.parametrize(("rate", "unit"), [(1000, "milliseconds"), (10_000_000, "units of 100 ns")])
def test_word_times_of_another_unit_are_read_right_and_said(write, rate, unit):
    words = ((0.95, 1.18, "bin"), (1.18, 1.36, "blue"), (1.36, 1.6, "at"))
    path = write(".align", "".join(f"{round(a * rate)} {round(b * rate)} {word}\n" for a, b, word in words))
    assert cues_of(path) == tuple(SpokenCue(*word) for word in words)
    assert f"are read as {unit}" in read_transcript(path).notes[0]


def test_word_times_that_cannot_be_meant_are_refused(write):
    with pytest.raises(DataError, match=r"no samples of 25 kHz: half of its words would last 4e-05 s"):
        read_transcript(write(".align", "1 2 bin\n2 3 blue\n"))


def test_all_grid_alignments_agree_with_the_manifest(takes):
    listed = {one.name: one.transcript for one in find_recordings(takes)}
    aligned = {path.stem: read_transcript(path).text for path in sorted((takes / "align").glob("*.align"))}
    assert aligned
    assert aligned == {name: listed[name] for name in aligned}


def test_words_without_a_length_belong_to_the_next_cue(write):
    content = "".join(
        f"{number}\n00:00:0{start} --> 00:00:0{end}\n{word}\n\n"
        for number, (start, end, word) in enumerate(
            [
                ("1,000", "1,500", "come"),
                ("1,500", "1,500", "with"),
                ("1,500", "2,000", "me"),
                ("5,000", "5,000", "so"),
            ],
            1,
        )
    )
    assert [cue.text for cue in read_cues(write(".srt", content))] == ["come", "with me"]


def test_frames_have_the_rate_of_the_video(write, tmp_path):
    with av.open(str(tmp_path / "take.mp4"), "w") as film:
        track = film.add_stream("mpeg4", rate=50)
        track.width, track.height, track.pix_fmt = 32, 32, "yuv420p"
        for _ in range(200):
            film.mux(track.encode(av.VideoFrame(32, 32, "yuv420p")))
        film.mux(track.encode())
    path = write(".sub", "{50}{100}place blue\n{150}{190}again\n")
    assert [(cue.start, cue.text) for cue in read_cues(path)] == [(0.7, "place blue"), (2.7, "again")]
    assert find_subtitles(tmp_path / "take.mp4") == path
    assert subtitle_notes(tmp_path / "take.mp4") == ()


def test_the_track_of_a_video_without_a_transcript_is_read(tmp_path):
    (tmp_path / "a.srt").write_text("1\n00:00:01,000 --> 00:00:02,000\nPlace blue.\n")
    with av.open(str(tmp_path / "take.mkv"), "w") as film, av.open(str(tmp_path / "a.srt")) as subtitles:
        (source,) = subtitles.streams.subtitles
        track = film.add_stream_from_template(source)
        for packet in subtitles.demux(source):
            if packet.size:
                packet.stream = track
                film.mux(packet)
    (recording,) = find_recordings(tmp_path)
    assert (recording.name, recording.transcript) == ("take-0001", "Place blue.")
    assert "the subtitles of take.mkv are those of its own track" in recording_notes([recording])
    (tmp_path / "take.txt").write_text("set red")
    (recording,) = find_recordings(tmp_path)
    assert recording.transcript == tmp_path / "take.txt"


def test_guesses_about_subtitles_are_said(write, tmp_path):
    (tmp_path / "take.mp4").touch()
    write(".srt", "1\n00:00:01,000 --> 00:00:02,000\nMůžete přijít\n".encode("cp1250"))
    (note,) = subtitle_notes(tmp_path / "take.mp4")
    assert note == "take.srt, line 1: the encoding is not stated and was guessed as cp1250; save it as UTF-8"


def test_notes_about_subtitles_name_no_option_of_batches(write, tmp_path):
    (tmp_path / "take.mp4").touch()
    cues = ("10:00:01,000 --> 10:00:02,000\nANNA: Hi. [a bell]", "10:00:03,000 --> 10:00:04,000\n♪ la ♪ Bye.")
    write(".srt", "\n\n".join(cues))
    notes = subtitle_notes(tmp_path / "take.mp4")
    assert len(notes) == 4
    assert not any("--" in note for note in notes)


def test_text_takes_precedence_over_other_transcripts(write, tmp_path):
    write(".align", ALIGN)
    assert find_transcript(tmp_path / "take.mp4") == tmp_path / "take.align"
    write(".TXT", "words")
    assert find_transcript(tmp_path / "take.mp4") == tmp_path / "take.TXT"


def test_what_lies_beside_a_video_and_is_not_read_is_named(write, tmp_path):
    for name in ("take.mp4", "other.mp4", "take.xyz", "take.en.srt", "alone.eaf", "other.TextGrid"):
        (tmp_path / name).touch()
    write(".txt", "bin blue")
    (tmp_path / "other.TextGrid").write_text(LONG_GRID)
    first, *_, second = recording_notes(find_recordings(tmp_path))
    assert first.startswith("the words of other.TextGrid are those of its tier 'words'")
    assert second.startswith("take.en.srt, take.xyz lie beside videos and are not read; transcripts are read from one")
    (tmp_path / "take.xyz").unlink()
    (tmp_path / "take.en.srt").unlink()
    assert recording_notes(find_recordings(tmp_path))[0] == first
    assert not any("not read" in note for note in recording_notes(find_recordings(tmp_path)))


@pytest.mark.parametrize(("suffix", "content"), [(".txt", "Můžete přijít"), (".ctm", "take 1 0.5 0.5 můžete\n")])
def test_a_guessed_encoding_of_words_is_said(write, suffix, content):
    (note,) = read_transcript(write(suffix, content, "cp1250")).notes
    assert note.startswith(f"the encoding of take{suffix} is not stated and was guessed as ")
    assert read_transcript(write(suffix, content)).notes == ()


def test_subtitles_and_tables_of_any_name_have_their_times(write, tmp_path):
    (tmp_path / "take.mp4").touch()
    path = write(".txt", SRT)
    recordings = find_recordings(tmp_path)
    assert [recording.transcript for recording in recordings] == ["Place blue at F two", "now – café"]
    assert recordings[1].span[0] > 60.0
    notes = recording_notes(recordings)
    assert notes[0] == "take.txt holds subtitles by its lines, whose times are not words"
    assert not any("is not read" in note for note in notes)
    path.unlink()
    write(".tsv", "start\tend\ttext\n0\t1500\tplace blue\n")
    (recording,) = find_recordings(tmp_path)
    assert [word for word, _ in pronounce_recording(recording)] == ["place", "blue"]
    write(".tsv", "time\tjawOpen\n0\t0.1\n")
    write(".rec", b"\x47\x00\x00" * 99)
    (recording,) = find_recordings(tmp_path)
    assert recording.transcript is None
    assert recording_notes([recording])[0].startswith("take.rec, take.tsv lie beside videos and are not read")


def test_a_tier_is_named_for_all_recordings(tmp_path):
    (tmp_path / "take.mp4").touch()
    (tmp_path / "take.TextGrid").write_text(LONG_GRID)
    (recording,) = find_recordings(tmp_path, "phones")
    assert [word for word, _ in pronounce_recording(recording)] == ["b"]


def test_a_text_in_place_of_a_file_leaves_it_unread_and_cues_do_not(write, tmp_path):
    (tmp_path / "take.mp4").touch()
    write(".srt", SRT)
    assert not any("not read" in note for note in recording_notes(find_recordings(tmp_path)))
    (instead,) = recordings_to_check(tmp_path / "take.mp4", "bin blue")
    (note,) = recording_notes([instead])
    assert note.startswith("take.srt lies beside a video and is not read")


def test_a_table_of_labels_is_not_read_aloud(write, tmp_path):
    (tmp_path / "take.mp4").touch()
    write(".txt", "0.350000\t0.620000\tbin\n0.620000\t0.840000\tred\n")
    (recording,) = find_recordings(tmp_path)
    assert [word for word, _ in pronounce_recording(recording)] == ["bin", "red"]


def test_damaged_subtitles_refuse_their_video_alone(write, tmp_path):
    write(".srt", "Nothing here")
    (tmp_path / "take.mp4").touch()
    (tmp_path / "whole.mp4").touch()
    (tmp_path / "whole.TextGrid").write_text(LONG_GRID)
    broken, whole = find_recordings(tmp_path)
    assert [word for word, _ in pronounce_recording(whole)] == ["say", "hi"]
    with pytest.raises(DataError, match="contains no subtitles"):
        pronounce_recording(broken)


@pytest.mark.parametrize(
    ("suffix", "content", "reason"),
    [
        (".txt", b"\x00\x01\x02" * 9, "contains zero bytes"),
        (".txt", b"\x81\xfe", "is not text in UTF-8"),
        (".txt", b"a" * (MAX_BYTES + 1), "is larger than 8 MiB"),
        (".srt", "Nothing here", "contains no subtitles"),
        (".TextGrid", "hello", "is not a TextGrid"),
        (".TextGrid", LONG_GRID[:-30], "is a damaged TextGrid"),
        (".TextGrid", LONG_GRID.replace('say ""hi"" [2]', ""), "has no tier with words; 'phones' seems"),
        (".align", "0 x bin", "line 1: '0 x bin' is not start, end and word"),
        (".align", "0 100 sil", "contains no word"),
    ],
)
def test_what_cannot_be_read_is_refused(write, suffix, content, reason):
    with pytest.raises(DataError, match=reason):
        read_transcript(write(suffix, content))


def test_a_file_that_vanished(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_text(tmp_path / "none.txt")


@pytest.mark.parametrize("suffix", WHOLE)
def test_damage_is_read_or_refused(write, suffix):
    generator = np.random.default_rng(5)
    whole = np.frombuffer(WHOLE[suffix].encode(), np.uint8)
    for _ in range(150):
        damaged = whole[: generator.integers(1, len(whole) + 1)].copy()
        for at in generator.integers(0, len(damaged), generator.integers(0, 6)):
            damaged[at] = generator.integers(0, 256)
        with contextlib.suppress(DataError):
            assert cues_of(write(suffix, damaged.tobytes()))
