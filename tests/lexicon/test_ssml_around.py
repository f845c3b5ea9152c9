"""SSML of other services: what is spoken around, and the notes on it."""

import time

import pytest

from lexicon.errors import InputError
from lexicon.marked_text import MAX_NOTES, MarkedText, NameMark, PauseMark
from lexicon.ssml_leniency import nearest_style, with_plain_entities
from lexicon.text_marks import parse_marks
from tts2face.models.palette_file import load_palette
from tts2face.request import Request
from tts2face.session.marked_styles import with_styles_of
from tts2face.session.prepared import prepare


def ssml(inside: str, language: str = "en-us") -> MarkedText:
    return parse_marks(f"<speak>{inside}</speak>", language)


@pytest.mark.parametrize(
    ("inside", "text", "note"),
    [
        ('<lexicon uri="http://example.org/x.pls"/>a', "a", "<lexicon> is not loaded; give pronunciations"),
        ('<meta name="x" content="y"/>a', "a", "<meta> is not read"),
        ("<metadata><rdf:RDF>no <b>no</b></rdf:RDF></metadata>a", "a", "<metadata> is not read"),
        (
            "<audio src='x.wav'>bell<desc>a bell</desc></audio>",
            "bell",
            "the sound of <audio> is not played; the text in it",
        ),
        ("<lookup ref='x'>a</lookup>", "a", "<lookup> is not followed; its text is spoken"),
        ("<b>a</b>", "a", "<b> is not supported; its text is spoken"),
        ('<amazon:effect name="whispered">a</amazon:effect>', "a", "<amazon:effect> is not supported"),
        ('<amazon:domain name="news">a <prosody rate="80%">b</prosody></amazon:domain>', "a b", "<amazon:domain> is"),
        ("<mstts:ttsembedding speakerProfileId='1'>a</mstts:ttsembedding>", "a", "<mstts:ttsembedding> is not"),
        ('<mstts:backgroundaudio src="x"/>a', "a", "the sound of <mstts:backgroundaudio> is not played"),
        ('<mstts:audioduration value="20s"/>a', "a", "<mstts:audioduration> is not followed; <prosody duration>"),
        ('<mstts:silence type="Sentenceboundary" value="2s"/>a', "a", "of the type 'Sentenceboundary' is not followed"),
        ("<par><media><speak2>a</speak2></media></par>", "a", "<par> is not supported"),
        ("<media><speak>a</speak></media>", "a", "a <speak> within another one is read as its text"),
        ('<break size="1"/>a', "a", "the attribute size of <break> is not followed"),
        ('<express-as style="neutral" styledegree="2">a</express-as>', "a", "attribute styledegree of <express-as> is"),
        ('<prosody amazon:max-duration="2s">a</prosody>', "a", "amazon:max-duration of <prosody> is not followed"),
        ('<phoneme alphabet="x-sampa" ph="k">a</phoneme>', "a", "alphabet 'x-sampa' of <phoneme> is not read in en-us"),
        (
            '<say-as interpret-as="date">tomorrow</say-as>',
            "tomorrow",
            "cannot read 'tomorrow' as a date; write it as in",
        ),
        ('<say-as interpret-as="cardinal">12 men</say-as>', "12 men", "1,234; it is spoken as written"),
        ('<say-as interpret-as="date" format="q">1/2</say-as>', "1/2", "there is no format 'q' of dates; use mdy"),
        ('<say-as interpret-as="interjection">wow</say-as>', "wow", "the kind 'interjection' of <say-as> is not read"),
        (
            '<voice name="en-US-JennyNeural">a</voice>',
            "a",
            "there is no voice 'en-US-JennyNeural', another one speaks; ",
        ),
        ('<voice name="/etc/x.onnx">a</voice>', "a", "there is no voice '/etc/x.onnx'"),
        (
            '<lang xml:lang="tlh">a</lang>',
            "a",
            "there is no language 'tlh'; its words are spoken in the language around",
        ),
        ('<s xml:lang="tlh">a</s>', "a", "there is no language 'tlh'"),
        ('<voice xml:lang="tlh">a</voice>', "a", "there is no language 'tlh'"),
        ('<voice gender="robot">a</voice>', "a", "there is no gender 'robot' of voices"),
        ('<voice age="9">a</voice>', "a", "the attribute age of <voice> is not followed"),
        ("<?php a?>b", "b", r"the instruction <?php?> is not followed"),
    ],
)
def test_what_is_not_followed_is_spoken_around_with_a_note(inside: str, text: str, note: str) -> None:
    found = ssml(f"\n{inside} end")
    assert found.text.split() == [*text.split(), "end"]
    assert any(noted.startswith("SSML, line 2: ") and note in noted for noted in found.notes), found.notes


@pytest.mark.parametrize(
    "inside",
    [
        '<p xml:id="x"><s xml:id="y">a</s></p>',
        '<lang xml:lang="en" onlangfailure="ignore">a</lang>',
        "<w role='x'>a</w>",
    ],
)
def test_attributes_without_an_effect_need_no_note(inside: str) -> None:
    assert ssml(inside).notes == ()


@pytest.mark.parametrize(
    ("inside", "note", "rate", "volume", "pitch", "range_"),
    [
        ("<prosody rate='300%'>a</prosody>", "the speaking rate within <prosody> is 2, the limit, not 3", 2, 1, 0, 1),
        (
            "<prosody rate='slow'><prosody rate='x-slow'>a</prosody></prosody>",
            "is 0.5, the limit, not 0.375",
            0.5,
            1,
            0,
            1,
        ),
        ("<prosody volume='+20dB'>a</prosody>", "the volume within <prosody> is 2, the limit, not 10", 1, 2, 0, 1),
        (
            "<prosody pitch='+900Hz'>a</prosody>",
            "pitch within <prosody> is 12 semitones, the limit, not 32",
            1,
            1,
            12,
            1,
        ),
        ("<prosody pitch='-40st' range='300%'>a</prosody>", "pitch within <prosody> is -12 semitones", 1, 1, -12, 2),
    ],
)
def test_prosody_beyond_the_limits_lies_on_them(
    inside: str, note: str, rate: float, volume: float, pitch: float, range_: float
) -> None:
    found = ssml(inside)
    run = found.runs[0]
    assert (run.rate, run.volume, run.tone.pitch, run.tone.range) == (rate, volume, pitch, range_)
    assert any(note in noted for noted in found.notes), found.notes


def test_units_of_time_may_be_capitals_and_arpabet_has_its_names() -> None:
    found = ssml("<break time='1S'/>a<break time='20MS'/> <phoneme alphabet='cmu-arpabet' ph='K AE1 T'>b</phoneme>")
    assert [mark.seconds for mark in found.marks if isinstance(mark, PauseMark)] == [1.0, 0.02]
    assert not found.notes


def test_silence_beyond_the_limit_lies_on_it() -> None:
    found = ssml("a<break time='8s'/><break time='12s'/><break/> <break time='1s'/>b")
    assert found.marks == (PauseMark(1, 10.0),)
    assert found.notes[0] == "SSML, line 1: silence at one place is 10 s, the limit, not 20"


def test_words_stand_apart() -> None:
    assert ssml("<w>one</w><token>two</token>, <w>three</w>'s").text == "one two, three's"


@pytest.mark.parametrize(
    ("inside", "text"),
    [
        ('<prosody rate="80%">How are you</prosody><express-as style="sad">Great</express-as>', "How are you Great"),
        ('Going?<prosody pitch="low">Yes.</prosody><lang xml:lang="fr">Oui</lang>', "Going? Yes. Oui"),
        ("<x>(one)</x><y>two</y>, <y>three</y>.", "(one) two, three."),
        ('cup<break/>board, <sub alias="et cetera">etc</sub>and', "cup board, et cetera and"),
        ('5<sub alias="kilometres">km</sub>of, <sub alias="unit">U</sub>s', "5 kilometres of, units"),
        ('year<say-as interpret-as="digits">12</say-as>and <phoneme ph="k">x</phoneme>y', "year one two and x y"),
        ("so <emphasis>really</emphasis><emphasis>good</emphasis>", "so really good"),
        ("un<emphasis>believ</emphasis>able <w>over<x>whelm</x>ing</w>", "unbelievable overwhelming"),
        ("<a>「はい」</a><b>これは</b><c>いい</c>", "「はい」これはいい"),
        ('<sub alias="three">3</sub>.<b>14</b>, "<b>so</b>", <b>$</b><b>5</b>', 'three.14, "so", $5'),
    ],
)
def test_words_of_two_elements_are_two(inside: str, text: str) -> None:
    assert ssml(inside).text == text


def test_a_word_may_have_a_language() -> None:
    found = ssml('say <w xml:lang="de">Tag</w> now')
    assert [run.language for run in found.runs] == [None, "de", None]


def test_the_language_of_a_voice_that_is_missing_is_taken_from_its_name() -> None:
    found = ssml('Hi. <voice name="de-DE-KatjaNeural">Guten Tag.</voice>')
    assert [run.language for run in found.runs] == [None, "de", None]
    assert "another one speaks; its words are taken for de by its name; there are heart, " in found.notes[0]


def test_silence_and_bookmarks_of_vendors() -> None:
    found = ssml(
        '<voice name="heart"><mstts:silence type="Leading-exact" value="200ms"/>'
        '<mstts:silence type="tailing" value="1s"/>a <bookmark mark="x"/>b</voice> c'
    )
    assert found.marks == (PauseMark(0, 0.2), NameMark(2, "x"), PauseMark(3, 1.0))
    assert found.notes == ()


@pytest.mark.parametrize(
    ("source", "text"),
    [
        ("Q&A", "Q&A"),
        ("AT&T &amp; more", "AT&T & more"),
        ("10&nbsp;km &ndash; far", "10\xa0km – far"),
        ("&lol;", "&lol;"),
        ("caf&eacute; &LT;b&GT;", "café <b>"),
        ("<![CDATA[a &nbsp; & b]]>", "a &nbsp; & b"),
        ("a<!-- &x; -->b", "ab"),
        ("&#65;&#x42;", "AB"),
        ('<sub alias="R&D &QUOT;x&QUOT;">rd</sub>', 'R&D "x"'),
    ],
)
def test_entities_of_html_and_bare_ampersands_are_read(source: str, text: str) -> None:
    assert ssml(source).text == text


@pytest.mark.parametrize("piece", ["&", "<![CDATA[", "<!--", "&nbsp;", "&a", "<![CDATA[a]]>"])
def test_a_megabyte_of_entities_is_read_at_once(piece: str) -> None:
    begin = time.perf_counter()
    with_plain_entities(piece * (1_000_000 // len(piece)))
    assert time.perf_counter() - begin < 10


def test_comments_may_stand_before_a_document() -> None:
    assert parse_marks("<!-- a - b -->\n<!----> <speak>Hi<!-- c -->.</speak>").text == "Hi."
    assert parse_marks("<!-- a --> Hi.").text == " Hi."


def test_notes_are_few() -> None:
    found = ssml("".join(f"<x{n}>a</x{n}><x1>b</x1>" for n in range(100)))
    assert len(found.notes) == MAX_NOTES == len(set(found.notes))


def test_styles_of_services_are_the_nearest_of_the_palette() -> None:
    names = load_palette("starter").names
    for name in ("cheerful", "Angry", "sad", "newscast-casual", "GoodNews", "disgruntled"):
        assert nearest_style(name) in names
    assert nearest_style("delighted") is nearest_style("mine") is None
    found = ssml(
        '<mstts:express-as style="cheerful">a</mstts:express-as> <amazon:emotion name="excited">b</amazon:emotion>'
    )
    assert [run.styles for run in found.runs] == [("cheerful",), (), ("excited",), ()]
    assert found.notes[0].endswith("the style cheerful is delighted here, unless the palette has one of its own")


def test_styles_of_services_that_are_not_known_are_spoken_around_unless_the_palette_has_them() -> None:
    text = '<mstts:express-as style="santa">a</mstts:express-as> <express-as style="happy">b</express-as>'
    prepared = prepare(Request(text=f"<speak>{text}</speak>"))
    assert "the style santa of <mstts:express-as> is not followed, unless the palette" in prepared.notes[0]
    for names, styles in ((["delighted"], {(), ("delighted",)}), (["santa", "happy"], {(), ("santa",), ("happy",)})):
        assert {run.styles for run in with_styles_of(prepared.text, names).runs} == styles
        assert with_styles_of(prepared.text, names).notes == prepared.notes
    own = prepare(Request(text='<speak><express-as style="santa">a</express-as></speak>'))
    found = with_styles_of(own.text, ["delighted"])
    assert found.runs[0].styles == ()
    assert found.notes == ("there is no style 'santa' in the palette; its words keep the style around them",)
    assert with_styles_of(found, ["delighted"]).notes == found.notes


def test_a_fragment_is_ssml_where_the_markup_says_so() -> None:
    whole, fragment = ssml('Hi <break time="1s"/>there.'), parse_marks('Hi <break time="1s"/>there.', markup="ssml")
    assert fragment == whole == parse_marks('<speak>Hi <break time="1s"/>there.</speak>', markup="ssml")
    assert parse_marks("just words & more", markup="ssml").text == "just words & more"
    assert parse_marks('Hi <break time="1s"/>there.').marks == whole.marks


@pytest.mark.parametrize("text", ["<speak>a</speak>", "[pause 9] NOT *so*", "[style:", "a"])
def test_a_plain_text_has_no_marks(text: str) -> None:
    assert parse_marks(text, markup="plain") == MarkedText(text)


def test_an_unknown_markup_is_refused() -> None:
    with pytest.raises(InputError, match="there is no markup 'html'; choose auto, plain, ssml, llm"):
        parse_marks("a", markup="html")


# As documents for these services look.
AZURE = """<speak version="1.0" xmlns="http://www.w3.org/2001/10/synthesis" xmlns:mstts="https://www.w3.org/2001/mstts"
  xml:lang="en-US"><!-- one --><mstts:backgroundaudio src="x.wav" volume="0.7" fadein="3000" fadeout="4000"/>
  <voice name="en-US-AvaMultilingualNeural" effect="eq_car"><mstts:silence type="Sentenceboundary" value="200ms"/>
  <mstts:viseme type="redlips_front"/><mstts:express-as style="cheerful" styledegree="2" role="YoungAdultFemale">
  <prosody rate="+30.00%" pitch="+5%" contour="(60%,-60%) (100%,+80%)" range="x-low" volume="+20.00%">Yes!</prosody>
  </mstts:express-as><say-as interpret-as="name">Ed</say-as> <phoneme alphabet="sapi" ph="iy">E</phoneme>
  <bookmark mark="flower"/><mstts:audioduration value="20s"/></voice></speak>"""
AMAZON = """<speak><amazon:domain name="conversational">Hi <amazon:effect phonation="soft">there</amazon:effect>
  <amazon:breath duration="medium" volume="x-loud"/></amazon:domain><amazon:auto-breaths frequency="low">Okay.
  </amazon:auto-breaths> <w role="amazon:VB">read</w> <say-as interpret-as="interjection">wow</say-as> AT&T
  <amazon:emotion name="excited" intensity="medium">yes</amazon:emotion></speak>"""
GOOGLE = """<speak><audio src="x.mp3"><desc>cat</desc>Here is</audio><par><media xml:id="q" begin="0.5s"><speak>who
  asks.</speak></media></par> <google:style name="lively">So happy!</google:style>
  <voice gender="female" required="gender" ordering="gender language">I</voice></speak>"""
STANDARD = """<?xml version="1.0"?><!DOCTYPE speak PUBLIC "-//W3C//DTD SYNTHESIS 1.0//EN"
  "http://www.w3.org/synthesis.dtd"><speak version="1.1" xml:base="http://x" xml:lang="en-US"
  xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="a b"><metadata><r:RDF xmlns:r="x"><r:D
  dc:Title="H"><dc:C>no</dc:C></r:D></r:RDF></metadata><lexicon uri="x.pls" xml:id="pls"/><lookup ref="pls">one</lookup>
  <p><s xml:id="s1"><token>two</token> <prosody contour="(0%,+20Hz) (10%,+30%) (40%,+10Hz)">three</prosody></s></p>
  <voice gender="female" age="6" variant="2" languages="en:en fr:fr">four</voice></speak>"""


@pytest.mark.parametrize(
    ("document", "words", "n_notes"),
    [
        (AZURE, "Yes! Ed E", 10),
        (AMAZON, "Hi there Okay. read wow AT&T yes", 7),
        (GOOGLE, "Here is who asks. So happy! I", 6),
        (STANDARD, "one two three four", 5),
    ],
)
def test_documents_of_services_are_spoken(document: str, words: str, n_notes: int) -> None:
    found = parse_marks(document)
    assert " ".join(found.text.split()) == words
    assert len(found.notes) == n_notes, found.notes
