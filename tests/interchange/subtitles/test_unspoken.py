"""What subtitles show and nobody says is left out, said in a note, and spoken where it is kept."""

import pytest

from tests.interchange.subtitles.conftest import EVENTS, ReadText, ass, srt
from tts2face.interchange.subtitles.unspoken import KINDS

HELLO = (1, 3, "Hello there.")
LEFT_OUT = {
    "a noise": ("annotations", srt(HELLO, (4, 5, "[door slams]")), ".srt", "door slams"),
    "a manner": ("annotations", srt(HELLO, (4, 5, "(hoarse) Bye.")), ".srt", "hoarse Bye."),
    "a noise over two lines": ("annotations", srt(HELLO, (4, 5, "[rain\nfalls]")), ".srt", "rain falls"),
    "a song": ("lyrics", srt(HELLO, (4, 5, "♪ la la ♪")), ".srt", "la la"),
    "a song of a style": (
        "lyrics",
        ass((*HELLO[:2], "Default", HELLO[2]), (4, 5, "OP Romaji", "sora e")),
        ".ass",
        "sora e",
    ),
    "a sign of a style": (
        "signs",
        ass((*HELLO[:2], "Main", HELLO[2]), (4, 5, "Signs", "{\\pos(1,2)}Exit")),
        ".ass",
        "Exit",
    ),
    "a title": ("signs", ass((*HELLO[:2], "Main", HELLO[2]), (4, 5, "EpTitle", "Part One")), ".ass", "Part One"),
    "turned text": (
        "signs",
        ass((*HELLO[:2], "Default", HELLO[2]), (4, 5, "Default", "{\\pos(9,9)\\frz12}Bakery")),
        ".ass",
        "Bakery",
    ),
    "text that moves": (
        "signs",
        ass((*HELLO[:2], "Default", HELLO[2]), (4, 5, "Default", "{\\move(1,1,9,9)}Bakery")),
        ".ass",
        "Bakery",
    ),
    "a scrolling text": (
        "signs",
        EVENTS + "Dialogue: 0,0:00:01.00,0:00:03.00,Default,,0,0,0,,Hello there.\n"
        "Dialogue: 0,0:00:04.00,0:00:05.00,Default,,0,0,0,Banner;40,News\n",
        ".ass",
        "News",
    ),
    "syllables of karaoke": (
        "effects",
        EVENTS + "Dialogue: 0,0:00:01.00,0:00:03.00,Default,,0,0,0,,Hello there.\n"
        "Comment: 0,0:00:04.00,0:00:05.00,Default,,0,0,0,karaoke,{\\k50}so{\\k50}ra\n"
        "Dialogue: 0,0:00:04.00,0:00:05.00,Default,,0,0,0,fx,{\\pos(3,4)}so\n",
        ".ass",
        "so",
    ),
    "a title of TTML": (
        "signs",
        '<tt xmlns="http://www.w3.org/ns/ttml" xmlns:m="http://www.w3.org/ns/ttml#metadata"><body><div>'
        '<p begin="1s" end="3s">Hello there.</p><p m:role="title" begin="4s" end="5s">London</p></div></body></tt>',
        ".ttml",
        "London",
    ),
    "a sound of TTML": (
        "annotations",
        '<tt xmlns="http://www.w3.org/ns/ttml" xmlns:m="http://www.w3.org/ns/ttml#metadata"><body><div>'
        '<p begin="1s" end="3s">Hello there.</p><p m:role="sound" begin="4s" end="5s">Thunder</p></div></body></tt>',
        ".ttml",
        "Thunder",
    ),
    "credits": ("credits", srt(HELLO, (4, 5, "Subtitles by Somebody")), ".srt", "Subtitles by Somebody"),
    "makers": (
        "credits",
        srt((0, 1, "Synced & corrected by -robtor-"), HELLO),
        ".srt",
        "Synced & corrected by -robtor-",
    ),
    "a source": (
        "credits",
        srt(HELLO, (4, 5, "Advertise your product here: www.OpenSubtitles.org")),
        ".srt",
        "Advertise your product here: www.OpenSubtitles.org",
    ),
    "credits in German": (
        "credits",
        srt(HELLO, (4, 5, "Untertitel von Anna Beispiel")),
        ".srt",
        "Untertitel von Anna Beispiel",
    ),
}


@pytest.mark.parametrize(("kind", "content", "suffix", "words"), LEFT_OUT.values(), ids=LEFT_OUT)
def test_what_nobody_says_is_said_in_a_note_and_can_be_kept(
    kind: str, content: str, suffix: str, words: str, read: ReadText
) -> None:
    found = read(content, suffix)
    assert words not in [cue.text for cue in found.cues]
    assert "Hello there." in [cue.text for cue in found.cues]
    (note,) = found.notes
    assert note.message.startswith(f"1 {kind.removesuffix('s')}, such as ")
    assert f"--keep {kind}" in note.message
    kept = read(content, suffix, keep=(kind,))
    assert words in [cue.text for cue in kept.cues]
    assert not kept.notes
    assert kind in KINDS


def test_kinds_are_counted(read: ReadText) -> None:
    found = read(srt((0, 1, "[a bell] Well."), (1, 2, "(a sigh)"), (2, 3, "♪ la ♪"), (3, 4, "Yes.")))
    assert [note.message for note in found.notes] == [
        "2 annotations, such as '[a bell]', are not spoken; --keep annotations speaks them",
        "1 lyric, such as '♪ la ♪', is not spoken; --keep lyrics speaks it",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "Translated by hand, the book took years.",
        "I found the website, www.example.com, last night.",
        "The subtitles are wrong.",
        "Sync your watches!",
    ],
)
def test_sentences_about_subtitles_are_no_credits(text: str, read: ReadText) -> None:
    found = read(srt(HELLO, (4, 5, text)))
    assert found.cues[1].text == text


def test_dialogue_that_is_placed_is_spoken(read: ReadText) -> None:
    found = read(ass((1, 2, "Default", "{\\an8}Up here."), (3, 4, "Italics", "{\\pos(320,50)}Down here.")), ".ass")
    assert [cue.text for cue in found.cues] == ["Up here.", "Down here."]
    assert not found.notes


def test_a_file_of_nothing_but_signs_is_read(read: ReadText) -> None:
    found = read(ass((1, 2, "Sign", "Keep out."), (3, 4, "Sign", "Danger.")), ".ass")
    assert [cue.text for cue in found.cues] == ["Keep out.", "Danger."]


def test_words_beside_a_drawing_are_spoken(read: ReadText) -> None:
    found = read(
        ass((1, 2, "Default", "{\\p1}m 0 0 l 5 5{\\p0}Hello."), (3, 4, "Default", "{\\p1}m 0 0 l 5 5")), ".ass"
    )
    assert [cue.text for cue in found.cues] == ["Hello.", ""]
    assert [note.message for note in found.notes] == ["1 effect is not spoken; --keep effects speaks it"]


AS_TEXT = {
    "a comparison": (".srt", "for 3 < x we get y > 0", "for 3 < x we get y > 0"),
    "a heart": (".srt", "I <3 you > all", "I <3 you > all"),
    "a name of no tag": (".srt", "press <Enter> or <key>", "press <Enter> or <key>"),
    "letters of tags with words": (".srt", "if a <b and c> d", "if a <b and c> d"),
    "tags": (".srt", '<i>so</i> <font color="#fff">it</font> <b>is</b>', "so it is"),
    "braces": (".srt", "the set {a, b} {\\an8}here", "the set {a, b} here"),
    "a comparison in WebVTT": (".vtt", "for 3 < x we get y > 0", "for 3 < x we get y > 0"),
    "escapes in WebVTT": (".vtt", "for 3 &lt; x we get y &gt; 0", "for 3 < x we get y > 0"),
    "classes and instants in WebVTT": (".vtt", "<c.yellow>so <00:00:01.500><i.loud>it</i></c> is", "so it is"),
    "a tag of HTML in SubStation Alpha": (".ass", "a <b> c {\\i1}is{\\i0} {a note}here", "a <b> c is here"),
    "a tag of HTML in TTML": (".ttml", "a &lt;b&gt; c", "a <b> c"),
    "a tag of HTML in LRC": (".lrc", "a <b> c", "a <b> c"),
    "a tag of HTML in MicroDVD": (".sub", "{y:i}a <b> c", "a <b> c"),
}


@pytest.mark.parametrize(("suffix", "written", "said"), AS_TEXT.values(), ids=AS_TEXT)
def test_what_is_no_tag_of_the_format_is_text(suffix: str, written: str, said: str, read: ReadText) -> None:
    content = {
        ".srt": srt((1, 2, written)),
        ".vtt": f"WEBVTT\n\n00:01.000 --> 00:02.000\n{written}\n",
        ".ass": ass((1, 2, "Default", written)),
        ".ttml": f'<tt xmlns="http://www.w3.org/ns/ttml"><body><p begin="1s" end="2s">{written}</p></body></tt>',
        ".lrc": f"[00:01.00]{written}\n",
        ".sub": f"{{25}}{{50}}{written}\n",
    }[suffix]
    assert [cue.text for cue in read(content, suffix).cues] == [said]
