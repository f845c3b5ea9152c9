"""The line of frames, without threads: order, gaps, interruption, samples and pictures."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tts2face.session.live.blocks import Block, End
from tts2face.session.live.frames import Frame
from tts2face.session.live.line import KEPT, Line
from tts2face.types import HEAD_CHANNELS, SOUND_RATE, Trajectory, Waveform

FPS = 30.0


class Still:
    """Idle motion of one frame at a time, at 0."""

    def next(self, n_frames: int) -> Block:
        return block(n_frames, 0, value=0.0)


def block(n_frames: int, utterance: int, *, value: float = 1.0, source: Any = None) -> Block:
    """Frames at a constant pose, whose sound counts its samples in thousandths of the whole."""
    n_samples = round(n_frames * SOUND_RATE / FPS)
    sound = Waveform(np.arange(1, n_samples + 1) / (n_samples + 1), SOUND_RATE) if utterance else None
    motion = Trajectory(("jawOpen",), np.full((n_frames, 1), value, np.float32), FPS)
    head = Trajectory(HEAD_CHANNELS, np.full((n_frames, 6), value, np.float32), FPS)
    return Block(motion, head, source or ("speech" if utterance else "idle"), sound, utterance)


def line_of(**options: Any) -> Line:
    """A line of six frames with idle motion."""
    line = Line(FPS, 6, **{"has_idle": True, "draws": False, **options})
    line.idle = Still()  # type: ignore[assignment]
    line.fill()
    return line


def take(line: Line, n_frames: int, *, fills_gaps: bool = False) -> list[Frame]:
    return [frame for _ in range(n_frames) if (frame := line.take(fills_gaps=fills_gaps)) is not None]


def test_speech_replaces_all_but_two_idle_frames() -> None:
    line = line_of()
    take(line, 3)
    line.add(block(4, 1))
    line.add(End(1))
    assert [frame.utterance for frame in take(line, 8)] == [0] * KEPT + [1] * 4 + [0] * 2


def test_the_pose_goes_on_from_the_last_frame_that_is_kept() -> None:
    """The face within 0.15 s, the head within 0.5 s, no step larger than a smooth fade has."""
    line = line_of()
    line.add(block(30, 1))
    frames = take(line, 30)
    jaw, head = np.array([[frame.weights[0], frame.head[0]] for frame in frames]).T
    assert jaw[1] == 0.0
    assert jaw[KEPT + 5] == 1.0
    assert head[KEPT + 14] < 1.0
    assert head[KEPT + 16] == pytest.approx(1.0)
    assert np.diff(jaw).max() < 0.4
    assert np.diff(head).max() < 0.1


def test_the_sound_of_an_utterance_goes_on_without_a_sample_lost() -> None:
    line = line_of()
    parts = [block(5, 1), block(3, 1)]
    for part in parts:
        line.add(part)
    line.add(End(1))
    said = [frame for frame in take(line, 12) if frame.utterance == 1]
    assert np.concatenate([frame.sound for frame in said]) == pytest.approx(
        np.concatenate([part.sound.samples for part in parts if part.sound is not None])
    )
    assert [frame.ends for frame in said] == [False] * 7 + [True]


def test_an_end_that_is_known_late_is_that_of_the_next_frame() -> None:
    line = line_of()
    line.add(block(2, 1))
    frames = take(line, KEPT + 2)
    assert not any(frame.ends for frame in frames)
    assert line.take(fills_gaps=False) is None
    line.add(End(1))
    (last,) = take(line, 1)
    assert (last.ends, last.utterance) == (True, 1)
    assert not line.take(fills_gaps=False).ends  # type: ignore[union-attr]


def test_a_gap_within_an_utterance_is_filled_for_a_reader_who_does_not_wait() -> None:
    line = line_of()
    line.add(block(2, 1))
    take(line, KEPT + 2)
    assert line.take(fills_gaps=False) is None
    (gap,) = take(line, 1, fills_gaps=True)
    assert (gap.utterance, gap.state, gap.sound.any()) == (1, "speaking", False)
    line.add(block(3, 1))
    line.add(End(1))
    frames = take(line, 8)
    assert [frame.sound.any() for frame in frames[: KEPT + 4]] == [False] * KEPT + [True] * 3 + [False]


def test_a_gap_of_pushed_sound_lasts_single_frames() -> None:
    line = line_of()
    line.add(block(2, 1, source="sound"))
    take(line, KEPT + 2)
    take(line, 1, fills_gaps=True)
    line.add(block(2, 1, source="sound"))
    assert [frame.sound.any() for frame in take(line, 2)] == [True, True]


def test_an_interruption_forgets_what_waits_and_says_what_was_heard() -> None:
    line = line_of()
    for number in (1, 2):
        line.add(block(40, number))
        line.add(End(number))
    frames = take(line, KEPT + 10)
    assert line.interrupt() == pytest.approx(10 / FPS)
    after = take(line, 30)
    assert {frame.utterance for frame in after} == {0}
    assert not any(frame.sound.any() for frame in after)
    assert [frame.number for frame in after] == list(range(frames[-1].number + 1, frames[-1].number + 31))
    assert after[0].weights[0] > 0.5  # from the pose that was read
    assert after[5].weights[0] == 0.0


def test_an_utterance_behind_a_forgotten_one_is_whole() -> None:
    line = line_of()
    for number in (1, 2, 3):
        line.add(block(3, number))
        line.add(End(number))
    take(line, KEPT + 1)
    assert line.interrupt(2) == 0.0
    frames = take(line, 12)
    assert [frame.utterance for frame in frames] == [1] * 2 + [3] * 3 + [0] * 7
    expected = block(3, 3).sound
    assert expected is not None
    said = np.concatenate([frame.sound for frame in frames if frame.utterance == 3])
    np.testing.assert_array_equal(said, expected.samples)


def test_nothing_moves_between_utterances_without_idle_motion() -> None:
    line = line_of(has_idle=False)
    assert line.take(fills_gaps=True) is None
    line.add(block(2, 1))
    line.add(End(1))
    assert [frame.ends for frame in take(line, 9)] == [False, True]
    assert line.take(fills_gaps=True) is None
    assert line.hold() is None


def test_the_line_stays_short() -> None:
    """However much waits, and for how long it is read."""
    line = line_of()
    line.add(block(3000, 1))
    for _ in range(500):
        line.take(fills_gaps=False)
        assert len(line._places) <= line.length
    assert line.seconds_waiting == 0.0


def pixels(value: int) -> Any:
    return np.full((1, 1, 3), value, np.uint8)


def test_a_picture_that_is_late_replaces_the_next_one_that_is_missing() -> None:
    line = line_of(draws=True)
    first = line.next_to_draw()
    assert first is not None
    while not first.is_read:
        frame = line.take(fills_gaps=False)
    assert frame is not None
    assert frame.pixels is None
    line.drawn(first, pixels(7), 0.05)
    shown, after = take(line, 2)
    assert shown.pixels is not None
    assert shown.pixels.item(0) == 7
    assert after.pixels is None
    assert line.late == shown.number + 2


def test_no_picture_of_what_is_interrupted_is_shown() -> None:
    line = line_of(draws=True)
    line.add(block(20, 1))
    take(line, KEPT + 3)
    drawing = line.next_to_draw()
    assert drawing is not None
    line.interrupt()
    line.drawn(drawing, pixels(7), 0.01)
    assert all(frame.pixels is None for frame in take(line, 10))


def test_the_drawer_goes_on_after_pictures_that_took_seconds() -> None:
    line = line_of(draws=True)
    for _ in range(20):
        place = line.next_to_draw()
        assert place is not None
        line.drawn(place, pixels(1), 9.0)
        line.take(fills_gaps=False)
    assert line.next_to_draw() is not None


def test_motion_that_repeats_is_joined_to_its_end() -> None:
    line = line_of()
    whole = block(60, 0)
    moved = replace(whole, idle=(whole, slice(0, 60)))  # type: ignore[arg-type]
    line.interrupt()
    line.add(moved)
    assert np.diff([frame.weights[0] for frame in take(line, 20)]).max() < 0.4


def test_the_last_pose_stands_where_a_sentence_is_not_made_in_time() -> None:
    line = line_of(has_idle=False)
    line.idle = None
    line.add(block(2, 1))
    frames = take(line, 2)
    held = line.hold()
    assert held is not None
    assert (held.number, held.utterance, held.pixels) == (2, 1, None)
    assert not held.sound.any()
    assert held.weights is frames[-1].weights


def test_utterances_without_frames_end_one_after_another() -> None:
    """A text of a gesture alone, or a sound without samples; also before there is idle motion."""
    line = line_of()
    line.interrupt()
    take(line, 6)
    for number in (1, 2, 3):
        line.add(End(number))
    assert [frame.utterance for frame in take(line, 10) if frame.ends] == [1, 2, 3]
    early = Line(FPS, 6, has_idle=False, draws=False)
    early.add(End(1))
    early.add(block(2, 2))
    assert early.take(fills_gaps=True) is None
    early.idle = Still()  # type: ignore[assignment]
    early.fill()
    assert [(frame.utterance, frame.ends) for frame in take(early, 9)] == [(1, True), (2, False), (2, False)]
