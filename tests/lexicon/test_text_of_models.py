"""What people and language models write: what is said, what it shows, and for which words."""

import time

import pytest

from lexicon.errors import InputError
from lexicon.growing_text import GrowingText
from lexicon.markdown import MAX_TABLE_ROWS
from lexicon.marked_text import GestureMark, MarkedText, PauseMark
from lexicon.sentences import split_sentences
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import has_words, parse_marks
from tests.lexicon.marked_rows import rows


def words(text: str) -> str:
    return "".join(letter for letter in text.lower() if letter.isalnum())


def styles(marked: MarkedText) -> list[tuple[str, str]]:
    """Parts of a text with their innermost style."""
    ends = [*(run.start for run in marked.runs[1:]), len(marked.text)]
    return [
        (marked.text[run.start : end].strip(), run.styles[-1] if run.styles else "")
        for run, end in zip(marked.runs, ends, strict=True)
        if marked.text[run.start : end].strip()
    ]


def gestures(marked: MarkedText) -> list[tuple[str, str]]:
    """Each gesture with the word there."""
    return [
        (mark.name, (marked.text[mark.at :].split() or [""])[0])
        for mark in marked.marks
        if isinstance(mark, GestureMark)
    ]


@pytest.mark.parametrize("markup", ["auto", "llm"])
@pytest.mark.parametrize("row", rows(), ids=lambda row: row["text"][:30])
def test_what_is_said(row: dict[str, str], markup: str) -> None:
    said = words("".join(word.text for word in pronounce_marked(parse_marks(row["text"], markup=markup)).words))
    assert said in {words(answer) for answer in row["spoken"].split(" | ")}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("It works! 🎉 Next one.", [("It works!", "happy"), ("Next one.", "")]),
        ("🎉 It works. Next one.", [("It works.", "happy"), ("Next one.", "")]),
        ("[sad] One. Two.\n\nThree.", [("One. Two.", "sad"), ("Three.", "")]),
        ("[sad] One. [happy] Two. [neutral] Three.", [("One.", "sad"), ("Two.", "happy"), ("Three.", "neutral")]),
        ("One. Two? *gulps nervously*", [("One.", ""), ("Two?", "afraid")]),
        ("<sad>One.</sad> Two.", [("One.", "sad"), ("Two.", "")]),
        ("[happy]\n\nOne.\n\nTwo.", [("One.", "happy"), ("Two.", "")]),
        ("[sad] One 🎉. Two.", [("One .", "happy"), ("Two.", "sad")]),
        ("[happy] [style:annoyed]One[/style] two.", [("One", "annoyed"), ("two.", "happy")]),
    ],
)
def test_what_styles_apply_to(text: str, expected: list[tuple[str, str]]) -> None:
    assert styles(parse_marks(text)) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Well, <laugh> that was it <sigh> again.", [("laugh", "that"), ("sigh", "again.")]),
        ("Don't tell anyone 😉\nBye.", [("wink", "anyone")]),
        ("*nods* I see.", [("nod", "I")]),
        ("I see. *nods*", [("nod", "see.")]),
        ("👍🏽 Fine", [("nod", "Fine")]),
        ("*shakes head* No, *rolls eyes* never.", [("shake", "No,"), ("look_away", "never.")]),
    ],
)
def test_gestures_come_with_a_word(text: str, expected: list[tuple[str, str]]) -> None:
    found = [(name, word) for name, word in gestures(parse_marks(text)) if name != "smile"]
    assert found == expected


def test_pauses_of_directions_are_none_of_a_recording() -> None:
    assert [mark.seconds for mark in parse_marks("(pause) Yes.").marks if isinstance(mark, PauseMark)] == [0.7]
    assert not parse_marks("(pause) Yes.", has_emphasis=False).has_voice_changes


def test_a_title_and_items_are_sentences_and_a_blank_line_ends_a_paragraph() -> None:
    text = parse_marks("## Plan\nYou need:\n- eggs\n- two cups\n  of flour\n\nGo")
    found = [(" ".join(word.text for word in one.words), one.pause_s) for one in split_sentences(text, "en-us")]
    assert found == [("Plan.", 0.8), ("You need", 0.35), ("eggs.", 0.5), ("two cups of flour.", 0.8), ("Go", None)]


def test_a_long_table_is_read_up_to_a_limit() -> None:
    found = parse_marks("| a | b |\n|---|---|\n" + "".join(f"| row {n} | x |\n" for n in range(40)) + "\nEnd.")
    assert found.text.count("row") == MAX_TABLE_ROWS - 1
    assert found.text.endswith("End.")
    assert found.notes == (f"the rows of a table behind the first {MAX_TABLE_ROWS} are silent",)


@pytest.mark.parametrize("text", ["😀", "*nods*", "...", ":D", "[laughs] 🎉\n\n---", "```\nx = 1\n```", "<think>Hm."])
def test_texts_without_words(text: str) -> None:
    assert not has_words(text)
    assert has_words(f"{text}\n\nYes.") != text.startswith("<think>")


def test_other_languages_read_marks_and_no_names_of_emoji() -> None:
    found = parse_marks("*nickt* Ich ❤️ Pizza 😀 [happy] sehr!", "de")
    assert found.text.split() == ["nickt", "Ich", "Pizza", "sehr!"]
    assert ("sehr!", "happy") in styles(found)


def test_halves_of_a_character_wait_for_each_other() -> None:
    growing = GrowingText("en-us")
    parts = ["Great \ud83c", "\udf89. Next ", "one \ud83d"]
    assert [sentence for part in parts for sentence in growing.add(part)] == ["Great 🎉."]
    assert growing.flush() == ["Next one"]


def test_a_sentence_does_not_wait_for_the_end_of_code() -> None:
    growing = GrowingText("en-us")
    assert growing.add("Run this:\n```py\nx = 1\n") == ["Run this:\n\n"]
    assert growing.add("```\nDone. Well") == ["```py\nx = 1\n```\nDone."]


@pytest.mark.parametrize(
    "unit",
    ["[", "(", "*", "_", "~", "`", "<", "&", "#", "😀", ":)", "*a ", "<a>", "<think>", "```\n", "- a\n", "|a|\n|-|\n",
     "> ", "[a](b", "~~a", "[happy] ", "(laughs) ", "**[a", "Hi. 😢 ", "\u200d", "- a\n  b\n", "[happy]\n\n",
     "$", "$$", "\\(", "\\[", "\\begin{equation}", "==", "[a][1]", "<|", "$\\frac{", "- a\n  - b\n"],
)  # fmt: skip
def test_long_texts_of_marks_are_read_at_once(unit: str) -> None:
    begin = time.perf_counter()
    parse_marks((unit * 100_000)[:100_000])
    growing = GrowingText("en-us")
    for _ in range(100):
        growing.add((unit * 50)[:50])
    growing.flush()
    assert time.perf_counter() - begin < 20


def test_an_unknown_markup_is_refused() -> None:
    with pytest.raises(InputError, match="there is no markup 'md'; choose auto, plain, ssml, llm"):
        parse_marks("a", markup="md")


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("If x<y then y>x.", "If x less than y then y greater than x"),
        ("Dear <customer name>, your <order number> is ready.", "Dear customer name your order number is ready"),
        ("set<int> s and List<String> names", "set int s and List String names"),
        ("He seems (waits) sad.", "He seems waits sad"),
        ("He seems (pauses) sad.", "He seems sad"),
    ],
)  # fmt: skip
def test_comparisons_and_names_in_brackets_are_spoken(text: str, spoken: str) -> None:
    assert " ".join(word.text for word in pronounce_marked(parse_marks(text)).words) == spoken
    model = " ".join(word.text for word in pronounce_marked(parse_marks("So, x<y then y>x.", markup="llm")).words)
    assert model == "So x less than y then y greater than x"


def test_an_exclamation_in_parentheses_is_said_but_where_it_stands_alone() -> None:
    for markup in ("auto", "llm"):
        assert parse_marks("She has it all (looks!) and brains.", "en-us", markup).text.count("looks!") == 1
        assert "laughs" not in parse_marks("(laughs!) Sure.", "en-us", markup).text
