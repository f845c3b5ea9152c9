"""Which sentences rise, and on which words."""

import pytest

from lexicon.intonation import Movement, movements
from lexicon.pronounce import pronounce


def tunes(text: str) -> str:
    """The movements of a text as words: ``tea↗ coffee↘``; ``↑`` for an item of a list."""
    words = pronounce(text).words
    found = movements([word.text for word in words], [word.mark for word in words])
    return " ".join(words[move.at].text + {"rise": "↗", "fall": "↘", "item": "↑"}[move.tune] for move in found)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Have they arrived?", "arrived↗"),
        ("Won't you sit down?", "down↗"),
        ("Your sister paints?", "paints↗"),
        ("And if I say no?", "no↗"),
        ("Really?", "Really↗"),
        ("And you?", "you↗"),
        ("Do you know where she lives?", "lives↗"),
        ("Can you tell me what happened?", "happened↗"),
        ("You bought what?", "what↗"),
        ("Sorry, where?", "where↗"),
        ("What, you sold it?", "sold↗"),
        ("Who, me?", "me↗"),
        ("When you were young, did you skate?", "skate↗"),
        ("If it snows, will they come?", "come↗"),
        ("Mary, are you awake?", "awake↗"),
        ('"Are you ready?" she asked.', "ready↗"),
        ("Is it raining?! Yes.", "raining↗"),
        ("Is he from Leeds or somewhere?", "Leeds↗"),
        ("Did you ask Bob or Ann or anyone like that?", "that↗"),
        ("Is it far, would you say?", "say↗"),
        ("It is cold, don't you think?", "think↗"),
    ],
)
def test_questions_that_ask_for_yes_or_no_rise(text: str, expected: str) -> None:
    assert tunes(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "They have arrived.",
        "Come here!",
        "Where do they live?",
        "What's the matter?",
        "At what time does it start?",
        "In which drawer did you look?",
        "How many cups of tea did she drink?",
        "So why not?",
        "How about Friday?",
        "Excuse me, where is the museum?",
        "Tell me, who won?",
        "If it snows, what will they do?",
        "What would you like to eat or drink?",
        "I wonder if they know.",
        "In the end, who won?",
        "If not now, when?",
        "Guess who I met?",
        "Who've you told?",
        "Like what?",
        "How many people came, would you say?",
        "What is it, do you think?",
    ],
)
def test_statements_and_questions_with_a_question_word_stay(text: str) -> None:
    assert tunes(text) == ""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Is it left or right?", "left↗ right↘"),
        ("Milk or sugar?", "Milk↗ sugar↘"),
        ("Would you like soup, salad, or bread?", "soup↗ salad↗ bread↘"),
        ("Shall we walk or shall we drive?", "walk↗ drive↘"),
        ("Do you stay, or do you leave?", "stay↗ leave↘"),
        ("Which is nearer, Rome or Paris?", "Rome↗ Paris↘"),
        ("Did you see it or not?", "see↗ not↘"),
        ("Are you mad or what?", "what↘"),
        # no choice between two answers
        ("Do you need a pen or something?", "pen↗"),
        ("Did two or three guests stay?", "stay↗"),
        ("Is it more or less ready?", "ready↗"),
        ("Do you know whether they won or lost?", "lost↗"),
        ("Or are you tired?", "tired↗"),
        ("Have you any pens or pencils?", "pencils↗"),
        ("Can you wait a day or two?", "two↗"),
        ("One or two?", "One↗ two↘"),
    ],
)
def test_alternatives_rise_but_the_last(text: str, expected: str) -> None:
    assert tunes(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("It's late, isn't it?", "isn't↘"),
        ("She sings well doesn't she?", "doesn't↘"),
        ("They never called, did they?", "did↘"),
        ("You can't swim, can you?", "can↘"),
        ("Few people know that, do they?", "do↘"),
        ("Nobody's perfect, are they?", "are↘"),
        ("A few people know that, don't they?", "don't↘"),
        ("What a view, isn't it?", "isn't↘"),
        # of one polarity, or asking for consent
        ("So you know him, do you?", "do↗"),
        ("Let's start, shall we?", "shall↗"),
        ("You're joking, right?", "right↗"),
        ("Do you like it, Peter?", "Peter↗"),
    ],
)
def test_tags_fall_where_they_contradict(text: str, expected: str) -> None:
    assert tunes(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("We need flour, butter, and eggs.", "flour↑ butter↑"),
        ("We need flour, butter and eggs.", "flour↑ butter↑"),
        ("Did you buy flour, butter and eggs?", "flour↑ butter↑ eggs↗"),
        ("Later that day, when the rain had stopped, we left.", ""),
        ("Well, we went home and slept.", ""),
        ("I like pears, but plums and figs are better.", ""),
    ],
)
def test_items_of_lists_rise_a_little(text: str, expected: str) -> None:
    assert tunes(text) == expected


def test_the_rise_begins_on_the_last_stressed_word() -> None:
    words = ["Will", "you", "tell", "me", "about", "it"]
    found = movements(["Did", "they", "see", "you"], ["", "", "", "?"])
    assert found == (Movement("rise", 2, 3),)
    assert movements(words, [*[""] * 5, "?"])[0].until == 5
    assert movements([], []) == ()
    assert Movement("rise", 2, 3).shift(4) == Movement("rise", 6, 7)
