"""Annotation files of ELAN, EXMARaLDA and CHAT: tiers, times that are missing, words without times."""

import pytest

from lexicon.errors import DataError

SLOTS = {"s0": 500, "s1": 1000, "s2": None, "s3": 2000, "s4": 2400, "s5": 2600}
WORD_TIER = """<TIER LINGUISTIC_TYPE_REF="w" TIER_ID="Anna-words" PARENT_REF="Anna">
{}</TIER>"""
ALIGNED = """<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="{0}" TIME_SLOT_REF1="{1}" TIME_SLOT_REF2="{2}">
<ANNOTATION_VALUE>{3}</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>"""
REF = """<ANNOTATION><REF_ANNOTATION ANNOTATION_ID="{0}" ANNOTATION_REF="{1}"{2}>
<ANNOTATION_VALUE>{3}</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION>"""
UTTERANCES = ALIGNED.format("a1", "s0", "s1", "bin red") + ALIGNED.format("a2", "s3", "s5", "now [laughs] seven")
EXB = """<?xml version="1.0" encoding="UTF-8"?>
<basic-transcription><head/><basic-body><common-timeline>
<tli id="T0" time="0.5"/><tli id="T1"/><tli id="T2" time="1.5"/><tli id="T3" time="2.0"/></common-timeline>
<tier id="T" speaker="A" category="en" type="a" display-name="A [en]">
<event start="T0" end="T3">three colours</event></tier>
<tier id="U" speaker="A" category="v" type="t" display-name="A [v]"><event start="T0" end="T1">bin </event>
<event start="T1" end="T2">red </event><event start="T2" end="T3">((laughs)) </event></tier>
</basic-body></basic-transcription>"""
CHA = """@UTF8
@Begin
@Participants:\tCHI Target_Child, MOT Mother
*CHI:\t<I want> [/] I want (.) the &=laughs dog [: doggy] xxx (be)cause it's gonna@x
\tgo . \x15500_2500\x15
%mor:\tpro|I
*MOT:\t&-uh no: .
*MOT:\t+" well done +... \x153000_4000\x15
@End
"""


def eaf(tiers: str, header: str = "") -> str:
    slots = "".join(
        f'<TIME_SLOT TIME_SLOT_ID="{name}"/>'
        if value is None
        else f'<TIME_SLOT TIME_SLOT_ID="{name}" TIME_VALUE="{value}"/>'
        for name, value in SLOTS.items()
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<ANNOTATION_DOCUMENT AUTHOR="" FORMAT="3.0" VERSION="3.0"><HEADER MEDIA_FILE="" TIME_UNITS="milliseconds">{header}
</HEADER><TIME_ORDER>{slots}</TIME_ORDER>{tiers}</ANNOTATION_DOCUMENT>"""


def tier(content: str, name: str = "Anna") -> str:
    return f'<TIER LINGUISTIC_TYPE_REF="default-lt" TIER_ID="{name}">{content}</TIER>'


def test_utterances_share_their_time_among_their_words(read):
    found = read("v.eaf", eaf(tier(UTTERANCES)))
    assert found.text == "bin red now seven"
    assert [found.words[at].start for at in (0, 2)] == [0.5, 2.0]
    assert [found.words[at].end for at in (1, 3)] == [1.0, 2.6]
    assert found.words[0].end == found.words[1].start
    assert found.notes == (
        "silence and noise in v.eaf, not words: [laughs] (1)",
        "v.eaf: 2 utterances share their times among their words by nominal lengths, as the words have no times of "
        "their own",
    )


def test_words_that_refer_to_an_utterance_share_its_time_in_their_order(read):
    parts = REF.format("b2", "a1", ' PREVIOUS_ANNOTATION="b1"', "red") + REF.format("b1", "a1", "", "bin")
    parts += REF.format("b3", "a2", "", "now") + REF.format("b4", "a2", ' PREVIOUS_ANNOTATION="b3"', "seven")
    found = read("v.eaf", eaf(WORD_TIER.format(parts) + tier(UTTERANCES)))
    assert found.text == "bin red now seven"
    assert (found.words[0].start, found.words[1].end, found.words[3].end) == (0.5, 1.0, 2.6)
    assert found.words[2].end == found.words[3].start < 2.3
    assert found.notes[0] == (
        "the words of v.eaf are those of its tier 'Anna-words'; 'Anna' also has words; --tier names another"
    )
    assert found.notes[1].startswith("words of 2 utterances in v.eaf have no times of their own and share theirs")


def test_slots_without_a_time_are_interpolated(read):
    words = ALIGNED.format("a1", "s1", "s2", "bin") + ALIGNED.format("a2", "s2", "s3", "red")
    found = read("v.eaf", eaf(tier(words, "words")))
    assert [(word.start, word.end) for word in found.words] == [(1.0, 1.5), (1.5, 2.0)]
    assert found.notes == ("1 times that v.eaf lacks are interpolated between others",)


def test_the_offset_of_a_recording_is_counted(read):
    media = '<MEDIA_DESCRIPTOR MEDIA_URL="file:///x/v.mp4" TIME_ORIGIN="{}"/>'
    others = media.format(7000).replace("v.mp4", "w.mp4") + media.format(1500)
    found = read("v.eaf", eaf(tier(UTTERANCES), others))
    assert found.words[0].start == 2.0
    assert found.notes[0] == "times of v.eaf are moved by 1.5 s, the offset of its recording in ELAN"


def test_a_named_tier_of_elan(read):
    two = tier(ALIGNED.format("a1", "s0", "s1", "bin"), "Anna") + tier(ALIGNED.format("a2", "s3", "s4", "now"), "Ben")
    assert read("v.eaf", eaf(two)).text == "bin"
    assert read("v.eaf", eaf(two), "Ben").text == "now"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("<!DOCTYPE x><ANNOTATION_DOCUMENT/>", "has a document type"),
        ("<ANNOTATION_DOCUMENT>", "is no XML"),
        ("<html/>", "is no file of ELAN"),
        (eaf(""), "contains no word"),
        (eaf("").replace('"500"', '"x"'), "has the time 'x', which is no number"),
    ],
)
def test_other_xml_is_refused(content, reason, read):
    with pytest.raises(DataError, match=reason):
        read("v.eaf", content)


def test_exmaralda_gives_the_transcription(read):
    found = read("v.exb", EXB)
    assert [(word.start, word.end, word.text) for word in found.words] == [(0.5, 1.0, "bin"), (1.0, 1.5, "red")]
    assert found.notes[0] == (
        "the words of v.exb are those of its tier 'A [v]'; 'A [en]' is taken for phones or notes; --tier names another"
    )


def test_chat_gives_what_the_first_speaker_says(read):
    found = read("v.cha", CHA)
    assert found.text == "I want I want the dog cause it's gonna go"
    assert (found.words[0].start, found.words[-1].end) == (0.5, 2.5)
    assert "'MOT' also has words" in found.notes[0]
    mother = read("v.cha", CHA, "MOT")
    assert mother.text == "uh no well done"
    assert 2.5 < mother.words[0].start < mother.words[1].end < 3.0
    assert mother.notes[0] == "1 lines of v.cha without times lie between the others"


def test_chat_gives_the_times_of_its_words(read):
    words = "%wor:\tI \x15500_600\x15 want \x15600_900\x15 .\n"
    found = read("v.cha", CHA.replace("%mor:\tpro|I\n", words))
    assert [(word.start, word.end, word.text) for word in found.words] == [(0.5, 0.6, "I"), (0.6, 0.9, "want")]


@pytest.mark.parametrize(
    "bullet",
    [
        '\x15%snd:"rec.wav"_500_2500\x15',
        '\x15%mov:"a_b_1.mov"_500_2500\x15',
        '\x15%snd: "my rec" 500 2500\x15',
        "\x15%snd:rec_1_500_2500\x15",
        "•500_2500•",
        '•%snd:"rec"_500_2500•',
        "\x15500_2500-\x15",
        '\n%snd:\t"rec.wav" 500 2500',
        '\n%com:\tloud\n%mov:\t"rec 2.mov"_500_2500',
    ],
)
def test_chat_gives_times_in_every_form_of_bullets(bullet, read):
    found = read("v.cha", f"@Begin\n*CHI:\tat Merry_Christmas the bath+tub fell . {bullet}\n@End\n")
    assert found.text == "at Merry Christmas the bath tub fell"
    assert (found.words[0].start, found.words[-1].end) == (0.5, 2.5)


def test_compounds_of_timed_words_are_words(read):
    found = read("v.cha", "@Begin\n*CHI:\tto New_York .\n%wor:\tto •500_600• New_York •600_1400• .\n@End\n")
    assert [(word.text, word.start) for word in found.words][:2] == [("to", 0.5), ("New", 0.6)]
    assert (found.words[2].text, found.words[2].end) == ("York", 1.4)
