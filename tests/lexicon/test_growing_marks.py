"""A text with marks is read alike, whether it comes whole, by letters, or in parts of any size."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lexicon.growing_text import GrowingText
from lexicon.marked_text import GestureMark, MarkedText, PauseMark
from lexicon.text_marks import parse_marks
from tests.lexicon.marked_rows import rows

SENTENCES = (
    "Hello there.", "It works! 🎉", "I lost my keys 😢.", "Really?", "So *nods* yes.", "*waves* Bye!", "Well...",
    "[happy] Good to see you.", "[sad] He left.", "[neutral] We begin.", "That is **very** good.", "I said NO.",
    "See [the guide](https://a.example/b).", "Use `pip` now.", "(laughs) You got me.", "We met (in May) again.",
    "No way :O that is big ^_^", "Great XD", "<smile> Sure.", "<happy>We won.</happy> Then we left.", "Tom &amp; Ann.",
    "Wait [pause 1] here.", "It is ~~old~~ new.", "2 < 3 and 3 * 4.", "Dr. Smith came.", "[shake] Never.", "👋🏽 Hi!",
    "[sighs] Fine. *rolls eyes* You win.", "I ❤️ pizza.", "<think>He asks. Say no.</think>No.", "Press 1️⃣ now.",
    "So $x^2 + 1$ is it.", "It costs $5 or $10.", "Let \\(a < b\\) hold.", "We ==mark== it.", "See [the docs][1] now.",
    "Area: 5 m<sup>2</sup>.", "Pay $3.50. Then go.", "<|im_end|>", "a == b or a++ here.", "$$E = mc^2$$",
)  # fmt: skip
LINES = ("## A title", "- an item", "* second item 🧘", "1. First.", "2. Second one", "> Quoted words.", "---", "")
BLOCKS = (
    "```py\nprint('x. Y')\n```",
    "| a | b |\n|---|---|\n| one | two |",
    "<think>\nThe user waits.\n\nGo.\n</think>",
    "$$\n\\frac{1}{2}.\n$$",
    "\\[\nx = 1\n\\]\nThen.",
)
TEXTS = st.lists(
    st.one_of(
        st.lists(st.sampled_from(SENTENCES), min_size=1, max_size=4).map(" ".join),
        st.sampled_from(LINES),
        st.sampled_from(BLOCKS).map(lambda block: f"\n{block}\n"),
    ),
    min_size=1,
    max_size=6,
).flatmap(lambda lines: st.sampled_from(["\n", "\n\n"]).map(lambda separator: separator.join(lines)))


def pieces(text: str, markup: str, ends: list[int]) -> list[str]:
    growing = GrowingText("en-us", markup)
    bounds = sorted({0, *(end for end in ends if end < len(text)), len(text)})
    found = [sentence for start, end in itertools.pairwise(bounds) for sentence in growing.add(text[start:end])]
    return [*found, *growing.flush()]


def heard(marked: MarkedText) -> list[tuple[str, str, float]]:
    """Words with the innermost style and the emphasis of their first letter."""
    found = []
    for start, run in zip([run.start for run in marked.runs], marked.runs, strict=True):
        following = [other.start for other in marked.runs if other.start > start]
        part = marked.text[start : following[0] if following else None]
        style = run.styles[-1] if run.styles else ""
        found += [(letter, style, run.tone.emphasis) for letter in part if letter.isalnum()]
    return found


def shown(marked: MarkedText) -> list[tuple[int, object]]:
    """Gestures and pauses by letters."""
    return [
        (sum(map(str.isalnum, marked.text[: mark.at])), mark.name if isinstance(mark, GestureMark) else mark.seconds)
        for mark in marked.marks
        if isinstance(mark, GestureMark | PauseMark)
    ]


def check(text: str, markup: str, ends: list[int]) -> None:
    whole = parse_marks(text, markup=markup)
    parts = [parse_marks(piece, markup=markup) for piece in pieces(text, markup, ends)]
    assert [letter for part in parts for letter in heard(part)] == heard(whole)
    marks: list[tuple[int, object]] = []
    n_before = 0
    for part in parts:
        marks += [(n_before + at, what) for at, what in shown(part)]
        n_before += sum(map(str.isalnum, part.text))
    assert sorted(marks, key=str) == sorted(shown(whole), key=str)


@pytest.mark.parametrize("row", rows(), ids=lambda row: row["text"][:30])
def test_a_marked_text_is_read_alike_by_letters(row: dict[str, str]) -> None:
    check(row["text"], "llm", [*range(len(row["text"]))])


@settings(max_examples=200, deadline=None)
@given(TEXTS, st.lists(st.integers(1, 300), max_size=30), st.sampled_from(["auto", "llm"]))
def test_a_marked_text_is_read_alike_in_any_parts(text: str, ends: list[int], markup: str) -> None:
    check(text, markup, ends)
    check(text, markup, [*range(len(text))])
