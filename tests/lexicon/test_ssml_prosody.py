"""Values of SSML's prosody: pitch, range, contour, duration, and their nesting."""

import math

import pytest

from lexicon.marked_text import MarkedText, StyleRun
from lexicon.ssml_prosody import USUAL_RANGE, parse_contour, parse_pitch, parse_range, parse_volume
from lexicon.text_marks import parse_marks
from lexicon.tones import EVEN, Tone

VOICE_HZ = 200.0


def ssml(inside: str) -> MarkedText:
    return parse_marks(f"<speak>{inside}</speak>", voice_hz=lambda voice, language: VOICE_HZ)


@pytest.mark.parametrize(
    ("written", "semitones"),
    [
        ("medium", 0.0), ("default", 0.0), ("x-low", -6.0), ("high", 3.0), ("+2st", 2.0), ("-1.5 st", -1.5),
        ("+2ST", 2.0), ("+10%", 1.6500), ("10%", 1.6500), ("-20%", -3.8631), ("+20Hz", 1.6500), ("-20hz", -1.8240),
        ("100Hz", -12.0), ("400Hz", 12.0), ("900Hz", 12.0), ("20Hz", -12.0),
    ],
)  # fmt: skip
def test_pitches(written: str, semitones: float) -> None:
    assert parse_pitch(written, VOICE_HZ) == pytest.approx(semitones, abs=1e-3)


def test_a_pitch_in_hz_replaces_what_was_added_and_a_change_comes_on_top() -> None:
    assert parse_pitch("400Hz", VOICE_HZ, 12.0) == pytest.approx(0.0)
    assert parse_pitch("+400Hz", VOICE_HZ, 12.0) == pytest.approx(12.0)


@pytest.mark.parametrize(
    ("written", "factor"),
    [
        ("medium", 1.0), ("x-high", 1.8), ("+50%", 1.5), ("-100%", 0.0), ("50%", 1.5), ("-200%", 0.0),
        ("+7.6st", 2.0), ("3.8st", 0.5),
        ("88.8Hz", 1.0), ("-44.4Hz", 0.5),
    ],
)  # fmt: skip
def test_ranges(written: str, factor: float) -> None:
    assert USUAL_RANGE == 7.6
    assert parse_range(written, VOICE_HZ) == pytest.approx(factor, abs=0.01)


@pytest.mark.parametrize(
    ("written", "factor"), [("+20%", 1.2), ("-20.00%", 0.8), ("80%", 0.8), ("50", 0.5), ("+10", 1.1)]
)
def test_volumes_of_other_services(written: str, factor: float) -> None:
    assert parse_volume(written) == pytest.approx(factor)


def test_a_contour_is_ordered_and_its_last_point_at_one_time_counts() -> None:
    assert parse_contour("(50%,-2st) (0%, +2st),(50%,+1st)", VOICE_HZ) == ((0.0, 2.0), (0.5, 1.0))
    assert parse_contour("(60%,-60%) (100%,+80%)", VOICE_HZ)[0] == (0.6, -12.0)
    ((_, pitch),) = parse_contour("(100%,200Hz)", VOICE_HZ, 3.0)
    assert pitch == pytest.approx(-3.0)


def test_nested_prosody_adds_up() -> None:
    found = ssml('<prosody pitch="+2st" range="50%">a <prosody pitch="+3st" range="-50%">b</prosody></prosody> c')
    assert [run.tone for run in found.runs] == [Tone(pitch=2.0, range=1.5), Tone(pitch=5.0, range=0.75), EVEN]
    inner = ssml('<emphasis level="strong">a <emphasis level="none">b</emphasis></emphasis>')
    assert [(run.tone.emphasis, round(run.loudness, 3)) for run in inner.runs] == [(1.0, 1.413), (0.0, 1.0)]
    assert found.has_voice_changes
    assert inner.has_voice_changes


def test_a_duration_is_shared_by_the_letters_and_the_inner_one_counts() -> None:
    found = ssml('ab <prosody duration="2s">cd <prosody duration="500ms" rate="80%">ef</prosody> gh</prosody> ij')
    assert [(found.text[run.start], run.pace) for run in found.runs[:-1]] == [
        ("a", None),
        ("c", pytest.approx(2 / 6)),
        ("e", 0.25),
        (" ", pytest.approx(2 / 6)),
    ]
    assert found.runs[-1] == StyleRun(len(found.text) - 3)
    assert ssml('<prosody duration="2s"/>a').runs[-1].pace is None


def test_loudness_in_decibels() -> None:
    levels = [StyleRun(0, tone=Tone(emphasis=size)).loudness for size in (1.0, 0.6, 0.0, -1.0)]
    assert [20 * math.log10(level) for level in levels] == pytest.approx([3.0, 1.8, 0.0, -3.0])
