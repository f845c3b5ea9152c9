"""The tier of the words: by name, by content, and as named."""

import pytest

from lexicon.errors import DataError, InputError
from tests.interchange.transcripts.grids import PHONES, WORDS, relabelled, textgrid
from tts2face.interchange.transcripts.reader import read_transcript

SAID = "bin red by k seven now"
EMPTY = [(0, 2.95, "")]
SENTENCE = [(0, 0.5, ""), (0.5, 2.4, SAID), (2.4, 2.95, "")]
ARPABET = relabelled(PHONES, I="IH1", r="R", E="EH1", aI="AY1", eI="EY1")


@pytest.fixture
def read(tmp_path):
    def read_grid(tier=None, **tiers):
        (tmp_path / "v.TextGrid").write_text(textgrid(**tiers))
        return read_transcript(tmp_path / "v.TextGrid", tier)

    return read_grid


@pytest.mark.parametrize(
    "tiers",
    [
        {"PhonAlign": PHONES, "TokensAlign": WORDS},
        {"phones": ARPABET, "words": WORDS},
        {"phone": PHONES, "orthography": WORDS},
        {"MAU": PHONES, "KAN-MAU": relabelled(WORDS, seven="s E v n="), "ORT-MAU": WORDS},
        {"segments": PHONES, "Sentence": SENTENCE},
        {"IPA": PHONES, "transcript": SENTENCE},
        {"PhnTokensAlign": relabelled(WORDS, seven="s-E-v-@-n"), "Tokens": WORDS},
        {"Anna_-_words": EMPTY, "Anna_-_phones": EMPTY, "Ben_-_words": WORDS, "Ben_-_phones": PHONES},
        {"English": SENTENCE, "gloss": relabelled(WORDS, bin="container"), "notes": [(0, 2.95, "said twice")]},
        {"first": PHONES, "second": WORDS},
        {"x": ARPABET, "y": SENTENCE},
        {"text": PHONES, "b": WORDS},
        {"silences": [(0, 0.5, "silent"), (0.5, 2.4, "sounding"), (2.4, 2.95, "silent")], "Anna": SENTENCE},
        {"words": relabelled(WORDS, seven="am", bin="I", red="on", now="it", k="to")},
    ],
    ids=" ".join,
)
def test_the_tier_of_the_words_is_found(read, tiers):
    found = read(**tiers)
    assert found.text in {SAID, "I on by to am it"}
    assert [round(found.words[0].start, 3), round(found.words[-1].end, 3)] in ([0.55, 2.3], [0.5, 2.4])


def test_points_are_words_where_nothing_else_is(read, tmp_path):
    points = textgrid(x=[]).replace("IntervalTier", "TextTier").replace("intervals: size = 0", "points: size = 1")
    points += '        points [1]:\n            number = 0.5\n            mark = "container"\n'
    (tmp_path / "v.TextGrid").write_text(points)
    assert read_transcript(tmp_path / "v.TextGrid").text == "container"
    body = textgrid(y=WORDS).partition("item []:\n")[2]
    (tmp_path / "v.TextGrid").write_text(points.replace("size = 1\nitem", "size = 2\nitem") + body)
    assert read_transcript(tmp_path / "v.TextGrid").text == SAID
    with pytest.raises(DataError, match="has no tier with words"):
        read(z=[(0, 1, "silent"), (1, 2, "sounding")])


def test_the_choice_is_said_with_the_others(read):
    assert read(PhonAlign=PHONES, TokensAlign=WORDS).notes == (
        "the words of v.TextGrid are those of its tier 'TokensAlign'; 'PhonAlign' is taken for phones or notes; "
        "--tier names another",
    )
    two = read(Anna_words=WORDS, Ben_words=relabelled(WORDS, seven="two"))
    assert two.text == SAID
    assert two.notes[0].endswith("its tier 'Anna words'; 'Ben words' also has words; --tier names another")
    assert read(words=WORDS).notes == ()


def test_a_named_tier_is_taken(read):
    assert read("ben words", Anna_words=WORDS, Ben_words=relabelled(WORDS, seven="two")).text == "bin red by k two now"
    with pytest.raises(InputError, match=r"has no tier 'Bob'; it has 'Anna words' and 'x'$"):
        read("Bob", Anna_words=WORDS, x=EMPTY)


def test_phones_alone_are_refused_and_taken_on_request(read):
    with pytest.raises(DataError, match="has no tier with words; 'PhonAlign' seems to hold phones"):
        read(PhonAlign=PHONES, words=EMPTY)
    assert read("PhonAlign", PhonAlign=PHONES, words=EMPTY).text.startswith("b I n")


def test_labels_that_overlap_are_said(read):
    found = read(words=[(0, 1, "one"), (0.5, 1.5, "two"), (1.5, 2, "three")])
    assert found.text == "one two three"
    assert found.notes[0].startswith("1 labels of v.TextGrid begin before the one before them ends, the first 'two'")


def test_an_utterance_shares_its_time_among_its_words(read):
    found = read(Sentence=[(0.5, 2.5, "a seven")])
    assert found.notes[-1].startswith("v.TextGrid: 1 utterance shares its time among its words")
    first, second = found.words
    assert (first.start, first.end, second.end) == (0.5, second.start, 2.5)
    assert second.end - second.start > 2 * (first.end - first.start)
