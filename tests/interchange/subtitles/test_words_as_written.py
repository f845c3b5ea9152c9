"""Words of subtitles that look like marks of the format are spoken."""

import pytest

from lexicon.text_marks import parse_marks
from tests.interchange.subtitles.conftest import ReadText, srt, vtt

LATE = (3, 4, "It is late.")


def spoken(read: ReadText, content: str, suffix: str = ".srt") -> list[str]:
    return [cue.text for cue in read(content, suffix).cues]


def test_cues_that_are_numbers_are_spoken(read: ReadText) -> None:
    words = ["Ready?", "3", "2", "1", "Go!"]
    content = vtt(*[(at, at + 0.9, word) for at, word in enumerate(words)])
    found = read(content, ".vtt")
    assert [cue.text for cue in found.cues] == words
    assert not found.warnings


def test_a_number_at_the_end_of_a_cue_without_numbers_is_spoken(read: ReadText) -> None:
    content = "00:00:01,000 --> 00:00:02,000\nIt was\n1984\n\n00:00:03,000 --> 00:00:04,000\nBye.\n"
    assert spoken(read, content) == ["It was 1984", "Bye."]


@pytest.mark.parametrize("text", ["Left -> right.", "A → B", "x --> y", "Go home -->"])
@pytest.mark.parametrize("suffix", [".srt", ".sbv", ".lrc"])
def test_arrows_in_words_are_no_times(text: str, suffix: str, read: ReadText) -> None:
    if suffix == ".srt":
        content = srt((1, 2, text), LATE)
    elif suffix == ".sbv":
        content = f"0:00:01.000,0:00:02.000\n{text}\n\n0:00:03.000,0:00:04.000\nIt is late.\n"
    else:
        content = f"[00:01.00]{text}\n[00:03.00]It is late.\n"
    assert spoken(read, content, suffix) == [text, "It is late."]


@pytest.mark.parametrize(
    "text",
    ["我想说的是：不要去。", "他说：你好", "时间：三点", "比分3：2", "彼は言った：来い", "הוא אמר: בוא הנה.",
     "قال الرجل: تعال هنا", "उसने कहा: यहाँ आओ।"],
)  # fmt: skip
def test_words_of_scripts_without_capitals_are_no_speakers(text: str, read: ReadText) -> None:
    (first, *_) = read(srt((1, 2, text), LATE, (5, 6, "Yes."))).cues
    assert (first.speaker, first.text) == ("", text)


def test_names_in_scripts_without_capitals_are_speakers_where_they_recur(read: ReadText) -> None:
    cues = read(srt((1, 2, "小明：你好"), (3, 4, "小明：再见"), (5, 6, "你好"), (7, 8, "是的"), (9, 10, "好"))).cues
    assert [cue.speaker for cue in cues] == ["小明", "小明", "", "", ""]


@pytest.mark.parametrize(
    "text",
    ["Read www.example.com for a description", "Book your trip at www.booking.com.", "Write a script on replit.com",
     "Fixed: the bug", "Transcript: hello there", "Created: 1999"],
)  # fmt: skip
def test_what_somebody_says_is_no_credit(text: str, read: ReadText) -> None:
    assert read(srt((1, 2, text), LATE), speakers=False).cues[0].shown == text
    assert spoken(read, srt((1, 2, text), LATE))[0]


@pytest.mark.parametrize("text", ["Synced & corrected: max", "Subtitles: Max", "Subtitles at www.example.com"])
def test_makers_of_subtitles_are_credits(text: str, read: ReadText) -> None:
    assert spoken(read, srt((1, 2, text), LATE))[0] == ""


@pytest.mark.parametrize("wrong", [359_998, 46_803, 86_000])
def test_one_wrong_hour_moves_no_other_cue(wrong: int, read: ReadText) -> None:
    found = read(srt((1, 2, "One."), (wrong, wrong + 1, "Two."), (5, 6, "Three."), (7, 8, "Four.")))
    starts = {cue.text: cue.begin_s for cue in found.cues}
    assert (starts["One."], starts["Three."], starts["Four."]) == (1, 5, 7)


@pytest.mark.parametrize(
    "texts",
    [["Go!", "Go! Run!", "Go! Run! Hide!"], ["Never.", "Never. Not once.", "Why?"],
     ["My name is Bond.", "My name is Bond. James Bond.", "I see."]],
)  # fmt: skip
def test_sentences_that_are_said_again_are_spoken(texts: list[str], read: ReadText) -> None:
    content = srt(*[(at, at + 1, text) for at, text in enumerate(texts)])
    assert spoken(read, content) == texts


@pytest.mark.parametrize(
    "text",
    [
        "-40 degrees today.",
        "–5°C",
        "f(x) equals 3",
        "Parent(s) come",
        "Call (555) 123-4567.",
        "array[0] is it",
        "if (a<b && c>d) go",
        "(s)he came",
        "print(args) it",
        "Lehrer(innen) und né(e)",
        "I am sad :( really",
        "the set {a: 1}",
        "a {c: 2} b",
    ],
)
def test_signs_of_numbers_and_brackets_in_words_stay(text: str, read: ReadText) -> None:
    cues = read(srt((1, 2, text), LATE)).cues
    assert cues[0].text == text
    assert len(cues[0].parts) < 2


def test_a_number_after_a_sentence_is_no_other_speaker(read: ReadText) -> None:
    (cue, _) = read(srt((1, 2, "It was cold.\n-5 degrees."), LATE)).cues
    assert (cue.text, cue.parts) == ("It was cold. -5 degrees.", ())


def test_a_number_of_a_dialogue_is_said_by_another_speaker(read: ReadText) -> None:
    (cue, _) = read(srt((1, 2, "-How many?\n-5 of them."), LATE)).cues
    assert [part.text for part in cue.parts] == ["How many?", "5 of them."]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("♪\nJOHN: Hello there.", "Hello there."),
        ("♪ soft music\n- Did you hear that?", "Did you hear that?"),
        ("♪ la la\nlu lu ♪", ""),
        ("Unclosed [laughs\nHello.", "Unclosed Hello."),
        ("Unclosed (laughs\nHello.", "Unclosed Hello."),
        ("[door\nHello [laughs] there.", "Hello there."),
        ("(door slams\nHello (laughs) there.", "Hello there."),
        ("（笑\n你好", "你好"),
        ("slams] Hello.", "Hello."),
        ("(笑)你好", "你好"),
        ("你好(笑)", "你好"),
        ("【门响】你好", "你好"),
        ("Привет(смеётся)", "Привет"),
        ("[door [loud] slams] Hello.", "Hello."),
        ("(laughs (softly)) Hello.", "Hello."),
        ("Hello(laughs)", "Hello"),
        ("Sure[sighing]so", "Sure so"),
        ("Hi(door slams)there", "Hi there"),
        (">>> REPORTER: HELLO.", "HELLO."),
        ("It&rsquo;s a caf&eacute;&hellip;", "It’s a café…"),
    ],
)
def test_marks_end_where_somebody_speaks(text: str, words: str, read: ReadText) -> None:
    said = parse_marks(read(srt((1, 2, text), LATE)).cues[0].text).text
    assert " ".join(said.split()) == words


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("[nod] Yes. [style:sad]No.[/style]", "[nod] Yes. [style:sad]No.[/style]"),
        ("[happy] Great!\n(laughs)", "[happy] Great! (laughs)"),
        ("[nod x] Yes [pause 1] no.", "[nod x] Yes [pause 1] no."),
        ("[door creaks] Yes. (2 HOURS LATER)", "Yes."),
        ("Yes, [style:sad no.\n(applause) Really.", "Yes, [style:sad no. Really."),
        ("[emphasis]Yes. [door creaks", "[emphasis]Yes."),
        ("[listen to the radio] Yes. [applause]", "Yes."),
    ],
)
def test_marks_of_any_text_stay_and_annotations_do_not(text: str, kept: str, read: ReadText) -> None:
    assert read(srt((1, 2, text), LATE)).cues[0].text == kept
    assert "[" not in read(srt((1, 2, text), LATE), markup="plain").cues[0].text


def test_english_with_a_borrowed_word_is_of_the_west(read: ReadText) -> None:
    words = "We went to the café. It was nice. He is naïve. Really?"
    assert read(srt((1, 2, words), LATE).encode("cp1252")).cues[0].text == words


def test_readings_and_descriptions_of_timed_text_are_not_spoken(read: ReadText) -> None:
    content = (
        '<tt xmlns="http://www.w3.org/ns/ttml" xmlns:tts="http://www.w3.org/ns/ttml#styling" '
        'xmlns:ttm="http://www.w3.org/ns/ttml#metadata"><head><styling><style xml:id="r" tts:ruby="text"/></styling>'
        '</head><body><div><p begin="1s" end="2s"><metadata><ttm:desc>a sign</ttm:desc></metadata>'
        '<span tts:ruby="container"><span tts:ruby="base">漢</span><span style="r">かん</span></span>字</p>'
        "</div></body></tt>"
    )
    assert spoken(read, content, ".ttml") == ["漢字"]


@pytest.mark.parametrize(
    ("attributes", "begin"), [('ttp:dropMode="nonDrop"', 3603.6), ('ttp:dropMode="dropNTSC"', 3600.0)]
)
def test_hours_of_time_code_without_drops_are_longer(attributes: str, begin: float, read: ReadText) -> None:
    content = (
        '<tt xmlns="http://www.w3.org/ns/ttml" xmlns:ttp="http://www.w3.org/ns/ttml#parameter" ttp:timeBase="smpte" '
        f'ttp:frameRate="24" ttp:frameRateMultiplier="1000 1001" {attributes}><body><div>'
        '<p begin="00:00:01:00" end="00:00:02:00">Hello.</p><p begin="01:00:00:00" end="01:00:02:00">Bye.</p>'
        "</div></body></tt>"
    )
    assert read(content, ".itt").cues[1].begin_s == pytest.approx(begin, abs=0.01)


def test_manners_within_labels_are_counted_and_kept(read: ReadText) -> None:
    content = srt((1, 2, "ANNA (off): Hello."), (3, 4, "MAN (2): Bye."), (5, 6, "[loud] Go. (sighs)"))
    found = read(content)
    assert [cue.speaker for cue in found.cues] == ["ANNA", "MAN", ""]
    assert [cue.text for cue in found.cues] == ["Hello.", "Bye.", "Go. (sighs)"]
    assert found.notes[0].message.startswith("2 annotations, such as '(off)'")
    assert [cue.text for cue in read(content, keep=("annotations",)).cues] == ["off Hello.", "Bye.", "loud Go. sighs"]


BESIDE = {
    "words": ("Hello there.", "Hello there. So.", "'Hello there.' stands beside the times; it is read"),
    "words after settings": ("align:start line: 0 Hello", "Hello So.", "'Hello' stands beside the times; it is read"),
    "a name": ("ANNA: Hello", "Hello So.", "'ANNA: Hello' stands beside the times; it is read"),
    "a tag": ("<i>Hello</i>", "Hello So.", "'<i>Hello</i>' stands beside the times; it is read"),
    "settings": ("align:start position:10%,line-left line:0 size:50% vertical:rl region:fred", "So.", ""),
    "settings of a draft": ("A:middle L:90% T:50%", "So.", ""),
    "corners": ("X1:100 X2:200 Y1:1 Y2:-2", "So.", ""),
    "an unknown setting": ("snap:no", "So.", "'snap:no' stands beside the times; it is taken for a setting"),
}


@pytest.mark.parametrize("suffix", [".srt", ".vtt"])
@pytest.mark.parametrize(("beside", "words", "message"), BESIDE.values(), ids=BESIDE)
def test_words_beside_the_times_are_read_and_said(
    suffix: str, beside: str, words: str, message: str, read: ReadText
) -> None:
    head = "WEBVTT\n\n" if suffix == ".vtt" else ""
    found = read(f"{head}00:00:01.000 --> 00:00:02.000 {beside}\nSo.\n\n00:00:03.000 --> 00:00:04.000\nNo.\n", suffix)
    assert [cue.text for cue in found.cues] == [words, "No."]
    assert [warning.message for warning in found.warnings] == [message] * bool(message)


@pytest.mark.parametrize("number", ["{}", "{})", "#{}", "{}."])
def test_numbers_may_stand_before_the_times(number: str, read: ReadText) -> None:
    lines = (f"00:00:0{at},000 --> 00:00:0{at + 1},000\nGo." for at in (1, 3))
    content = "\n\n".join(f"{number.format(count)} {line}" for count, line in enumerate(lines, start=1))
    found = read(content)
    assert [(cue.begin_s, cue.text) for cue in found.cues] == [(1, "Go."), (3, "Go.")]
    assert not found.warnings


def test_words_beside_two_instants_are_read(read: ReadText) -> None:
    content = "0:00:01.000,0:00:02.000 Hello\nthere.\n\n0:00:03,0:00:04\nBye.\n"
    assert [(cue.begin_s, cue.text) for cue in read(content, ".sbv").cues] == [(1, "Hello there."), (3, "Bye.")]


@pytest.mark.parametrize(("suffix", "head"), [(".srt", ""), (".vtt", "WEBVTT\n\n")])
@pytest.mark.parametrize(
    ("written", "words"),
    [
        ('<a href="http://x.org/y">here</a> it is', "here it is"),
        ('<i class="a">so</i> <b class=x>it</b> is', "so it is"),
        ("<key name='a'>so</key> press <key>", "so press <key>"),
        ('so<br clear="all">it is', "so it is"),
        ("{y:i}so {c:$0000ff}{s:24}{f:Arial}{P:1}it {a: 1}", "so it {a: 1}"),
        ("C:\\New folder", "C:\\New folder"),
        ("“D:\\Data\\hot\\Names”", "“D:\\Data\\hot\\Names”"),
        ("\\\\server\\News here", "\\\\server\\News here"),
    ],
)
def test_tags_have_attributes_and_paths_no_line_breaks(
    suffix: str, head: str, written: str, words: str, read: ReadText
) -> None:
    content = f"{head}00:00:01.000 --> 00:00:02.000\n{written}\n\n00:00:03.000 --> 00:00:04.000\nNo.\n"
    assert spoken(read, content, suffix) == [words, "No."]


def test_signs_of_line_breaks_are_those_of_players(read: ReadText) -> None:
    assert spoken(read, srt((1, 2, "So\\Nit\\his"))) == ["So it is"]
    assert spoken(read, vtt((1, 2, "So\\Nit")), ".vtt") == ["So\\Nit"]


def test_a_cue_that_is_an_ssml_document_keeps_its_tags(read: ReadText) -> None:
    document = '<speak>ANNA: <prosody pitch="+3st">hi</prosody>\n- [laughs] <b>you</b></speak>'
    found = read(srt((1, 2, document), (3, 4, '<i>It</i> <break time="1s"/> is late.')), ".srt").cues
    assert [cue.text for cue in found] == [document.replace("\n", " "), "It is late."]
    assert found[0].speaker == ""
