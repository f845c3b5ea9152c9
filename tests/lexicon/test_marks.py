"""Marks and SSML in a text: what they mean, and what is no mark."""

import re
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.errors import InputError
from lexicon.growing_text import MAX_HELD_CHARACTERS, GrowingText
from lexicon.marked_text import MAX_NESTING, GestureMark, MarkedText, NameMark, PauseMark, StyleRun
from lexicon.text_marks import USUAL_PAUSE_S, parse_marks
from lexicon.tones import Tone

LETTERS = st.characters(whitelist_categories=["Ll", "Lo", "Mn", "Sc", "Zs"]) | st.sampled_from(" ,.!?%'")
PLAIN = st.text(LETTERS).map(lambda text: f"x{text}")  # no emoticon begins behind a letter
BILLION = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))


@given(PLAIN)
def test_text_without_marks_is_itself(text: str) -> None:
    assert parse_marks(text) == MarkedText(text)


@pytest.mark.parametrize(
    "text",
    [
        "a < b",
        "if x<y and z>w",
        "see [1]",
        "x[0",
        "f(x)",
        "[styles]",
        "[think about it]",
        "(about two hours)",
        "3 * 4 * 5",
    ],
)
def test_other_brackets_are_text(text: str) -> None:
    assert parse_marks(text) == MarkedText(text)


@given(st.lists(st.tuples(PLAIN, st.sampled_from([0.1, 0.4, 2.0])), max_size=6), PLAIN)
def test_marks_keep_their_positions(parts: list, last: str) -> None:
    found = parse_marks("".join(f"{text}[nod {size:g}]" for text, size in parts) + last)
    assert found.text == "".join(text for text, _ in parts) + last
    places = [sum(len(text) for text, _ in parts[: k + 1]) for k in range(len(parts))]
    assert found.marks == tuple(GestureMark(at, size=size) for at, (_, size) in zip(places, parts, strict=True))


def test_every_mark() -> None:
    found = parse_marks(
        "Well, [pause 0.4]yes [nod 0.5][pause .5s][style:head=calm]one [style: cross ]two[/style][/style].[nod]"
    )
    assert found.text == "Well, yes one two."
    assert found.marks == (PauseMark(6, 0.4), GestureMark(10, size=0.5), PauseMark(10, 0.5), GestureMark(18))
    assert found.runs == (StyleRun(0), StyleRun(10, ("head=calm",)), StyleRun(14, ("head=calm", "cross")), StyleRun(17))
    assert found.has_voice_changes
    assert not parse_marks("[style:a]b[/style]").has_voice_changes


def test_pauses_at_one_place_add_up() -> None:
    assert parse_marks("a[pause 1][nod][pause 2]b[pause 3]").marks == (
        PauseMark(1, 3.0),
        GestureMark(1),
        PauseMark(2, 3.0),
    )


@pytest.mark.parametrize(
    ("text", "said", "note"),
    [
        ("[pause x]a", "a", "the mark [pause x] is not followed: write [pause 0.4], in seconds"),
        ("[pause nan]a", "a", "the mark [pause nan] is not followed: write [pause 0.4]"),
        ("[pause 1e3]a", "a", "the mark [pause 1e3] is not followed"),
        ("[pause -1]a", "a", "a pause lasts 0 s or longer, not -1 s"),
        ("[pause 60]a", "a", "silence at one place is 10 s, the limit, not 60"),
        ("[pause 6][pause 6]a", "a", "silence at one place is 10 s, the limit, not 12"),
        ("[pause 1 a", "pause 1 a", "the mark [pause has no closing bracket; its words are spoken"),
        ("[nod 9]a", "a", "the size of the gesture nod must lie between 0.1 and 2, not 9"),
        ("[smile 5]a", "a", "the size of the gesture smile must lie between 0.1 and 2, not 5"),
        ("[sigh 90s]a", "a", "the duration of the gesture sigh must lie between 0.1 and 30 s, not 90 s"),
        ("[look at left 80]a", "a", "direction left of the gesture look at in degrees must lie between -35 and 35"),
        ("[blink left]a", "a", "the gesture blink has no direction; remove it, or choose look_at"),
        ("[nod x]a", "a", "the mark [nod x] is not followed: write [nod], or [nod 0.5] for a small one"),
        ("[wink up]a", "a", "the mark [wink up] is not followed"),
        ("[tilt left 20]a", "a", "the mark [tilt left 20] is not followed"),
        ("[emphasis strong]a[/emphasis]", "a", "the mark [emphasis strong] is not followed; its text is spoken"),
        ("[lang:de]a[/lang]", "a", "the mark [/lang] is not followed; its text is spoken"),
        ("[u]a[/u]", "a", "the mark [u] is not followed; its text is spoken"),
        ("[/nod]a", "a", "the mark [/nod] is not followed"),
        ("[style]a[/style]", "a", "the mark [style] is not followed: write [style:NAME] ... [/style]"),
        ("[style delighted]a", "a", "the mark [style delighted] is not followed"),
        ("[style:]a", "a", "the mark [style:] is not followed"),
        ("[style:a]b", "b", "[style:a] is not closed; it applies up to the end of the text"),
        ("b[/style]", "b", "[/style] has no opening mark"),
        ("[style:a][/style]b", "b", "[style:a] contains no text"),
        ("[style:a]" * (MAX_NESTING + 1) + "b", "b", "is nested in 16 other marks"),
        ("[phoneme:7]b[/phoneme]", "b", "the mark [phoneme:7]b[/phoneme] is not followed"),
        ("[/phoneme]b", "b", "the mark [/phoneme] is not followed"),
    ],
)
def test_a_mark_that_is_wrong_costs_the_mark(text: str, said: str, note: str) -> None:
    found = parse_marks(f"Hello {text}")
    assert found.text == f"Hello {said}"
    assert any(note in one for one in found.notes), found.notes


def test_the_end_of_a_direction_ends_its_style() -> None:
    found = parse_marks("[happy]Great.[/happy] Bye.")
    assert [(run.start, run.styles) for run in found.runs] == [(0, ("happy",)), (6, ())]


def test_a_pause_needs_no_number() -> None:
    assert parse_marks("So [pause] yes").marks == (PauseMark(3, USUAL_PAUSE_S),)
    assert parse_marks("So [pause: 0.5 sec] yes").marks == (PauseMark(3, 0.5),)


def test_marks_over_two_sentences_lose_none() -> None:
    found = parse_marks("[style:delighted]Great. It works.[/style] Bye now.")
    assert (found.text, found.notes) == ("Great. It works. Bye now.", ())
    assert found.runs == (StyleRun(0, ("delighted",)), StyleRun(16))


def ssml(inside: str, more: str = "") -> MarkedText:
    return parse_marks(f"<speak{more}>{inside}</speak>")


def test_ssml_is_equivalent_to_marks() -> None:
    assert ssml('Hi <break time="400ms"/>there <express-as style="cross">you</express-as>') == parse_marks(
        "Hi [pause 0.4]there [style:cross]you[/style]"
    )


def test_every_element() -> None:
    found = parse_marks(
        '\ufeff <?xml version="1.0" encoding="UTF-16"?>\n<speak version="1.1" '
        'xmlns="http://www.w3.org/2001/10/synthesis" xml:lang="en-US"><p><s>One &amp; <sub alias="two">2</sub></s></p>'
        "<!-- no --><![CDATA[<4]]>"
        '<prosody rate="slow" volume="+6dB"><prosody rate="120%">four</prosody></prosody>'
        '<emphasis level="strong">five</emphasis><mark name="here"/><break strength="strong"/><break time="1s"/>'
        '<mstts:express-as style="sad">six</mstts:express-as></speak>'
    )
    assert found.text.split() == ["One", "&", "two", "<4", "four", "five", "six"]
    at = {word: found.text.index(f" {word}") for word in ("four", "five", "six")}
    assert found.marks == (GestureMark(at["five"], size=1.0), NameMark(at["six"], "here"), PauseMark(at["six"], 1.7))
    assert [run.start for run in found.runs] == [0, at["four"], at["five"], at["six"], len(found.text)]
    assert found.runs[1].rate == pytest.approx(0.75 * 1.2)
    assert found.runs[1].volume == pytest.approx(1.995, abs=0.01)
    assert (found.runs[2].tone, found.runs[3].styles) == (Tone(emphasis=1.0), ("sad",))
    assert found.runs[2].loudness == pytest.approx(10 ** (3 / 20))
    assert found.language == "en-US"


@pytest.mark.parametrize(
    ("written", "rate"),
    [("80%", 0.8), ("+20%", 1.2), ("-20%", 0.8), ("1.5", 1.5), ("x-slow", 0.5), ("medium", 1.0)],
)
def test_speeds(written: str, rate: float) -> None:
    assert ssml(f'<prosody rate="{written}">a</prosody>').runs[0].rate == pytest.approx(rate)


@pytest.mark.parametrize(
    ("inside", "reason"),
    [
        ("a\n\n<p>", "not well-formed: mismatched tag in line 3; close <p>"),
        ("2 < 3", "the SSML is not well-formed: invalid token in line 1; correct that line"),
        ("\ud800", "unpaired surrogate"),
        ("<p>" * 40 + "</p>" * 40, "is nested in 33 others"),
        ("a\nb\n<p>c</s>", "mismatched tag in line 3; close <p>"),
    ],
)
def test_ssml_that_is_no_tree_is_refused(inside: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        ssml(inside)


@pytest.mark.parametrize(
    ("inside", "reason"),
    [
        ("<break time='soon'/>", "cannot read the time 'soon' of a <break>"),
        ("<break strength='long'/>", "no strength 'long'; use none, x-weak"),
        ("<mstts:silence type='Leading'/>", "cannot read the time '' of a <mstts:silence>"),
        ("<break>a</break>", "<break> cannot contain text; 'a' is spoken behind it"),
        ("<break><p>a</p></break>", "<p> within <break> is not followed"),
        ("<break><emphasis>a</emphasis></break>", "<emphasis> within <break> is not followed"),
        ("<emphasis><prosody rate='x'>a</prosody></emphasis>", "<prosody> is not followed: there is no rate 'x'"),
        ("<emphasis level='loud'>a</emphasis>", "<emphasis> has no level 'loud'; use strong"),
        ("<prosody pitch='higher'>a</prosody>", "cannot read the pitch 'higher'; use semitones"),
        ("<prosody pitch='+2'>a</prosody>", "pitch '.2' has no unit; use semitones"),
        ("<prosody pitch='-100%'>a</prosody>", "a pitch of '-100%' leaves none"),
        ("<prosody range='wide'>a</prosody>", "no range 'wide'; use x-low"),
        ("<prosody contour='up'>a</prosody>", r"cannot read the contour 'up'; write up to 100 points"),
        ("<prosody contour='(0%,+20Hz) up'>a</prosody>", "cannot read the contour"),
        ("<prosody duration='long'>a</prosody>", "cannot read the time 'long' of a <prosody>"),
        ("<prosody rate='warp'>a</prosody>", "no rate 'warp'; use x-slow"),
        ("<prosody volume='11st'>a</prosody>", r"cannot read the volume '11st'; use decibels such as \+6dB"),
        ("<mark/>", "a <mark> needs a name"),
        ("<sub>a</sub>", "a <sub> needs an alias"),
        ("<express-as>a</express-as>", "<express-as> needs a style"),
        ("<express-as style='a'/>", "contains no text"),
    ],
)
def test_an_element_that_is_not_understood_costs_the_element(inside: str, reason: str) -> None:
    found = ssml(f"b\n\n{inside} c")
    said = "bac" if ">a<" in inside else "bc"
    assert "".join(found.text.split()) == said
    assert any(re.match(rf"SSML, line 3: .*{reason}", note) for note in found.notes), found.notes
    assert found.runs[-1].is_spoken_as(StyleRun(0))


def test_marks_of_ssml_are_gestures_by_their_name() -> None:
    marks = [f'<mark name="gesture:{name}"/>' for name in ("look at left 20 2s", "nod 9", "so")]
    found = ssml(f"a {marks[0]}b {marks[1]}c {marks[2]}d")
    assert found.marks == (GestureMark(2, "look_at", 1.0, 2.0, None, 20.0), NameMark(6, "gesture:so"))
    assert "<mark> is not followed: the size of the gesture nod must lie" in found.notes[0]


def test_marks_and_emoji_within_ssml_are_silent() -> None:
    found = ssml("One [nod] two \U0001f622. [style:a]Three[/style] [laughs] four")
    assert found.text.split() == ["One", "two", ".", "Three", "four"]
    assert "marks in square brackets are left out of SSML" in found.notes[0]
    assert [mark.name for mark in found.marks if isinstance(mark, GestureMark)] == ["frown", "laugh"]


@pytest.mark.parametrize(
    "head",
    [
        f'<!DOCTYPE speak [<!ENTITY l0 "lol">{BILLION}]>',
        '<!DOCTYPE speak [<!ENTITY l9 SYSTEM "file:///etc/passwd">]>',
        '<?xml version="1.0"?><!DOCTYPE speak SYSTEM "http://example.org/x.dtd" [<!ATTLIST s a CDATA "b">]>',
    ],
)
def test_nothing_is_expanded(head: str) -> None:
    with pytest.raises(InputError, match="declarations in a document type are not supported; remove"):
        parse_marks(f"{head}<speak>&l9;</speak>")


def test_a_document_type_without_declarations_is_not_fetched() -> None:
    found = parse_marks('<?xml version="1.0"?><!DOCTYPE speak SYSTEM "http://example.org/x.dtd"><speak>&l9; a</speak>')
    assert (found.text, found.notes) == ("&l9; a", ())


@pytest.mark.parametrize("piece", ["[", "[nod]", "[pause 0]", "[style:a]b[/style]", "[pause 1]c", "a [b ", "word "])
def test_a_megabyte_of_marks_is_read_at_once(piece: str) -> None:
    begin = time.perf_counter()
    parse_marks(piece * (1_000_000 // len(piece)))
    assert time.perf_counter() - begin < 10


def test_a_megabyte_of_ssml_is_read_at_once() -> None:
    begin = time.perf_counter()
    found = ssml('<p>Hello <break time="1s"/> there.</p>' * 25_000)
    assert len(found.marks) == 25_000
    assert time.perf_counter() - begin < 10


@pytest.mark.parametrize(
    ("markup", "text", "sentences"),
    [
        ("auto", "[style:a]One is. Two is.[/style] Three is.", ["[style:a]One is. Two is.[/style]", "Three is."]),
        ("auto", "<speak>One is. Two is.</speak>", ["<speak>One is. Two is.</speak>"]),
        ("auto", "One <b>is. Two is.", ["One <b>is.", "Two is."]),
        (
            "ssml",
            "One is. <prosody rate='80%'>Two is. Three is.</prosody> Four <break/> is. A <sub alias='e. F g'>x</sub>.",
            [
                "One is.", "<prosody rate='80%'>Two is. Three is.</prosody> Four <break/> is.",
                "A <sub alias='e. F g'>x</sub>.",
            ],
        ),
        ("plain", "[style:a]One is. Two is.", ["[style:a]One is.", "Two is."]),
        ("ssml", "<p>One is. Two is.", ["<p>One is. Two is."]),
    ],
)  # fmt: skip
def test_sentences_of_growing_text_stay_together_within_marks(markup: str, text: str, sentences: list[str]) -> None:
    growing = GrowingText("en-us", markup)
    found = [sentence for letter in text for sentence in growing.add(letter)]
    assert [*found, *growing.flush()] == sentences


def test_growing_text_waits_for_no_end_that_does_not_come() -> None:
    growing = GrowingText("en-us", "ssml")
    found = [sentence for _ in range(600) for sentence in growing.add("<p>This is a sentence. ")]
    assert found
    assert max(map(len, found)) < MAX_HELD_CHARACTERS + 100
