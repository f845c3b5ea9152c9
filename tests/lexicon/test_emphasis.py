"""Emphasis that is typed: capitals, asterisks, and what is neither."""

import time

import pytest

from lexicon.given_phones import pronounce_words
from lexicon.marked_text import GestureMark
from lexicon.sentences import split_sentences
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import parse_marks


def emphasised(text: str, language: str = "en-us") -> list[tuple[str, float]]:
    found = parse_marks(text, language)
    ends = [*(run.start for run in found.runs[1:]), len(found.text)]
    return [
        (found.text[run.start : end], run.tone.emphasis)
        for run, end in zip(found.runs, ends, strict=True)
        if run.tone.emphasis
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("It is NOT here.", ["not"]),
        ("That is SO COOL and VERY bad.", ["so cool", "very"]),
        ("NEVER do that. ALWAYS ask.", ["Never", "Always"]),
        ("I said no! Not now, not EVER.", ["ever"]),
        ("Don't you DARE, I DON'T like it.", ["dare", "don't"]),
        ("I *DID* it, *it is SAD* for *NASA*.", ["did", "it is sad", "NASA"]),
        ("I DID it, oh my GOD, it is SAD. I AM here.", ["did", "god", "sad", "am"]),
        ("She *looks* well, and it *turns* out that he *takes* it.", ["looks", "turns", "takes"]),
        ("WHO did that? WE did.", ["Who", "We"]),
        ("That is SOOO good and COOOL, YESSS!", ["sooo", "coool", "yesss"]),
        ("It is *not* here, **really** not, ***ever***.", ["not", "really", "ever"]),
        ("She paid *$5* for *it*.", ["$5", "it"]),
        ('"*Please*," he said (*slowly now*).', ["Please", "slowly now"]),
    ],
)
def test_words_are_emphasised(text: str, words: list[str]) -> None:
    assert [word for word, _ in emphasised(text)] == words


@pytest.mark.parametrize(
    "text",
    [
        "NASA and the FBI agreed.",
        "NATO, OPEC and the WHO met in the US.",
        "JPEG, PNG and GIF files, ASAP, FYI, AAA, WWW and XXX.",
        "The GPU has VRAM for CUDA, HTTP 500, GPT-4o, AC/DC, U.S., R&D and A4.",
        "At 5 AM or 10 PM, 12 IN wide, in Portland, OR 97201, and Columbus, OH.",
        "Henry VIII, King Charles III and Pope Leo XIV met.",
        "MAN: (whispering) get down",
        "WARNING: do it now",
        "[EMOTION: angry] Stop that.",
        "PLEASE READ THIS BEFORE YOU START.",
        "Compute 3 * 4 * 5, or 2*3*4, f*ck it.",
        "*smiles warmly* It's good to see you. *sighs deeply* *winks* *nervously*",
        "* one\n* two\n*args and **kwargs, terms* and conditions*",
        "export PATH=$PATH for C:\\USERS\\BOB",
        "Yes* (*terms apply), no* (*void)",
        "The AM radio, and find . -name '*.log' -o -name '*.tmp'",
        "*takes a deep breath* Okay. *walks in* Hello! *clears throat* I, well, *looks up* agree.",
        "Rated 5* and 4* hotels",
        "He's right behind me. *gulps nervously* *leaning in*",
    ],
)
def test_what_is_no_emphasis(text: str) -> None:
    assert emphasised(text) == []


def test_a_whole_sentence_between_asterisks_is_emphasised_less() -> None:
    assert emphasised("*I really do mean this now* ok") == [("I really do mean this now", 0.6)]


def test_other_languages_emphasise_common_and_long_words() -> None:
    assert emphasised("Das ist NICHT gut, sagt die NATO, UNGLAUBLICH.", "de") == [("NICHT", 1.0), ("UNGLAUBLICH", 1.0)]
    assert emphasised("Il dit JAMAIS à Louis XVIII et à l'UNESCO.", "fr-fr") == [("JAMAIS", 1.0)]
    assert emphasised("Das ist *sehr* gut.", "de") == [("sehr", 1.0)]


@pytest.mark.needs("pyopenjtalk")
def test_japanese_emphasises_accent_phrases() -> None:
    assert emphasised("これは*とても*いい。", "ja") == [("とても", 1.0)]
    (sentence,) = split_sentences(parse_marks("これは*とても*いい。", "ja"), "ja")
    assert sentence.utterances[0].source == "これはとてもいい。"
    assert [word.text for word in sentence.utterances[0].words if word.tone.emphasis] == ["とても"]


def test_in_writing_without_spaces_asterisks_are_left_out() -> None:
    assert emphasised("这*很*好。", "cmn") == [("很", 1.0)]
    (sentence,) = split_sentences(parse_marks("这*很*好。", "cmn"), "cmn")
    assert sentence.utterances[0].source == "这很好。"
    assert not any(word.tone.emphasis for word in sentence.utterances[0].words)


def test_emphasis_nods_and_a_mark_within_it_ends_it() -> None:
    found = parse_marks("It is *not* here, *so [pause 1] there*.")
    assert found.marks[0] == GestureMark(6, size=1.0)
    assert found.text == "It is not here, *so  there*."


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        ("I have *read* it, and the WIND is strong.", "I have read it, and the wind is strong."),
        ("It is NOT so, said *Dr.* Jones of **25** men.", "It is not so, said Dr. Jones of 25 men."),
        ("He SHED a *tear* for $5 million.", "He shed a tear for $5 million."),
    ],
)
def test_the_spoken_words_are_those_without_emphasis(written: str, plain: str) -> None:
    toned, even = (pronounce_marked(parse_marks(text)).words for text in (written, plain))
    assert [(word.text.lower(), word.phones, word.mark) for word in toned] == [
        (word.text.lower(), word.phones, word.mark) for word in even
    ]


def test_tones_come_to_the_words_that_are_spoken() -> None:
    text = (
        '<speak>On <emphasis>12/24/2020</emphasis> he paid <emphasis level="strong">$5</emphasis> million for '
        '<prosody pitch="+2st"><phoneme ph="kæt">x</phoneme> and y</prosody>.</speak>'
    )
    (sentence,) = split_sentences(parse_marks(text), "en-us")
    (phrase,) = sentence.utterances
    words = pronounce_words(phrase.words, "en-us")
    assert " ".join(word.text for word in words if word.tone.emphasis == 0.6) == (
        "December twenty-fourth twenty twenty"
    )
    assert [word.text for word in words if word.tone.emphasis == 1.0] == ["five"]
    assert [word.text for word in words if word.tone.pitch == 2.0] == ["x", "and", "y"]


def test_part_of_a_word_emphasises_the_whole() -> None:
    (sentence,) = split_sentences(parse_marks("<speak>un<emphasis>believ</emphasis>able day</speak>"), "en-us")
    assert [word.text for word in sentence.utterances[0].words if word.tone.emphasis] == ["unbelievable"]


def test_emphasis_divides_no_sentence_and_changes_no_other() -> None:
    first, second = split_sentences(parse_marks("It is *not* so. It is so."), "en-us")
    assert len(first.utterances) == len(second.utterances) == 1
    assert first.utterances[0].text == "It is not so."
    assert (bool(first.utterances[0].words), second.utterances[0].words) == (True, ())


@pytest.mark.parametrize("piece", ["*a", "*a* ", "NOT so ", "**", "A B ", "*a b* [nod]"])
def test_long_texts_of_emphasis_are_read_at_once(piece: str) -> None:
    begin = time.perf_counter()
    parse_marks(piece * (100_000 // len(piece)))
    assert time.perf_counter() - begin < 10
