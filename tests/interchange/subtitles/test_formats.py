"""Formats beside the four with suites of damaged files, and tracks of films; what is no text is named truly."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import pytest

from lexicon.errors import DataError, InputError
from tests.interchange.subtitles.conftest import ReadText, srt
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.interchange.subtitles.reader import read_subtitles

pytestmark = pytest.mark.formats

BOTH = [(1.0, 3.0, "The train was late. Again."), (4.0, 6.0, "We walked home.")]
SAMI = """<SAMI><HEAD><STYLE TYPE="text/css"><!--
.ENCC { Name: English; lang: en-US; } .DECC { Name: Deutsch; lang: de-DE; }
--></STYLE></HEAD><BODY>
<SYNC Start=1000><P Class=ENCC>The train was late.<br>Again.<P Class=DECC>Der Zug.
<SYNC Start=3000><P Class=ENCC>&nbsp;<P Class=DECC>&nbsp;
<SYNC Start=4000><P Class=ENCC>We walked home.
<SYNC Start=6000><P Class=ENCC>&nbsp;</BODY></SAMI>
"""
READ = {
    "MicroDVD": (".sub", "{25}{75}The train was late.|Again.\n{100}{150}We walked home.\n"),
    "MicroDVD with its rate": (
        ".sub",
        "{1}{1}23.976\n{24}{72}{y:i}The train was late.|Again.\n{96}{144}We walked home.\n",
    ),
    "MicroDVD with slashes": (".sub", "{25}{75}/The train was late.|/Again.\n{100}{150}We walked home.\n"),
    "MicroDVD in another file": (".txt", "{25}{75}The train was late.|Again.\n{100}{150}We walked home.\n"),
    "MPL2": (".mpl", "[10][30]/The train was late.|Again.\n[40][60]We walked home.\n"),
    "SBV": (
        ".sbv",
        "0:00:01.000,0:00:03.000\nThe train was late.\nAgain.\n\n0:00:04.000,0:00:06.000\nWe walked home.\n",
    ),
    "SubViewer": (
        ".sub",
        "[INFORMATION]\n[TITLE]x\n[END INFORMATION]\n[SUBTITLE]\n00:00:01.00,00:00:03.00\n"
        "The train was late.[br]Again.\n\n00:00:04.00,00:00:06.00\nWe walked home.\n",
    ),
    "LRC": (
        ".lrc",
        "[ti:x]\n[00:01.00]The train was late. Again.\n[00:03.00]\n[00:04.00]We walked home.\n[00:06.00]\n",
    ),
    "LRC with an offset": (
        ".lrc",
        "[offset:+500]\n[00:01.50]The train was late. Again.\n[00:03.50]\n[00:04.50]We walked home.\n[00:06.50]\n",
    ),
    "LRC with times of words": (
        ".lrc",
        "[00:01.00]<00:01.00>The <00:01.40>train <00:01.80>was late. Again. <00:03.00>\n"
        "[00:04.00]<00:04.00>We walked <00:05.00>home. <00:06.00>\n",
    ),
    "SubViewer 1": (
        ".sub",
        "[TITLE]\nx\n[DELAY]\n0\n[BEGIN]\n******** START SCRIPT ********\n[00:00:01]\nThe train was late.|Again.\n"
        "[00:00:03]\n\n[00:00:04]\nWe walked home.\n[00:00:06]\n\n[END]\n******** END SCRIPT ********\n",
    ),
    "SubViewer 1 in another file": (
        ".txt",
        "[00:00:01]\nThe train was late.\nAgain.\n[00:00:03]\n[00:00:04]\nWe walked home.\n[00:00:06]\n",
    ),
    "TMPlayer": (
        ".txt",
        "00:00:01:The train was late.|Again.\n00:00:03:\n00:00:04:We walked home.\n00:00:06:\n",
    ),
    "TMPlayer with rows": (
        ".sub",
        "0:00:01,1=The train was late.\n0:00:01,2=Again.\n0:00:03,1=\n0:00:04,1=We walked home.\n0:00:06,1=\n",
    ),
    "TMPlayer with spaces": (
        ".srt",
        "00:00:01 The train was late.|Again.\n00:00:03 \n00:00:04 We walked home.\n00:00:06 \n",
    ),
    "timed text": (
        ".xml",
        '<?xml version="1.0" encoding="utf-8" ?>\n<timedtext format="3">\n<head><pen id="1"/></head>\n<body>\n'
        '<p t="1000" d="2000">The train was late.\nAgain.</p>\n<p t="4000" d="2000"><s p="1">We walked</s> home.</p>\n'
        "</body>\n</timedtext>\n",
    ),
    "timed text of a recogniser": (
        ".srv3",
        '<timedtext format="3"><body><w t="0" id="1"/>'
        '<p t="1000" d="2000" w="1"><s ac="248">The</s><s t="200"> train was late.</s><s t="800"> Again.</s></p>'
        '<p t="2500" d="1500" w="1" a="1">\n</p>'
        '<p t="4000" d="2000" w="1"><s>We</s><s t="300"> walked home.</s></p></body></timedtext>',
    ),
    "timed text of the first version": (
        ".srv1",
        '<?xml version="1.0" encoding="utf-8" ?><transcript><text start="1" dur="2">The train was late. &lt;i&gt;Again.'
        '&lt;/i&gt;</text><text start="4.0" dur="2.0">We walked home.</text></transcript>',
    ),
    "timed text of the second version": (
        ".srv2",
        '<timedtext><window t="0" id="1"/><text t="1000" d="2000" w="1">The train was late.\nAgain.</text>'
        '<text t="4000" d="2000" w="1">We walked home.</text></timedtext>',
    ),
    "timed text as JSON": (
        ".json3",
        '{"wireMagic": "pb3", "pens": [{}], "events": [\n{"tStartMs": 0, "dDurationMs": 9000, "id": 1},\n'
        '{"tStartMs": 1000, "dDurationMs": 2000, "wWinId": 1, "segs": [{"utf8": "The train was late."}, '
        '{"utf8": " Again.", "tOffsetMs": 300}]},\n{"tStartMs": 3000, "aAppend": 1, "segs": [{"utf8": "\\n"}]},\n'
        '{"tStartMs": 4000, "dDurationMs": 2000, "segs": [{"utf8": "We walked home."}]}]}',
    ),
    "SAMI": (".smi", SAMI),
    "SAMI in another file": (".txt", SAMI),
}


@pytest.mark.parametrize(("suffix", "content"), READ.values(), ids=READ)
def test_every_format_gives_the_same_cues(suffix: str, content: str, read: ReadText) -> None:
    found = read(content, suffix)
    assert [(round(cue.begin_s, 1), round(cue.end_s, 1), cue.text) for cue in found.cues] == BOTH


def test_the_rate_of_frames_is_the_stated_one_or_said(read: ReadText) -> None:
    content = "{25}{75}The train was late.\n{100}{150}We walked home.\n"
    assert "25 a second are taken (--subtitle-fps)" in read(content, ".sub").warnings[0].message
    found = read(content, ".sub", fps=50.0)
    assert [cue.begin_s for cue in found.cues] == [0.5, 2.0]
    assert not found.warnings


def test_a_line_of_several_instants_is_repeated(read: ReadText) -> None:
    found = read("[00:01.00][00:05.00]So it goes\n[00:03.00]and so\n", ".lrc")
    assert [(cue.begin_s, cue.text) for cue in found.cues] == [(1, "So it goes"), (3, "and so"), (5, "So it goes")]


def test_a_class_of_sami_is_chosen_and_said(read: ReadText) -> None:
    found = read(SAMI, ".smi")
    assert "--track names another one" in found.warnings[0].message
    assert [cue.language for cue in found.cues] == ["en-US", "en-US"]
    assert [cue.text for cue in read(SAMI, ".smi", track="DECC").cues] == ["Der Zug."]
    assert [cue.text for cue in read(SAMI, ".smi", language="de").cues] == ["Der Zug."]
    with pytest.raises(InputError, match="there is no class 'FRCC'"):
        read(SAMI, ".smi", track="FRCC")


def test_windows_of_timed_text_that_roll_end_where_the_next_begins(read: ReadText) -> None:
    content = (
        '<timedtext format="3"><body><p t="100" d="4000"><s ac="0">we</s><s t="240"> don&amp;#39;t</s></p>'
        '<p t="2100" d="3900"><s>know</s></p><p t="9000"><s>bye</s></p><p d="5">lost</p></body></timedtext>'
    )
    found = read(content, ".xml")
    assert [(cue.begin_s, cue.end_s, cue.text) for cue in found.cues] == [
        (0.1, 2.1, "we don't"), (2.1, 6.0, "know"), (9.0, 10.0, "bye")
    ]  # fmt: skip
    assert [warning.message for warning in found.warnings] == ["the start of this cue cannot be read; it is left out"]


def test_timed_text_that_ends_in_the_middle_is_read_up_to_there(read: ReadText) -> None:
    found = read('<timedtext format="3"><body>\n<p t="1000" d="2000">Hello.</p>\n<p t="30', ".xml")
    assert [cue.text for cue in found.cues] == ["Hello."]
    assert "what follows is left out" in found.warnings[0].message


def test_events_without_a_start_are_said_with_their_lines(read: ReadText) -> None:
    content = (
        '{"events": [\n{"tStartMs": 1000, "dDurationMs": 1500, "segs": [{"utf8": "Hello."}]},\n'
        '{"tStartMs": "x", "segs": [{"utf8": "Lost."}]},\n{"tStartMs": 4000, "segs": [{"utf8": "Bye."}]}]}'
    )
    found = read(content, ".json3")
    assert [(cue.begin_s, cue.end_s, cue.text, cue.line) for cue in found.cues] == [
        (1.0, 2.5, "Hello.", 2), (4.0, 5.0, "Bye.", 4)
    ]  # fmt: skip
    assert [warning.line for warning in found.warnings] == [3]


def test_lines_without_instants_and_a_delay_are_said(read: ReadText) -> None:
    lines = [f"00:00:0{at}:Go." for at in range(1, 9)]
    found = read("\n".join([*lines, "Nothing."]), ".txt")
    assert [warning.message for warning in found.warnings] == ["this line has no times; it is left out"]
    found = read("[DELAY]\n5\n[BEGIN]\n[00:00:01]\nGo.\n[00:00:03]\nStop.\n[00:00:04]\n", ".sub")
    assert [(cue.begin_s, cue.end_s) for cue in found.cues] == [(1, 3), (3, 4)]
    assert "a delay of 5, which is not used; --shift" in found.warnings[0].message


def write_film(path: Path, content: Path, languages: Sequence[str]) -> Path:
    """A film without pictures, with a track of subtitles for each language."""
    with av.open(str(path), "w") as film, av.open(str(content)) as subtitles:
        source = subtitles.streams.subtitles[0]
        tracks = [film.add_stream_from_template(source) for _ in languages]
        for track, language in zip(tracks, languages, strict=True):
            track.metadata["language"] = language
        for packet in subtitles.demux(source):
            for track in tracks if packet.size else ():
                copied = av.Packet(bytes(packet))
                copied.pts, copied.dts, copied.duration = packet.pts, packet.dts, packet.duration
                copied.time_base, copied.stream = packet.time_base, track
                film.mux(copied)
    return path


HEADER = (
    b"[Script Info]\r\n\r\n[V4+ Styles]\r\nFormat: Name, Fontname, Fontsize, PrimaryColour, SecondaryColour, "
    b"OutlineColour, "
    b"BackColour, Bold, Italic, Underline, StrikeOut, ScaleX, ScaleY, Spacing, Angle, BorderStyle, Outline, Shadow, "
    b"Alignment, MarginL, MarginR, MarginV, Encoding\r\nStyle: Default,Arial,16,&Hffffff,&Hffffff,&H0,&H0,0,0,0,0,100,"
    b"100,0,0,1,1,0,2,10,10,10,1\r\n\r\n[Events]\r\nFormat: Layer, Start, End, Style, Name, MarginL, MarginR, MarginV, "
    b"Effect, Text\r\n"
)


def write_mp4(path: Path) -> Path:
    """A film with a track of timed text, which needs a header of SubStation Alpha to be opened."""
    with av.open(str(path), "w") as film:
        track = film.add_stream("mov_text")
        track.codec_context.subtitle_header = HEADER
        track.time_base = track.codec_context.time_base = Fraction(1, 1000)
        for at, text in ((1000, b"The train was late.\nAgain."), (4000, b"We walked home.")):
            packet = av.Packet(len(text).to_bytes(2, "big") + text)
            packet.pts = packet.dts = at
            packet.duration, packet.time_base, packet.stream = 2000, Fraction(1, 1000), track
            film.mux(packet)
    return path


@pytest.mark.parametrize("suffix", [".srt", ".ass", ".vtt"])
def test_the_track_of_a_film_is_read(suffix: str, tmp_path: Path) -> None:
    content = srt(*((begin, end, text.replace(". ", ".\n")) for begin, end, text in BOTH))
    if suffix == ".vtt":
        content = "WEBVTT\n\n" + content.replace(",000", ".000")
    if suffix == ".ass":
        content = HEADER.decode() + "".join(
            f"Dialogue: 0,0:00:0{begin:.2f},0:00:0{end:.2f},Default,Ann,0,0,0,,{text}\r\n" for begin, end, text in BOTH
        )
    written = tmp_path / f"a{suffix}"
    written.write_text(content)
    found = read_subtitles(write_film(tmp_path / "a.mkv", written, ["eng"]))
    assert [(cue.begin_s, cue.end_s, cue.text) for cue in found.cues] == BOTH
    assert [cue.speaker for cue in found.cues] == ["Ann" if suffix == ".ass" else ""] * 2
    assert not found.warnings


def test_the_track_of_an_mp4_is_read(tmp_path: Path) -> None:
    found = read_subtitles(write_mp4(tmp_path / "a.mp4"))
    assert [(cue.begin_s, cue.end_s, cue.text) for cue in found.cues] == BOTH


def test_a_track_is_chosen_by_number_and_language_and_said(tmp_path: Path) -> None:
    (tmp_path / "a.srt").write_text(srt(*BOTH))
    film = write_film(tmp_path / "a.mkv", tmp_path / "a.srt", ["eng", "ger"])
    shown = "the film has the tracks 1 (eng, srt), 2 (ger, srt); track"
    for choices, number in (
        ({}, 1),
        ({"language": "de"}, 2),
        ({"track": "2"}, 2),
        ({"track": "de"}, 2),
        ({"track": "eng"}, 1),
    ):
        found = read_subtitles(film, None, SubtitleOptions(**choices))  # type: ignore[arg-type]
        assert found.warnings[0].message == f"{shown} {number} is read, --track names another one"
    with pytest.raises(InputError, match="there is no track 'fr' of text"):
        read_subtitles(film, None, SubtitleOptions(track="fr"))


def ebu(
    *blocks: tuple[tuple[int, ...], tuple[int, ...], bytes], table: bytes = b"00", start: bytes = b"00000000"
) -> bytes:
    """EBU STL at 25 frames a second of time codes (hours, minutes, seconds, frames) and texts."""
    general = bytearray(b" " * 1024)
    general[0:14] = b"850STL25.011" + table
    general[256:264] = start
    content = bytes(general)
    for number, (begins, ends, text) in enumerate(blocks):
        field = text.ljust(112, b"\x8f")
        content += bytes([0, number, 0, 0xFF, 0, *begins, *ends, 20, 2, 0]) + field
    return content


def test_ebu_stl_is_read_from_the_start_of_its_programme(read: ReadText) -> None:
    content = ebu(
        ((10, 0, 1, 0), (10, 0, 3, 0), b"\x0b\x0bThe train was late.\x8aAgain.\x0a\x0a"),
        ((10, 0, 4, 0), (10, 0, 5, 12), b"\x80D\xc2ej\xc8a vu\x81 \xfb \xa3"),
        start=b"10000000",
    )
    found = read(content, ".stl")
    assert [(round(cue.begin_s, 3), round(cue.end_s, 3), cue.text) for cue in found.cues] == [
        (1.0, 3.0, "The train was late. Again."),
        (4.0, 5.48, "Déjä vu ß £"),
    ]
    assert [warning.message for warning in found.warnings] == [
        "the programme begins at 36000.00 s, as the file states; that is taken off"
    ]


def test_ebu_stl_of_other_alphabets_its_comments_and_its_long_texts(read: ReadText) -> None:
    cyrillic = ebu(((0, 0, 1, 0), (0, 0, 3, 0), "Поезд опоздал.".encode("iso8859-5")), table=b"01")
    assert read(cyrillic, ".stl").cues[0].text == "Поезд опоздал."
    content = bytearray(ebu(((0, 0, 1, 0), (0, 0, 3, 0), b"one"), ((0, 0, 1, 0), (0, 0, 3, 0), b" two")))
    content[1024 + 3] = 0  # the text goes on in the next block
    assert [cue.text for cue in read(bytes(content), ".stl").cues] == ["one two"]
    content = bytearray(ebu(((0, 0, 1, 0), (0, 0, 3, 0), b"one"), ((0, 0, 4, 0), (0, 0, 5, 0), b"a comment")))
    content[1024 + 128 + 15] = 1
    assert [cue.text for cue in read(bytes(content), ".stl").cues] == ["one"]
    with pytest.raises(DataError, match="is EBU STL without subtitles"):
        read(ebu(), ".stl")


NO_TEXT = {
    "pictures of a Blu-ray": (".sup", b"PG" + bytes(8) + b"\x16" + bytes(200), "holds pictures of subtitles, no text"),
    "pictures of a DVD": (".sub", b"\x00\x00\x01\xba" + bytes(200), "holds pictures of subtitles, no text"),
    "the index of pictures": (".idx", b"# VobSub index file, v7\n", "is the index of pictures of subtitles"),
    "an archive": (".srt", b"PK\x03\x04" + bytes(200), "is a ZIP archive"),
    "a damaged film": (".mp4", b"\x00\x00\x00\x18ftypisom" + bytes(200), "cannot be read as a film"),
    "JSON without captions": (".json3", b'{"wireMagic": "pb3", "events": 1}', "the JSON has no list of events"),
    "another XML": (".xml", b"<fcpxml><spine/></fcpxml>", "line 1: the file is XML of <fcpxml>, of which no subtitles"),
    "clocks with frames": (".stl", b"00:00:01:12 , 00:00:03:00 , Hi.\n" * 3, "no subtitles of a format that is read"),
    "two clocks": (".txt", b"00:00:01 00:00:03 Hi.\n" * 3, "no subtitles of a format that is read"),
    "other text": (".srt", b"Nothing here.\n", r"contains no subtitles of a format that is read \(SubRip, WebVTT"),
}


@pytest.mark.parametrize(("suffix", "content", "reason"), NO_TEXT.values(), ids=NO_TEXT)
def test_what_holds_no_subtitles_of_text_is_named(suffix: str, content: bytes, reason: str, read: ReadText) -> None:
    with pytest.raises(DataError, match=reason):
        read(content, suffix)


def test_a_film_without_a_track_is_named(tmp_path: Path) -> None:
    with av.open(str(tmp_path / "a.mkv"), "w") as film:
        track = film.add_stream("pcm_s16le", rate=8000)
        frame = av.AudioFrame(format="s16", layout="mono", samples=800)
        frame.rate, frame.pts = 8000, 0
        film.mux(track.encode(frame))
    with pytest.raises(DataError, match="is a film without a track of subtitles"):
        read_subtitles(tmp_path / "a.mkv")
