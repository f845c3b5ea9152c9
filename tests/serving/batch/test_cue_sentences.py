"""Sentences that run over several cues: which cues belong together, and what is planned for them."""

import pytest

from lexicon.sentence_length import n_letters
from tests.serving.batch.conftest import Planner
from tts2face.serving.batch.cue_sentences import continues, spoken_part, words_of_cue

FIRST, SECOND, THIRD = "When I was a boy", "my father told me", "a story. It was long."
CUE = "{n}\n00:00:0{n},000 --> 00:00:0{n},900\n{text}\n"


@pytest.mark.parametrize(
    ("text", "following"),
    [
        ("When I was a boy,", "My father told me."),
        ("my father told me", "that the sea was there."),
        ("We went to", "London."),
        ("the lights of the", "Grand Hotel."),
        ("I was going...", "...to the market."),
        ("I was going…", "to the market."),
        ('"And then', 'we left."'),
        ("I saw Mr.", "Smith in the office."),
        ("I SAW MR.", "SMITH IN THE OFFICE."),
        ("He is in the U.S.", "Army now."),
        ("We leave at 5 p.m.", "Monday."),
        ("It is in vol.", "3 of them."),
        ("They had e.g.", "apples and pears."),
        ("We saw the men", "...came to see me."),
        ("We saw the men", "… came to see me."),
        ("We went to the", "...Grand Hotel."),
    ],
)
def test_a_sentence_goes_on(text: str, following: str) -> None:
    assert continues(text, following)


@pytest.mark.parametrize(
    ("text", "following"),
    [
        ("We left.", "and that was all."),
        ("Is it?", "no"),
        ("We left", "Then they came."),
        ("I wonder...", "Well."),
        ('"We left."', "he said."),
        ("Wait -", "No!"),
        ("", "we left."),
        ("It was the U.S.", "He left."),
        ("IT WAS THE U.S.", "HE LEFT."),
        ("We left at 5 p.m.", "Then we ate."),
        ("Was it Mr.?", "Smith."),
        ("We saw the men", "...Then they left."),
        ("We saw the", "..."),
        ("We left.", "...and that was all."),
        ("<speak>We left,</speak>", "and that was all."),
        ("We left,", "<speak>and that was all.</speak>"),
    ],
)
def test_a_sentence_ends(text: str, following: str) -> None:
    assert not continues(text, following)


def test_a_missing_mark_decides_in_a_file_of_capitals() -> None:
    assert continues("MY FATHER TOLD ME", "THAT THE SEA", is_in_capitals=True)
    assert not continues("MY FATHER TOLD ME.", "THAT THE SEA", is_in_capitals=True)


def test_the_dots_by_which_a_sentence_goes_on_are_not_spoken() -> None:
    assert spoken_part("...to the market...", is_first=False, is_last=False) == "to the market"
    assert spoken_part("...to the market...", is_first=True, is_last=True) == "...to the market..."


def srt(*texts: str) -> str:
    return "\n".join(CUE.format(n=n, text=text) for n, text in enumerate(texts, start=1))


@pytest.mark.parametrize("per", ["cue", "file"])
def test_its_cues_have_one_text_and_their_own_part(per: str, plan_of: Planner) -> None:
    plan = plan_of(srt(FIRST, SECOND, THIRD, "Bob moves."), per=per)
    first, second, third, fourth = (line.segment for line in plan.lines)
    assert {one.request["text"] for one in (first, second, third)} == {f"{FIRST} {SECOND} {THIRD}"}
    assert [one.part for one in (first, second, third)] == [0, 1, 2]
    assert [part.n_letters for part in first.parts] == [12, 14, 17]
    assert first.parts == third.parts
    assert (fourth.request["text"], fourth.parts) == ("Bob moves.", ())
    assert len({one.address for one in (first, second, third)}) == 3


@pytest.mark.parametrize(
    "texts",
    [
        ("ANN: When I was a boy", "BOB: my father told me"),
        ("When I was a boy", "- my father.\n- told me"),
        ("When I was a boy", "你好"),
    ],
)
def test_other_speakers_and_other_writing_systems_divide_a_sentence(texts: tuple[str, ...], plan_of: Planner) -> None:
    plan = plan_of(srt(*texts))
    parts = [None if line.segment is None else line.segment.parts for line in plan.lines]
    assert parts == [()] * len(plan.lines)
    assert len(parts) >= len(texts)


def test_an_abbreviation_of_the_language_of_the_file_ends_no_sentence(plan_of: Planner) -> None:
    (first, second) = plan_of(srt("I saw Mr.", "Smith in the office.")).lines
    assert first.segment.request["text"] == second.segment.request["text"] == "I saw Mr. Smith in the office."
    assert continues("Er kommt am 3.", "Mai.", "de")
    assert not continues("We had 3.", "May I go?", "en-us")


def test_dots_in_front_of_a_cue_alone_join_it(plan_of: Planner) -> None:
    (first, second) = plan_of(srt("We saw the men", "...came to see me.")).lines
    assert first.segment.request["text"] == second.segment.request["text"] == "We saw the men came to see me."


def test_a_silence_divides_a_sentence(plan_of: Planner) -> None:
    text = srt(FIRST) + "\n2\n00:00:04,000 --> 00:00:05,000\n" + SECOND + "\n"
    assert [line.segment.parts for line in plan_of(text).lines] == [(), ()]


def test_a_changed_cue_changes_the_segments_of_its_sentence_alone(plan_of: Planner) -> None:
    before = plan_of(srt(FIRST, SECOND, THIRD, "Bob moves."))
    after = plan_of(srt(FIRST, SECOND.replace("told", "gave"), THIRD, "Bob moves."))
    same = [a.segment.address == b.segment.address for a, b in zip(before.lines, after.lines, strict=True)]
    assert same == [False, False, False, True]


def test_a_file_in_capitals_is_read_as_ordinary_writing(plan_of: Planner) -> None:
    plan = plan_of(srt("MR. SMITH IS IN", "THE HOUSE OF", "DAN.", "DAN!"))
    assert [line.segment.request["text"] for line in plan.lines] == ["Mr. Smith is in the house of Dan."] * 3 + ["Dan!"]
    assert [line.text for line in plan.lines] == ["MR. SMITH IS IN", "THE HOUSE OF", "DAN.", "DAN!"]


MARKED = [
    ("When I was a boy (sighs)", "my father told me"),
    ("When I was a boy, [nod]", "my father told me"),
    ("[nod] When I was a boy,", "*nods* my father told me"),
    ("When I was a [happy] boy", "(laughs) my father [pause 1] told me"),
    ("When I was a boy", "[smile] my father told me 😊"),
]


@pytest.mark.parametrize("texts", MARKED)
def test_marks_divide_no_sentence(texts: tuple[str, str], plan_of: Planner) -> None:
    first, second = (line.segment for line in plan_of(srt(*texts)).lines)
    assert [part.n_letters for part in first.parts] == [n_letters(words_of_cue(text, {})) for text in texts]
    assert first.parts == second.parts
    assert first.request["text"] == second.request["text"] == " ".join(texts)


@pytest.mark.parametrize(
    "texts", [("We left. (sighs)", "That was all."), ("We left. [nod]", "and that was all."), ("We left", "[nod] They")]
)
def test_marks_join_no_sentences(texts: tuple[str, str], plan_of: Planner) -> None:
    assert [line.segment.parts for line in plan_of(srt(*texts)).lines] == [(), ()]


def test_a_mark_over_two_cues_leaves_them_apart(plan_of: Planner) -> None:
    assert [line.segment.parts for line in plan_of(srt("I was *very", "sad* there then.")).lines] == [(), ()]
