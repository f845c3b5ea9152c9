"""Subtitles of videos: each cue becomes a recording of a part of a video."""

from pathlib import Path

import pytest

from corpus_tools.recordings.folder import Recording, find_recordings
from corpus_tools.recordings.observe import group_by_video, observe
from corpus_tools.recordings.subtitle_cues import read_cues
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError
from tests.corpus_tools.films import join_clips
from tests.rendered_takes import manifest_rows

SRT = "1\n00:00:01,000 --> 00:00:02,000\n<i>Hello</i>\nthere.\n\n2\n00:00:02,100 --> 00:00:03,500\nIt is £5.\n"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.srt", SRT.encode()),
        ("a.srt", b"\xef\xbb\xbf" + SRT.encode()),
        ("a.srt", SRT.replace("\n", "\r\n").encode("cp1252")),
        ("a.vtt", b"WEBVTT\n\n" + SRT.replace(",", ".").encode()),
    ],
)
def test_cues_are_read_and_widened_up_to_their_neighbours(name: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    first, second = read_cues(path)
    assert first.text == "Hello there."
    assert second.text == "It is £5."
    assert (first.start, first.end) == pytest.approx((0.7, 2.05))
    assert (second.start, second.end) == pytest.approx((2.05, 3.8))


@pytest.mark.parametrize(
    ("shown", "spoken"),
    [
        ("[door slams] Come in.", "Come in."),
        ("(door slams) No.", "No."),
        ("MRS. O'NEIL: Good evening.", "Good evening."),
        ("- Who is it?\n- Me.", "Who is it? Me."),
        ("♪ La la la ♪\nStop it.", "Stop it."),
        ("At 10:30, they said: go.", "At 10:30, they said: go."),
        ("{\\an8}Up here.", "Up here."),
    ],
)
def test_only_spoken_words_of_a_cue_are_kept(shown: str, spoken: str, tmp_path: Path) -> None:
    path = tmp_path / "a.srt"
    path.write_text(f"1\n00:00:01,000 --> 00:00:03,000\n{shown}\n", encoding="utf-8")
    assert [cue.text for cue in read_cues(path)] == [spoken]


def test_subtitles_with_sound_descriptions_only_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.srt"
    path.write_text("1\n00:00:01,000 --> 00:00:03,000\n[music]\n", encoding="utf-8")
    with pytest.raises(DataError, match="contains no subtitles"):
        read_cues(path)


@pytest.mark.parametrize("content", [b"", b"no subtitles at all", b"\x00\xff\xfe\x01" * 50])
def test_a_file_without_subtitles_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.srt"
    path.write_bytes(content)
    with pytest.raises(
        DataError,
        match=r"no subtitles of a format that is read \(SubRip, .*\); convert it|save it as UTF-8",
    ):
        read_cues(path)


def test_a_video_with_subtitles_is_a_recording_for_each_cue(tmp_path: Path) -> None:
    (tmp_path / "talk.mp4").write_bytes(b"")
    (tmp_path / "talk.srt").write_text(SRT, encoding="utf-8")
    found = find_recordings(tmp_path)
    assert [one.name for one in found] == ["talk-0001", "talk-0002"]
    assert found[0].span == pytest.approx((0.7, 2.05))
    assert find_recordings(tmp_path / "talk.mp4") == found
    assert group_by_video([*found, Recording("x", tmp_path / "x.mp4", "A.")])[0].recordings == found


def test_one_long_video_with_subtitles_gives_what_its_parts_gave(takes: Path, face_model: Path, tmp_path: Path) -> None:
    rows = manifest_rows(takes)[:3]
    clips = [takes / "clips" / f"{row['clip']}.mkv" for row in rows]
    (tmp_path / "long").mkdir()
    spans = join_clips(clips, tmp_path / "long" / "talk.mp4")
    lines = []
    for number, (row, (begin, _)) in enumerate(zip(rows, spans, strict=True), start=1):
        start, end = begin + float(row["speech_start_s"]), begin + float(row["speech_end_s"])
        lines += [str(number), f"00:00:{start:06.3f} --> 00:00:{end:06.3f}".replace(".", ","), row["transcript"], ""]
    (tmp_path / "long" / "talk.srt").write_text("\n".join(lines), encoding="utf-8")
    run_options = RunOptions(tmp_path / "cache", 1, face_model)
    cut = observe(tmp_path / "long", run_options=run_options)
    assert not cut.refused
    assert [one.name for one in cut.kept] == ["talk-0001", "talk-0002", "talk-0003"]
    for one, row, (begin, _) in zip(cut.kept, rows, spans, strict=True):
        said = [word.text for word in one.words]
        assert len(said) == len(row["transcript"].split())
        onset = begin + float(row["speech_start_s"])
        first = one.quality.cut + one.phones.edges[one.words[0].first]
        assert abs(first - onset) < 0.25
        assert len(one.landmarks) == len(one.intensity) >= 25
