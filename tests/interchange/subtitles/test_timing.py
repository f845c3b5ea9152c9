"""Times: estimates overrule no time of the file; times that cannot be meant are read right, left out or refused."""

import pytest

from lexicon.errors import DataError
from tests.interchange.subtitles.conftest import ReadText, ass, srt

TT = '<tt xmlns="http://www.w3.org/ns/ttml"><body><div>{}</div></body></tt>'


def times(read: ReadText, content: str, suffix: str = ".srt", **choices: object) -> list[tuple[float, float]]:
    return [(round(cue.begin_s, 3), round(cue.end_s, 3)) for cue in read(content, suffix, **choices).cues]


@pytest.mark.parametrize(
    ("cues", "expected"),
    [
        (
            [(0, 0.35, "Come"), (0.35, 0.35, "with"), (0.35, 0.9, "me"), (0.9, 1.4, "now")],
            [(0, 0.35), (0.35, 0.9), (0.35, 0.9), (0.9, 1.4)],
        ),
        ([(1, 1, "one"), (1, 1, "two"), (1.5, 2, "three")], [(1, 1.5), (1, 1.5), (1.5, 2)]),
        ([(1, 1, "one"), (1.2, 1.2, "two"), (1.4, 2, "three")], [(1, 1.2), (1.2, 1.4), (1.4, 2)]),
        ([(0, 1, "one"), (1, 1.5, "two"), (1, 1, "three"), (4, 5, "four")], [(0, 1), (1, 1.5), (1, 1.5), (4, 5)]),
        ([(0, 1, "one"), (1, 1, "two")], [(0, 1), (1, 2)]),
    ],
)
def test_words_of_no_length_share_the_time_up_to_the_next_one(
    cues: list[tuple[float, float, str]], expected: list[tuple[float, float]], read: ReadText
) -> None:
    assert times(read, srt(*cues)) == expected


@pytest.mark.parametrize(
    ("content", "suffix", "reason"),
    [
        (srt((0, 0, "one"), (0, 0, "two")), ".srt", "all 2 cues begin at 0 s"),
        (srt((0, 1, "one"), (0, 1, "two"), (0, 1, "three")), ".srt", "all 3 cues begin at 0 s"),
        (srt((7, 7, "one"), (7, 7, "two"), (7, 7, "three")), ".srt", "all 3 cues begin at 7 s"),
        (TT.format("<p>one</p><p>two</p>"), ".ttml", "all 2 cues begin at 0 s"),
        ("1\n1000 --> 2000\nHi.\n", ".srt", r"cannot be read; the cue is left out\); correct its times"),
        ("{9000000}{9900000}Hi there.\n", ".sub", "at 25 frames a second the times cannot be meant"),
        (TT.format('<p begin="5t" end="500000000000t">Hi.</p>'), ".ttml", "no unit in which they can be meant"),
    ],
)
def test_times_that_cannot_be_meant_are_refused(content: str, suffix: str, reason: str, read: ReadText) -> None:
    with pytest.raises(DataError, match=reason):
        read(content, suffix)


READ_RIGHT = {
    "ticks without a rate": (
        TT.format(
            '<p begin="10000000t" end="20000000t">Hello there.</p><p begin="30000000t" end="45000000t">Bye now.</p>'
        ),
        ".ttml",
        [(1, 2), (3, 4.5)],
        "units of 1/10,000,000 s",
    ),
    "milliseconds without a unit": (
        TT.format('<p begin="1000" end="2000">Hello there.</p><p begin="3000" end="4500">Bye now.</p>'),
        ".ttml",
        [(1, 2), (3, 4.5)],
        "units of 0.001 s",
    ),
    "seconds without a unit": (
        TT.format('<p begin="1" end="2">Hello there.</p><p begin="3" end="4.5">Bye now.</p>'),
        ".ttml",
        [(1, 2), (3, 4.5)],
        None,
    ),
    "milliseconds in place of frames": (
        "{1000}{2000}Hello there.\n{3000}{4500}Bye now.\n",
        ".sub",
        [(1, 2), (3, 4.5)],
        "read as milliseconds",
    ),
    "frames after the seconds": (
        "1\n00:00:01:00 --> 00:00:02:12\nHello there.\n\n2\n00:00:03:05 --> 00:00:04:24\nBye now.\n",
        ".srt",
        [(1, 2.48), (3.2, 4.96)],
        "taken for 25 a second",
    ),
    "frames above 24": (
        "1\n00:00:01:00 --> 00:00:02:15\nHello there.\n\n2\n00:00:03:06 --> 00:00:04:29\nBye now.\n",
        ".srt",
        [(1, 2.5), (3.2, 4.967)],
        "taken for 30 a second",
    ),
    "starts and ends exchanged": (
        srt((2, 1, "Hello there."), (4.5, 3, "Bye now.")),
        ".srt",
        [(1, 2), (3, 4.5)],
        "starts and ends are exchanged",
    ),
    "before the film": (
        "1\n-00:00:05,000 --> -00:00:04,000\nOld.\n\n" + srt((1, 2, "Hello."), (3, 4.5, "Bye.")),
        ".srt",
        [(1, 2), (3, 4.5)],
        "lies before the start of the film; it is left out",
    ),
    "over midnight": (
        "1\n23:59:58,000 --> 23:59:59,000\nHello.\n\n2\n23:59:59,500 --> 00:00:01,000\nMidnight.\n\n"
        "3\n00:00:02,000 --> 00:00:03,000\nBye.\n",
        ".srt",
        [(86398, 86399), (86399.5, 86401), (86402, 86403)],
        "the clock begins anew at midnight",
    ),
    "the time code of a tape": (
        srt((36001, 36002, "Hello."), (36003, 36004.5, "Bye.")),
        ".srt",
        [(36001, 36002), (36003, 36004.5)],
        "--shift -36000",
    ),
}


@pytest.mark.parametrize(("content", "suffix", "expected", "message"), READ_RIGHT.values(), ids=READ_RIGHT)
def test_times_of_another_unit_are_read_right_where_that_is_certain(
    content: str, suffix: str, expected: list[tuple[float, float]], message: str | None, read: ReadText
) -> None:
    assert times(read, content, suffix) == expected
    warnings = [warning.message for warning in read(content, suffix).warnings]
    assert not warnings if message is None else any(message in warning for warning in warnings)


def test_a_time_of_ttml_that_cannot_be_read_leaves_its_cue_out(read: ReadText) -> None:
    found = read(TT.format('<p begin="soon" end="2s">Hi.</p>\n<p begin="3s" end="4s">Bye.</p>'), ".ttml")
    assert [(cue.begin_s, cue.text) for cue in found.cues] == [(3, "Bye.")]


def test_cues_beyond_the_film_are_left_out_or_refused(read: ReadText) -> None:
    content = srt((1, 2, "one"), (3, 4, "two"), (30, 31, "three"))
    found = read(content, film_s=10.0)
    assert [cue.text for cue in found.cues] == ["one", "two"]
    assert [warning.message for warning in found.warnings] == [
        "this cue begins after the end of the film, which has 10.0 s; it is left out"
    ]
    with pytest.raises(DataError, match="2 of 3 cues begin after the end of the film"):
        read(content, film_s=2.0)


def test_hours_of_a_tape_are_taken_off_where_the_film_is_known(read: ReadText) -> None:
    content = srt((3601, 3602, "one"), (3603, 3604, "two"))
    assert times(read, content, film_s=10.0) == [(1, 2), (3, 4)]
    assert times(read, content, shift=-3600.0) == [(1, 2), (3, 4)]


def test_what_nobody_says_overlaps_nothing(read: ReadText) -> None:
    content = ass(
        (1, 5, "Sign", "Exit"),
        (1.5, 3, "Default", "Hello."),
        (2.5, 6, "Sign", "Open"),
        (4, 7, "Default", "So it is."),
        (0.5, 0.5, "Sign", "Shut"),
        (6.5, 8, "Default", "[a bell]"),
    )
    assert not read(content, ".ass").warnings
    found = read(content, ".ass", keep=("signs",))
    assert sum("overlaps" in warning.message for warning in found.warnings) == 3


def test_an_estimated_end_is_not_limited_by_a_sign(read: ReadText) -> None:
    content = ass((1, 1, "Default", "Hello there, you."), (1.2, 5, "Sign", "Exit"), (9, 10, "Default", "Bye."))
    assert read(content, ".ass").cues[0].end_s == pytest.approx(2.13, abs=0.01)
