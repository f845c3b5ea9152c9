"""Rolling captions, layers and copies: what is shown twice is spoken once; what is said twice stays."""

import pytest

from tests.interchange.subtitles.conftest import ReadText, ass, srt, vtt

ROLLING = [
    (0.16, 2.429, " \nhere<00:00:00.480><c> is</c><00:00:00.800><c> the</c><00:00:01.200><c> plan</c>"),
    (2.429, 2.439, "here is the plan\n "),
    (2.439, 4.749, "here is the plan\nwe<00:00:02.800><c> walk</c><00:00:03.100><c> home</c>"),
    (4.749, 4.759, "we walk home\n "),
    (4.759, 7.0, "we walk home\nand<00:00:05.000><c> sleep</c>"),
    (7.0, 7.01, "and sleep\n "),
]
# Cues as they are shown, and the words that are new in each with the instant at which the cue begins.
SHOWN_AGAIN = {
    "rolling, with instants of words": (
        vtt(*ROLLING),
        ".vtt",
        [(0.16, "here is the plan"), (2.439, "we walk home"), (4.759, "and sleep")],
    ),
    "rolling, as SubRip": (
        srt(
            *[
                (0.16, 2.429, "here is the plan"),
                (2.429, 2.439, "here is the plan\n "),
                (2.439, 4.749, "here is the plan\nwe walk home"),
                (4.749, 4.759, "we walk home\n "),
                (4.759, 7.0, "we walk home\nand sleep"),
            ]
        ),
        ".srt",
        [(0.16, "here is the plan"), (2.439, "we walk home"), (4.759, "and sleep")],
    ),
    "two lines that scroll": (
        srt((0, 2, "first of all\nthe bread"), (2, 4, "the bread\nthen the tea"), (4, 6, "then the tea\nand the milk")),
        ".srt",
        [(0, "first of all the bread"), (2, "then the tea"), (4, "and the milk")],
    ),
    "three lines that scroll": (
        srt(
            (0, 2, "one apple\ntwo pears\nthree figs"),
            (2, 4, "two pears\nthree figs\nfour nuts"),
            (4, 6, "three figs\nfour nuts\nfive eggs"),
        ),
        ".srt",
        [(0, "one apple two pears three figs"), (2, "four nuts"), (4, "five eggs")],
    ),
    "painted on, word by word": (
        srt((0, 0.4, "Now"), (0.4, 0.8, "Now we"), (0.8, 1.2, "Now we go"), (1.2, 2.0, "Now we go home.")),
        ".srt",
        [(0, "Now"), (0.4, "we"), (0.8, "go"), (1.2, "home.")],
    ),
    "words marked one by one": (
        srt(
            (0, 0.4, "<u>Here</u> we go."),
            (0.4, 0.8, "Here <u>we</u> go."),
            (0.8, 1.2, "Here we <u>go.</u>"),
            (1.2, 1.5, "Here we go."),
            (1.5, 2, "<u>So</u> long."),
            (2, 3, "So <u>long.</u>"),
        ),
        ".srt",
        [(0, "Here we go."), (1.5, "So long.")],
    ),
    "words marked one by one in SubStation Alpha": (
        ass(
            (0, 0.4, "Default", "{\\c&H00FF&}Here{\\c} we"),
            (0.4, 0.8, "Default", "Here {\\c&H00FF&}we{\\c}"),
            (2, 3, "Default", "Bye."),
        ),
        ".ass",
        [(0, "Here we"), (2, "Bye.")],
    ),
    "painted on in the second line": (
        srt(
            (0, 1, "It rains."),
            (1, 1.5, "It rains.\nWe"),
            (1.5, 2, "It rains.\nWe stay"),
            (2, 3, "It rains.\nWe stay in."),
        ),
        ".srt",
        [(0, "It rains."), (1, "We"), (1.5, "stay"), (2, "in.")],
    ),
    "a carried line in a file that does not roll": (
        srt(
            (0, 2, "Good morning."),
            (3, 5, "The train to London is late."),
            (5, 7, "The train to London is late.\nTake a bus."),
            (8, 9, "Thank you."),
        ),
        ".srt",
        [(0, "Good morning."), (3, "The train to London is late."), (5, "Take a bus."), (8, "Thank you.")],
    ),
    "a line that stays alone before the next": (
        srt((0, 2, "so far\nso good"), (2, 3, "so good"), (3, 5, "so good\nor not"), (5, 6, "or not")),
        ".srt",
        [(0, "so far so good"), (3, "or not")],
    ),
}


@pytest.mark.parametrize(("content", "suffix", "said"), SHOWN_AGAIN.values(), ids=SHOWN_AGAIN)
def test_what_a_cue_shows_again_is_spoken_once(
    content: str, suffix: str, said: list[tuple[float, str]], read: ReadText
) -> None:
    found = read(content, suffix)
    assert [(round(cue.begin_s, 3), cue.text) for cue in found.cues] == said
    assert ["rolling captions" in note.message for note in found.notes] == [True]
    kept = read(content, suffix, keep=("repeats",))
    assert not kept.notes
    assert len(kept.cues) > len(found.cues) or len(" ".join(cue.text for cue in kept.cues).split()) > len(said)


def test_writing_that_moves_frame_by_frame_is_a_sign(read: ReadText) -> None:
    frames = [(3 + n * 0.04, 3.04 + n * 0.04, "Default", f"{{\\pos({n},5)}}Bakery") for n in range(20)]
    found = read(ass((1, 2, "Default", "Come here."), *frames), ".ass")
    assert [(cue.text, cue.kind, round(cue.end_s, 2)) for cue in found.cues] == [
        ("Come here.", "", 2.0),
        ("", "signs", 3.8),
    ]
    assert found.notes[0].message.startswith("1 sign, such as 'Bakery', is not spoken")


def test_placed_words_that_are_marked_one_by_one_are_no_sign(read: ReadText) -> None:
    lines = [
        (1, 1.4, "Default", "{\\pos(9,9)}{\\b1}Come{\\b0} here"),
        (1.4, 2, "Default", "{\\pos(9,9)}Come {\\b1}here"),
    ]
    assert [(cue.begin_s, cue.end_s, cue.text) for cue in read(ass(*lines), ".ass").cues] == [(1, 2, "Come here")]


def test_a_line_in_frames_is_spoken_once(read: ReadText) -> None:
    frames = [(3 + n * 0.04, 3.04 + n * 0.04, "Default", f"{{\\alpha&H{n:02x}&}}Come here.") for n in range(20)]
    found = read(ass(*frames), ".ass")
    assert [(cue.text, round(cue.end_s, 2)) for cue in found.cues] == [("Come here.", 3.8)]


def test_words_begin_at_their_instants_in_a_growing_cue(read: ReadText) -> None:
    cues = [(0, 1, "we"), (1, 3, "we<00:00:01.500><c> walk</c>"), (3, 4, "we walk<00:00:03.250><c> home</c>")]
    assert [(cue.begin_s, cue.text) for cue in read(vtt(*cues), ".vtt").cues] == [
        (0, "we"),
        (1.5, "walk"),
        (3.25, "home"),
    ]


@pytest.mark.parametrize(
    "cues",
    [
        [(0, 1, "No."), (1, 2, "No."), (2, 3, "No.")],
        [(0, 1, "No."), (1, 2, "No. No."), (2, 3, "No. No. No.")],
        [(0, 2, "Row, row, row your boat"), (2, 4, "Row, row, row your boat"), (4, 6, "gently down the stream")],
        [(0, 1, "I know."), (1, 2, "<i>I know.</i>")],
        [(0, 2, "- What happened?"), (2, 4, "- What happened?\n- Nothing.")],
        [(0, 2, "I love you."), (2, 4, "I love you too.")],
        [(0, 2, "He is late."), (5, 7, "He is late.\nAgain.")],
        [(0, 2, "ANN: Stop!"), (2, 4, "BOB: Stop!")],
        [(0, 2, "♪ we go on and on ♪"), (2, 4, "♪ we go on and on ♪\n♪ again ♪")],
    ],
)
def test_what_is_said_twice_stays(cues: list[tuple[float, float, str]], read: ReadText) -> None:
    found, kept = read(srt(*cues)), read(srt(*cues), keep=("repeats",))
    assert [cue.text for cue in found.cues] == [cue.text for cue in kept.cues]
    assert len(found.cues) == len(cues)


COPIES = {
    "layers with other overrides": (
        ass(
            (1, 3, "Default", "{\\bord4}Hello there."),
            (1, 3, "Default", "{\\bord0\\c&H00&}Hello there."),
            (4, 5, "Default", "Bye."),
        ),
        ".ass",
    ),
    "layers that begin a frame later": (
        ass((1, 3, "Default", "Hello there."), (1.04, 3, "Shadow", "{\\blur3}Hello there."), (4, 5, "Default", "Bye.")),
        ".ass",
    ),
    "regions of TTML": (
        '<tt xmlns="http://www.w3.org/ns/ttml"><body><div><p region="top" begin="1s" end="3s">Hello there.</p>'
        '<p region="bottom" begin="1s" end="3s">Hello there.</p><p begin="4s" end="5s">Bye.</p></div></body></tt>',
        ".ttml",
    ),
    "a copy for the deaf": (srt((1, 3, "Hello there."), (1, 3, "[sighs] Hello there."), (4, 5, "Bye.")), ".srt"),
    "another place": (srt((1, 3, "Hello there."), (1, 3, "{\\an8}<i>Hello there.</i>"), (4, 5, "Bye.")), ".srt"),
}


@pytest.mark.parametrize(("content", "suffix"), COPIES.values(), ids=COPIES)
def test_copies_of_one_time_are_spoken_once(content: str, suffix: str, read: ReadText) -> None:
    found = read(content, suffix)
    assert [(cue.begin_s, cue.end_s, cue.text) for cue in found.cues] == [(1, 3, "Hello there."), (4, 5, "Bye.")]
    assert any("what is shown twice is spoken once" in warning.message for warning in found.warnings)


def test_of_a_copy_with_a_name_the_name_stays(read: ReadText) -> None:
    (cue,) = read(srt((1, 3, "I know."), (1, 3, "ANN: I know."))).cues
    assert (cue.text, cue.speaker) == ("I know.", "ANN")


def test_two_people_who_say_the_same_are_two(read: ReadText) -> None:
    found = read(srt((1, 3, "ANN: Yes!"), (1, 3, "BOB: Yes!")))
    assert [cue.speaker for cue in found.cues] == ["ANN", "BOB"]
