"""Subtitle files as people have them: damaged in many ways, read as players do, with the lines of their defects."""

import time
from pathlib import Path

import pysubs2
import pytest

from lexicon.errors import DataError, InputError
from tts2face.interchange.subtitles.cues import without_options
from tts2face.interchange.subtitles.reader import read_subtitles

pytestmark = pytest.mark.formats

A, B = "00:00:01,000 --> 00:00:02,000", "00:00:03,000 --> 00:00:04,500"
HI, BYE = (1.0, 2.0, "Hi."), (3.0, 4.5, "Bye.")
BOTH = [HI, BYE]

# name: content, cues (begin, end, words), lines of the warnings
SRT: dict[str, tuple[str, list[tuple[float, float, str]], list[int]]] = {
    "good": (f"1\n{A}\nHi.\n\n2\n{B}\nBye.\n", BOTH, []),
    "no blank line": (f"1\n{A}\nHi.\n2\n{B}\nBye.\n", BOTH, [5]),
    "no numbers": (f"{A}\nHi.\n\n{B}\nBye.\n", BOTH, []),
    "no numbers and no blank lines": (f"{A}\nHi.\n{B}\nBye.\n", BOTH, [3]),
    "wrong numbers": (f"7\n{A}\nHi.\n\n7\n{B}\nBye.\n", BOTH, []),
    "many blank lines": (f"\n\n\n1\n\n{A}\n\nHi.\n\n\n\n2\n{B}\nBye.\n\n\n", BOTH, []),
    "blank line in a cue": (f"1\n{A}\nHi.\n\nAgain.\n\n2\n{B}\nBye.\n", [(1.0, 2.0, "Hi. Again."), BYE], []),
    "a number is the words": (f"1\n{A}\n42\n\n2\n{B}\nBye.\n", [(1.0, 2.0, "42"), BYE], []),
    "points and full-width arrows": ("1\n00:00:01.000 → 00:00:02.000\nHi.\n\n2\n00:00:03.000 -> 00:00:04.500\nBye.\n",
                                     BOTH, []),
    "spaces in times": ("1\n00: 00: 01, 000 --> 00: 00: 02, 000\nHi.\n\n2\n" + B + "\nBye.\n", BOTH, []),
    "no hours, short fractions": ("1\n00:01,0 --> 00:02\nHi.\n\n2\n0:0:3,0-->0:0:4,5\nBye.\n", BOTH, []),
    "coordinates after the times": (f"1\n{A}  X1:100 X2:200 Y1:1 Y2:2\nHi.\n\n2\n{B}\nBye.\n", BOTH, []),
    "end before begin": (f"1\n00:00:01,000 --> 00:00:00,500\nHi.\n\n2\n{B}\nBye.\n", [HI, BYE], [2]),
    "end is missing": (f"1\n00:00:01,000 -->\nHi.\n\n2\n{B}\nBye.\n", [HI, BYE], [2]),
    "end is no time": (f"1\n00:00:01,000 --> soon\nHi.\n\n2\n{B}\nBye.\n", [HI, BYE], [2]),
    "begin is no time": (f"1\nx --> 00:00:02,000\nHi.\n\n2\n{B}\nBye.\n", [BYE], [2]),
    "cues out of order": (f"2\n{B}\nBye.\n\n1\n{A}\nHi.\n", BOTH, [6]),
    "overlap": (f"1\n00:00:01,000 --> 00:00:03,500\nHi.\n\n2\n{B}\nBye.\n", [(1.0, 3.5, "Hi."), BYE], [2]),
    "the same cue twice": (f"1\n{A}\nHi.\n\n2\n{A}\nHi.\n\n3\n{B}\nBye.\n", BOTH, [6]),
    "negative time": (f"1\n-00:00:01,000 --> 00:00:02,000\nHi.\n\n2\n{B}\nBye.\n", [(0.0, 2.0, "Hi."), BYE], [2]),
    "a damaged huge time": (f"1\n99999:00:01,000 --> 99999:00:02,000\nHi.\n\n2\n{B}\nBye.\n", [BYE], [2]),
    "empty cue": (f"1\n{A}\n\n2\n{B}\nBye.\n", [(1.0, 2.0, ""), BYE], []),
    "tags that are not closed": (f"1\n{A}\n<i><b>Hi.</b>\n\n2\n{B}\n<font color=\"#fff\">Bye.<i\n", BOTH, []),
    "overrides": (f"1\n{A}\n{{\\an8}}{{\\pos(1,2)}}Hi.\n\n2\n{B}\nBye.\n", BOTH, []),
    "entities and invisible characters": (f"1\n{A}\n\u200eHi&nbsp;&amp;\u00a0all.\u200b\n\n2\n{B}\nBye.\n",
                                          [(1.0, 2.0, "Hi & all."), BYE], []),
    "a file that ends in the middle": (f"1\n{A}\nHi.\n\n2\n00:00:03,0", [(1.0, 2.0, "Hi. 2 00:00:03,0")], []),
    "an arrow in the words": (f"1\n{A}\nA -> b.\n\n2\n{B}\nBye.\n", [(1.0, 2.0, "A -> b."), BYE], []),
    "a player's advertisement before the first cue": (f"Subtitles by x\n\n1\n{A}\nHi.\n\n2\n{B}\nBye.\n", BOTH, []),
}  # fmt: skip

VA, VB = A.replace(",", "."), B.replace(",", ".")
VTT: dict[str, tuple[str, list[tuple[float, float, str]], list[int]]] = {
    "good": (f"WEBVTT\n\n{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, []),
    "no header": (f"{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, [1]),
    "header with text": (f"WEBVTT - A film\nKind: captions\nLanguage: en\n\n{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, []),
    "no blank line after the header": (f"WEBVTT\n{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, []),
    "no blank line between cues": (f"WEBVTT\n\n{VA}\nHi.\n{VB}\nBye.\n", BOTH, [5]),
    "identifiers": (f"WEBVTT\n\nintro\n{VA}\nHi.\n\nact 2\n{VB}\nBye.\n", BOTH, []),
    "short times": ("WEBVTT\n\n00:01.000 --> 00:02.000\nHi.\n\n00:03.000 --> 00:04.500\nBye.\n", BOTH, []),
    "commas": (f"WEBVTT\n\n{A}\nHi.\n\n{B}\nBye.\n", BOTH, []),
    "settings": (f"WEBVTT\n\n{VA} align:start position:10%\nHi.\n\n{VB} line:0\nBye.\n", BOTH, []),
    "comment": (f"WEBVTT\n\nNOTE\nnot spoken\n\n{VA}\nHi.\n\nNOTE nor this\n\n{VB}\nBye.\n", BOTH, []),
    "style sheet": (f"WEBVTT\n\nSTYLE\n::cue {{ color: red }}\n\n{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, []),
    "region": (f"WEBVTT\n\nREGION\nid:fred\nwidth:40%\n\n{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, []),
    "a word that begins like a block": (f"WEBVTT\n\n{VA}\nNOTED.\n\n{VB}\nBye.\n", [(1.0, 2.0, "NOTED."), BYE], []),
    "voices": (f"WEBVTT\n\n{VA}\n<v Ann>Hi.</v>\n\n{VB}\n<v.loud Bob>Bye.\n", BOTH, []),
    "classes and times inside": (f"WEBVTT\n\n{VA}\n<c.red>Hi.</c>\n\n{VB}\nBy<00:00:03.500>e.\n", BOTH, []),
    "ruby": (f"WEBVTT\n\n{VA}\n<ruby>Hi.<rt>hai</rt></ruby>\n\n{VB}\nBye.\n", BOTH, []),
    "entities": (f"WEBVTT\n\n{VA}\n&lrm;Hi.\n\n{VB}\nBye.&rlm;\n", BOTH, []),
    "overlap": (f"WEBVTT\n\n00:01.000 --> 00:03.500\nHi.\n\n{VB}\nBye.\n", [(1.0, 3.5, "Hi."), BYE], [3]),
    "out of order": (f"WEBVTT\n\n{VB}\nBye.\n\n{VA}\nHi.\n", BOTH, [6]),
    "end before begin": (f"WEBVTT\n\n00:01.000 --> 00:00.000\nHi.\n\n{VB}\nBye.\n", BOTH, [3]),
    "unreadable times": (f"WEBVTT\n\n0x:01 --> 00:02.000\nHi.\n\n{VB}\nBye.\n", [BYE], [3]),
    "missing end": (f"WEBVTT\n\n00:01.000 -->\nHi.\n\n{VB}\nBye.\n", BOTH, [3]),
    "trailing comment": (f"WEBVTT\n\n{VA}\nHi.\n\n{VB}\nBye.\n\nNOTE the end\nof it\n", BOTH, []),
    "header after blank lines": (f"\n\nWEBVTT\n\n{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, []),
    "dashes": (f"WEBVTT\n\n{VA}\n- Hi.\n\n{VB}\n– Bye.\n", BOTH, []),
    "names of streams": (f"WEBVTT\nX-TIMESTAMP-MAP=LOCAL:00:00:00.000,MPEGTS:0\n\n{VA}\nHi.\n\n{VB}\nBye.\n", BOTH, []),
}  # fmt: skip

HEAD = "[Script Info]\nTitle: x\n\n[V4+ Styles]\nFormat: Name, Fontname\nStyle: Loud,Arial\n\n[Events]\n"
FORM = "Format: Layer, Start, End, Style, Name, MarginL, MarginR, MarginV, Effect, Text\n"
DA = "Dialogue: 0,0:00:01.00,0:00:02.00,Loud,Ann,0,0,0,,Hi.\n"
DB = "Dialogue: 0,0:00:03.00,0:00:04.50,Default,Bob,0,0,0,,Bye.\n"
ASS: dict[str, tuple[str, list[tuple[float, float, str]], list[int]]] = {
    "good": (HEAD + FORM + DA + DB, BOTH, []),
    "no header": (DA + DB, BOTH, []),
    "events alone": ("[Events]\n" + FORM + DA + DB, BOTH, []),
    "no format line": (HEAD + DA + DB, BOTH, []),
    "another order of fields": (HEAD + "Format: Start, End, Text\nDialogue: 0:00:01.00,0:00:02.00,Hi.\n"
                                "Dialogue: 0:00:03.00,0:00:04.50,Bye.\n", BOTH, []),
    "a format line without its text": (HEAD + "Format: Start, End\n" + DA + DB, BOTH, [9]),
    "SSA": ("[Script Info]\n\n[V4 Styles]\n\n[Events]\n" + (DA + DB).replace("Dialogue: 0", "Dialogue: Marked=0"),
            BOTH, []),
    "commas in the words": (HEAD + FORM + DA.replace("Hi.", "Hi, you, there.") + DB,
                            [(1.0, 2.0, "Hi, you, there."), BYE], []),
    "comments": (HEAD + FORM + DA + DA.replace("Dialogue", "Comment").replace("Hi", "No") + DB, BOTH, []),
    "drawings": (HEAD + FORM + DA + DB + DB.replace("Bye.", "{\\p1}m 0 0 l 1 1{\\p0}").replace("3.00", "4.00"),
                 [(1.0, 2.0, "Hi."), BYE, (4.0, 4.5, "")], []),
    "overrides and line breaks": (HEAD + FORM + DA.replace("Hi.", "{\\i1}Hi,\\Nyou\\hall.{\\i0}") + DB,
                                  [(1.0, 2.0, "Hi, you all."), BYE], []),
    "karaoke": (HEAD + FORM + DA.replace("Hi.", "{\\k20}H{\\k30}i.") + DB, BOTH, []),
    "unreadable start": (HEAD + FORM + DA.replace("0:00:01.00", "x") + DB, [BYE], [10]),
    "unreadable end": (HEAD + FORM + DA.replace("0:00:02.00", "x") + DB, BOTH, [10]),
    "too few fields": (HEAD + FORM + "Dialogue: 0,0:00:01.00\n" + DB, [BYE], [10]),
    "end before begin": (HEAD + FORM + DA.replace("0:00:02.00", "0:00:00.00") + DB, BOTH, [10]),
    "out of order": (HEAD + FORM + DB + DA, BOTH, [11]),
    "layers with the same words": (HEAD + FORM + DA + DA.replace(": 0,", ": 1,") + DB, BOTH, [11]),
    "overlap": (HEAD + FORM + DA.replace("0:00:02.00", "0:00:03.50") + DB, [(1.0, 3.5, "Hi."), BYE], [10]),
    "fonts in the file": (HEAD + FORM + DA + DB + "\n[Fonts]\nfontname: a.ttf\n!!9%&'\n", BOTH, []),
    "keys in small letters": (HEAD + FORM + DA.replace("Dialogue", "dialogue") + DB, BOTH, []),
    "spaces around fields": (HEAD + FORM + DA.replace("0:00:01.00", " 0:00:01.00 ") + DB, BOTH, []),
    "milliseconds": (HEAD + FORM + DA.replace("0:00:01.00", "0:00:01.000") + DB, BOTH, []),
    "styles with stars": (HEAD + FORM + DA.replace("Loud", "*Loud") + DB, BOTH, []),
    "a negative time": (HEAD + FORM + DA.replace("0:00:01.00", "-0:00:01.00") + DB, [(0.0, 2.0, "Hi."), BYE], [10]),
    "a name of the actor's field": (HEAD + FORM.replace("Name", "Actor") + DA + DB, BOTH, []),
}  # fmt: skip

TT = '<tt xmlns="http://www.w3.org/ns/ttml" xmlns:ttp="http://www.w3.org/ns/ttml#parameter" {}>\n'
PA, PB = '<p begin="1s" end="2s">Hi.</p>\n', '<p begin="3s" end="4.5s">Bye.</p>\n'
LONG = ["<", "[", "(", "{", "A", "♪", "1\n", " ", "<i ", "# ", "A:", "&", "A ", "- ", "([", ". - A ", '." - "']


def tt(*paragraphs: str, attributes: str = "", head: str = "", div: str = "") -> str:
    return TT.format(attributes) + f"{head}<body><div {div}>\n" + "".join(paragraphs) + "</div></body></tt>"


TTML: dict[str, tuple[str, list[tuple[float, float, str]], list[int]]] = {
    "good": (tt(PA, PB), BOTH, []),
    "declaration": ('<?xml version="1.0" encoding="utf-8"?>\n' + tt(PA, PB), BOTH, []),
    "a declaration of another encoding": ('<?xml version="1.0" encoding="UTF-16"?>\n' + tt(PA, PB), BOTH, []),
    "clock times": (tt('<p begin="00:00:01.000" end="00:00:02">Hi.</p>', PB), BOTH, []),
    "durations": (tt('<p begin="1s" dur="1s">Hi.</p>', PB), BOTH, []),
    "milliseconds, minutes, hours": (tt('<p begin="1000ms" end="2000ms">Hi.</p>',
                                        '<p begin="0.05m" end="0.00125h">Bye.</p>'),
                                     BOTH, []),
    "frames": (tt('<p begin="00:00:01:00" end="50f">Hi.</p>', '<p begin="75f" end="00:00:04:12.5">Bye.</p>',
                  attributes='ttp:frameRate="25"'), [HI, (3.0, 4.48, "Bye.")], []),
    "frames of NTSC": (tt('<p begin="30f" end="60f">Hi.</p>',
                          attributes='ttp:frameRate="30" ttp:frameRateMultiplier="1000 1001"'),
                       [(1.001, 2.002, "Hi.")], []),
    "ticks": (tt('<p begin="10000000t" end="20000000t">Hi.</p>', attributes='ttp:tickRate="10000000"'), [HI], []),
    "times relative to the division": (tt(PA.replace("1s", "0s").replace("2s", "1s"), div='begin="1s"'), [HI], []),
    "a sequence": (tt('<p dur="1s">Hi.</p>', '<p begin="1s" dur="1.5s">Bye.</p>', div='begin="1s" timeContainer="seq"'),
                   BOTH, []),
    "line breaks and spaces": (tt('<p begin="1s" end="2s">\n  Hi,<br/>\n  you.\n</p>', PB),
                               [(1.0, 2.0, "Hi, you."), BYE], []),
    "spans": (tt('<p begin="1s" end="2s"><span style="s1">H</span><span>i.</span></p>', PB), BOTH, []),
    "timed spans": (tt('<p><span begin="1s" end="2s">Hi.</span><span begin="3s" end="4.5s">Bye.</span></p>'), BOTH, []),
    "empty paragraphs": (tt('<p begin="0s" end="1s"></p>', PA, PB), BOTH, []),
    "no namespace": ("<tt><body><div>" + PA + PB + "</div></body></tt>", BOTH, []),
    "an old namespace": (tt(PA, PB).replace("ns/ttml", "2006/10/ttaf1"), BOTH, []),
    "an unreadable time": (tt('<p begin="1s" end="soon">Hi.</p>', PB), BOTH, [3]),
    "no end": (tt('<p begin="1s">Hi.</p>', PB), BOTH, []),
    "end before begin": (tt('<p begin="1s" end="0.5s">Hi.</p>\n', PB), BOTH, [3]),
    "out of order": (tt(PB, PA), BOTH, [4]),
    "cut off after the first cue": (tt(PA, PB).partition("Bye")[0], [HI], [4]),
    "a wrong end tag": (tt(PA, PB).replace("</div>", "</dib>"), BOTH, [5]),
    "comments and metadata": (tt("<!-- no -->", PA, PB, head="<head><metadata><title>x</title></metadata></head>"),
                              BOTH, []),
    "entities": (tt('<p begin="1s" end="2s">Hi &amp; all.</p>', PB), [(1.0, 2.0, "Hi & all."), BYE], []),
    "blank lines before the declaration": ("\n\n" + '<?xml version="1.0"?>\n' + tt(PA, PB), BOTH, []),
}  # fmt: skip

SAMPLES = [
    pytest.param(suffix, *sample, id=f"{suffix} {name}")
    for suffix, samples in ((".srt", SRT), (".vtt", VTT), (".ass", ASS), (".ttml", TTML))
    for name, sample in samples.items()
]


@pytest.mark.parametrize(("suffix", "content", "cues", "lines"), SAMPLES)
def test_damaged_files_are_read_and_their_defects_named_by_line(
    suffix: str, content: str, cues: list[tuple[float, float, str]], lines: list[int], tmp_path: Path
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text(content, encoding="utf-8")
    read = read_subtitles(path)
    assert [(round(cue.begin_s, 3), round(cue.end_s, 3), cue.text) for cue in read.cues] == cues
    assert [warning.line for warning in read.warnings] == lines
    assert [cue.number for cue in read.cues] == list(range(1, len(cues) + 1))


def test_there_are_at_least_25_samples_of_each_format() -> None:
    assert min(len(samples) for samples in (SRT, VTT, ASS, TTML)) >= 25


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp1252"])
@pytest.mark.parametrize("suffix", [".srt", ".vtt", ".ass", ".ttml"])
def test_every_encoding_gives_the_same_words(encoding: str, suffix: str, tmp_path: Path) -> None:
    content = {".srt": SRT, ".vtt": VTT, ".ass": ASS, ".ttml": TTML}[suffix]["good"][0]
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content.replace("Hi.", "Café.").replace("\n", "\r\n").encode(encoding))
    assert [cue.text for cue in read_subtitles(path).cues] == ["Café.", "Bye."]


def test_an_encoding_can_be_named(tmp_path: Path) -> None:
    path = tmp_path / "a.srt"
    path.write_bytes(SRT["good"][0].replace("Hi.", "Dzień dobry.").encode("cp1250"))
    assert read_subtitles(path, "cp1250").cues[0].text == "Dzień dobry."
    with pytest.raises(InputError, match="there is no encoding 'cp9'"):
        read_subtitles(path, "cp9")
    with pytest.raises(DataError, match="is not text in ascii"):
        read_subtitles(path, "ascii")


@pytest.mark.parametrize(
    ("shown", "spoken", "speaker"),
    [
        ("[door slams]", "", ""),
        ("[door slams", "", ""),
        ("(door slams) No.", "No.", ""),
        ("♪ La la la ♪", "", ""),
        ("♫ La la\nla", "", ""),
        ("# La la la #", "", ""),
        ("（ドアの音）はい。", "はい。", ""),
        ("JOHN: Come in.", "Come in.", "JOHN"),
        ("- MRS. O'NEIL: Good evening.", "Good evening.", "MRS. O'NEIL"),
        ("ÉMILE:\nEntrez.", "Entrez.", "ÉMILE"),
        ("WOMAN (on phone): Hello.", "Hello.", "WOMAN"),
        ("At 10:30, they said: go.", "At 10:30, they said: go.", ""),
        ("Remember: go.", "Remember: go.", ""),
        ("I <3 you.", "I <3 you.", ""),
        ("- Who is it?\n- Me.", "Who is it? Me.", ""),
        (">> Good evening.", "Good evening.", ""),
        ("...", "", ""),
    ],
)
def test_noises_lyrics_and_labels_are_not_spoken(shown: str, spoken: str, speaker: str, tmp_path: Path) -> None:
    path = tmp_path / "a.srt"
    path.write_text(f"1\n{A}\n{shown}\n", encoding="utf-8")
    (cue,) = read_subtitles(path).cues
    assert (cue.text, cue.speaker) == (spoken, speaker)
    assert cue.shown


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("- JOHN: Hi.\n- ANN: Hello there,\nJohn.", [("JOHN", "Hi."), ("ANN", "Hello there, John.")]),
        ("JOHN: Hi.\nANN: Bye.\nJOHN: Oh.", [("JOHN", "Hi."), ("ANN", "Bye."), ("JOHN", "Oh.")]),
        ("- Hi.\n- Hello.", [("", "Hi."), ("", "Hello.")]),
        ("– JOHN: Hi.\n– Hello.", [("JOHN", "Hi."), ("", "Hello.")]),
        ("JOHN: Hi.\nJOHN: It is me.", []),
        ("- JOHN: [sighs]\n- ANN: Hello.", []),
        ("He came\n- late - and left.", []),
        ("JOHN: Hi.\nIt is me.", []),
        ("- Hi. - Hello.", [("", "Hi."), ("", "Hello.")]),
        ("-Who? -Me! -No.", [("", "Who?"), ("", "Me!"), ("", "No.")]),
        ("- JOHN: Hi. - ANN: Hello.", [("JOHN", "Hi."), ("ANN", "Hello.")]),
        ("Hi. - Hello.", [("", "Hi."), ("", "Hello.")]),
        ("Hi.\n- Hello.", [("", "Hi."), ("", "Hello.")]),
        (">> HELLO. >> HI.", [("", "HELLO."), ("", "HI.")]),
        ("- Go! - he said.", []),
        ("It fell - to 5. -5, I think.", []),
        ("He left. — She stayed.", []),
    ],
)
@pytest.mark.parametrize("suffix", ["srt", "vtt", "ass"])
def test_speakers_of_one_cue_are_divided(suffix: str, text: str, parts: list[tuple[str, str]], tmp_path: Path) -> None:
    path = tmp_path / f"a.{suffix}"
    content = {
        "srt": f"1\n{A}\n{text}\n",
        "vtt": f"WEBVTT\n\n00:01.000 --> 00:02.000\n{text}\n",
        "ass": "[Events]\nFormat: Start, End, Text\nDialogue: 0:00:01.00,0:00:02.00," + text.replace("\n", "\\N"),
    }[suffix]
    path.write_text(content, encoding="utf-8")
    read = read_subtitles(path)
    (cue,) = read.cues
    assert [(part.speaker, part.text) for part in cue.parts] == parts
    assert read.warnings == ()
    assert not parts or cue.text == " ".join(words for _, words in parts)


def test_voices_of_one_webvtt_cue_are_divided(tmp_path: Path) -> None:
    path = tmp_path / "a.vtt"
    path.write_text(
        "WEBVTT\n\n00:01.000 --> 00:02.000\n<v.loud Ann>Hi.</v> <v Bob Lee>- Hello.</v>\n", encoding="utf-8"
    )
    (cue,) = read_subtitles(path).cues
    assert [(part.speaker, part.text) for part in cue.parts] == [("Ann", "Hi."), ("Bob Lee", "Hello.")]
    assert (cue.text, cue.shown, cue.speaker, cue.style) == ("Hi. Hello.", "Hi. - Hello.", "Ann", "loud")


def test_the_actor_of_a_line_speaks_up_to_the_first_label(tmp_path: Path) -> None:
    path = tmp_path / "a.ass"
    path.write_text(
        "[Events]\nFormat: Start, End, Name, Text\nDialogue: 0:00:01.00,0:00:02.00,Kim,- Hi.\\N- ANN: Bye.",
        encoding="utf-8",
    )
    (cue,) = read_subtitles(path).cues
    assert [part.speaker for part in cue.parts] == ["Kim", "ANN"]


def test_speakers_and_styles_of_each_format(tmp_path: Path) -> None:
    agents = (
        '<head><metadata xmlns:ttm="http://www.w3.org/ns/ttml#metadata"><ttm:agent xml:id="a" type="person">'
        '<ttm:name type="full">Ann</ttm:name></ttm:agent></metadata></head>'
    )
    ttml = tt(PA.replace("<p", '<p ttm:agent="a" style="Loud" xml:lang="fr"'), PB, head=agents)
    ttml = ttml.replace("<tt ", '<tt xmlns:ttm="http://www.w3.org/ns/ttml#metadata" xml:lang="en" ', 1)
    vtt = VTT["voices"][0].replace("<v Ann>", "<v.Loud Ann><lang fr>")
    for suffix, content in ((".ass", ASS["good"][0]), (".ttml", ttml), (".vtt", vtt)):
        path = tmp_path / f"a{suffix}"
        path.write_text(content, encoding="utf-8")
        first = read_subtitles(path).cues[0]
        assert (first.speaker, first.style) == ("Ann", "Loud"), suffix
        assert first.language == (None if suffix == ".ass" else "fr")


@pytest.mark.parametrize(
    ("suffix", "content", "reason"),
    [
        (".srt", "", "contains no subtitles"),
        (".srt", "no subtitles at all", "contains no subtitles"),
        (".ass", HEAD + FORM, "contains no subtitles"),
        (".ttml", "<tt><body><p", "line 1: the XML is not well-formed"),
        (".ttml", '<!DOCTYPE tt [<!ENTITY a "b">]>' + tt(PA), "document type declaration is not supported"),
        (".ttml", "<tt>" * 100, "nested deeper than 64"),
    ],
)
def test_files_without_cues_are_refused(suffix: str, content: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(DataError, match=reason):
        read_subtitles(path)


@pytest.mark.parametrize("suffix", [".srt", ".vtt", ".ass", ".ttml"])
def test_what_pysubs2_writes_is_read_as_pysubs2_reads_it(suffix: str, tmp_path: Path) -> None:
    """An independent writer and reader, on files without defects."""
    subtitles = pysubs2.SSAFile()
    for number in range(40):
        begin = 1000 * number + 10 * number
        subtitles.append(
            pysubs2.SSAEvent(start=begin, end=begin + 730, text=f"Line {number},\\N{{\\i1}}twice.{{\\i0}}")
        )
    path = tmp_path / f"a{suffix}"
    kind = suffix.removeprefix(".")
    subtitles.save(str(path), format_=kind)
    theirs = [(event.start, event.end, " ".join(event.plaintext.split())) for event in
              pysubs2.load(str(path), format_=kind)]  # fmt: skip
    read = read_subtitles(path)
    assert [(round(cue.begin_s * 1000), round(cue.end_s * 1000), cue.text) for cue in read.cues] == theirs
    assert not read.warnings


@pytest.mark.parametrize("unit", LONG)
def test_reading_time_is_linear(unit: str, tmp_path: Path) -> None:
    path = tmp_path / "a.srt"
    path.write_text(f"1\n{A}\n{unit * (200_000 // len(unit))}\n", encoding="utf-8")
    began = time.process_time()
    read_subtitles(path)
    assert time.process_time() - began < 4.0  # s of this process; a quadratic scan takes minutes


ADVICE = {
    "the encoding is not stated and was guessed as cp1250; --encoding names another":
        "the encoding is not stated and was guessed as cp1250; save it as UTF-8",
    "3 bytes are no UTF-8, as the rest is; --encoding names another encoding":
        "3 bytes are no UTF-8, as the rest is; save it as UTF-8",
    "2 signs, such as 'Exit', are not spoken; --keep signs speaks them": "2 signs, such as 'Exit', are not spoken",
    "each word is spoken once (--keep repeats speaks all)": "each word is spoken once",
    "names before a colon: ANN (2); --no-speakers makes the names words": "names before a colon: ANN (2)",
    "track 1 is read, --track names another one": "track 1 is read",
    "25 a second are taken (--subtitle-fps)": "25 a second are taken",
    "the times cannot be meant; give the film's rate as --subtitle-fps": "the times cannot be meant",
    "choose the subtitles of this film, or move them with --shift": "choose the subtitles of this film",
    "by the time code of a tape; --shift -36000 sets it to the film": "by the time code of a tape",
    "a delay of 5, which is not used; --shift moves the times": "a delay of 5, which is not used",
    "this cue overlaps the next one by 0.50 s": "this cue overlaps the next one by 0.50 s",
}  # fmt: skip


@pytest.mark.parametrize(("message", "left"), ADVICE.items())
def test_messages_name_no_option_where_there_is_none(message: str, left: str) -> None:
    assert without_options(message) == left
