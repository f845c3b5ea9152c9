"""A live face on a clock: what is said and pushed comes out as frames, in order, without a jump."""

import asyncio
import itertools
import threading
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import tts2face
from lexicon.errors import InputError
from tests.golden.requests import with_pictures
from tests.running import eventually
from tests.tones import WorldVoices
from tests.world import World
from tts2face.session.live.frames import Frame
from tts2face.session.live.stream import THREAD, FaceStream
from tts2face.session.speech_stream import Piece
from tts2face.types import SOUND_RATE, concatenate_clips, exact_rate, first_sample

TEXT = "We were away. Bob may move."
PATIENCE_S = 60.0  # until a frame is there; the tests pass at once on any machine that is not stuck


@pytest.fixture(scope="module")
def session(world: World) -> tts2face.Session:
    return world.session()


@pytest.fixture(scope="module")
def hearing() -> tts2face.Session:
    """A session whose talker has a map for live sound."""
    return tts2face.Session(voices=WorldVoices())


def until_end(stream: FaceStream, number: int) -> list[Frame]:
    """Frames up to the last one of an utterance."""
    found: list[Frame] = []
    while not found or not (found[-1].ends and found[-1].utterance == number):
        frame = stream.read(PATIENCE_S)
        assert frame is not None
        found.append(frame)
    return found


def said(frames: list[Frame], number: int) -> list[Frame]:
    return [frame for frame in frames if frame.utterance == number]


def tone(seconds: float, rate: int = 16_000) -> np.ndarray:
    """A voice-like sound whose loudness changes three times a second."""
    times = np.arange(round(seconds * rate)) / rate
    pulses = np.sign(np.sin(2 * np.pi * 120 * times)) * (0.5 + 0.5 * np.sin(2 * np.pi * 3 * times))
    return (0.3 * pulses).astype(np.float32)


@pytest.mark.parametrize("fps", [25.0, 29.97, 30.0])
def test_speech_is_that_of_a_clip_and_ticks_have_their_samples(session: tts2face.Session, fps: float) -> None:
    with session.face_stream(fps=fps, draws=False, idle=False) as stream:
        frames = until_end(stream, stream.say(TEXT))
    live = session.live(fps=fps)
    clip = concatenate_clips([piece.clip for piece in live.say(TEXT)])
    assert len(frames) == len(clip.motion)
    assert [frame.number for frame in frames] == list(range(len(frames)))
    ends = [first_sample(number, SOUND_RATE, exact_rate(fps)) for number in range(len(frames) + 1)]
    assert [len(frame.sound) for frame in frames] == [b - a for a, b in itertools.pairwise(ends)]
    sound = np.concatenate([frame.sound for frame in frames])
    assert np.abs(sound[: len(clip.speech.waveform.samples)] - clip.speech.waveform.samples).max() == 0.0
    np.testing.assert_array_equal([frame.weights for frame in frames], clip.motion.values)
    np.testing.assert_array_equal([frame.head for frame in frames], clip.head.values)
    assert stream.channels == clip.motion.channels
    assert Fraction(ends[-1], SOUND_RATE) * exact_rate(fps) - len(frames) < Fraction(1, 100)


def test_sound_is_that_of_a_text_whatever_lies_before_it(session: tts2face.Session) -> None:
    """Idle frames before it shift its first sample on the clock; no sample is lost, doubled or filled."""
    with session.face_stream(fps=29.97, draws=False) as stream:
        for _ in range(7):
            assert stream.read(PATIENCE_S) is not None
        number = stream.say(TEXT)
        frames = said(until_end(stream, number), number)
    whole = np.concatenate([piece.clip.speech.waveform.samples for piece in session.live(fps=29.97).say(TEXT)])
    found = np.concatenate([frame.sound for frame in frames])
    n_samples = min(len(found), len(whole))
    assert abs(len(found) - len(whole)) <= 2
    np.testing.assert_array_equal(found[:n_samples], whole[:n_samples])


def test_words_and_phones_begin_in_their_frames(session: tts2face.Session) -> None:
    with session.face_stream(draws=False, idle=False) as stream:
        frames = until_end(stream, stream.say(TEXT))
    events = [(frame.number, event) for frame in frames for event in frame.events]
    assert [event.text for _, event in events if event.kind == "word"] == ["We", "were", "away.", "Bob", "may", "move."]
    assert [event.text for _, event in events if event.kind == "sentence"] == ["We were away.", "Bob may move."]
    for number, event in events:
        assert 0.0 <= event.start - number / 30 < 1 / 30 + 1e-6


def test_utterances_follow_one_another_in_order(hearing: tts2face.Session) -> None:
    with hearing.face_stream(draws=False) as stream:
        numbers = [stream.say("One."), stream.push_sound(tone(0.3), 16_000), stream.say("Two.")]
        stream.push_sound(tone(0.3), 16_000)
        stream.end_sound()
        frames = until_end(stream, numbers[-1])
    assert numbers == [1, 2, 3]
    order = [number for number, _ in itertools.groupby(frame.utterance for frame in frames if frame.utterance)]
    assert order == numbers
    assert [frame.utterance for frame in frames if frame.ends] == numbers
    assert {frame.state for frame in frames if frame.utterance} == {"speaking"}
    assert {frame.state for frame in frames if not frame.utterance} <= {"idle"}
    assert len(said(frames, 2)) == 18


@pytest.mark.parametrize("rate", [16_000, 24_000, 48_000])
def test_pushed_sound_comes_out_whole(hearing: tts2face.Session, rate: int) -> None:
    """In blocks of any size; all that leaves has one rate."""
    sound = tone(1.0, rate)
    with hearing.face_stream(draws=False, idle=False) as stream:
        for block in np.array_split(sound, 23):
            number = stream.push_sound(block, rate)
        stream.end_sound()
        frames = until_end(stream, number)
    assert len(frames) == 30
    found = np.concatenate([frame.sound for frame in frames])
    expected = tts2face.Waveform(sound, rate).resampled(SOUND_RATE).samples
    assert np.corrcoef(found[2000:-2000], expected[2000 : len(found) - 2000])[0, 1] > 0.999
    assert np.ptp([frame.weights for frame in frames], axis=0).max() > 0.01


def test_nothing_of_what_is_interrupted_comes_after_it(session: tts2face.Session) -> None:
    with session.face_stream(draws=False) as stream:
        first = stream.say(TEXT * 5)
        frames = [stream.read(PATIENCE_S)]
        while len(said(frames, first)) < 60:
            frames.append(stream.read(PATIENCE_S))
        begun = len(frames) - 60
        heard = stream.interrupt()
        assert heard == pytest.approx((len(frames) - begun) / 30)
        second = stream.say("Yes.")
        after = until_end(stream, second)
    assert {frame.utterance for frame in after} <= {0, second}
    assert not any(np.abs(frame.sound).max() for frame in after if not frame.utterance)
    assert after[0].number == frames[-1].number + 1
    steps = np.abs(np.diff([frame.head[:3] for frame in [*frames[-30:], *after]], axis=0)).max(axis=1)
    within = np.abs(np.diff([frame.head[:3] for frame in frames[begun:]], axis=0)).max()
    assert steps.max() < 2.0 * within + np.radians(0.2)
    jaw = [frame.weights[stream.channels.index("jawOpen")] for frame in [*frames[begun:], *after[:10]]]
    assert np.abs(np.diff(jaw[59:])).max() < 1.5 * np.abs(np.diff(jaw[:60])).max() + 0.05


def test_one_utterance_of_several_is_forgotten(session: tts2face.Session) -> None:
    with session.face_stream(draws=False) as stream:
        numbers = [stream.say("One."), stream.say("Two."), stream.say("Three.")]
        assert stream.interrupt(numbers[1]) == 0.0
        frames = until_end(stream, numbers[2])
    assert {frame.utterance for frame in frames} - {0} == {numbers[0], numbers[2]}
    words = [event.text for frame in frames for event in frame.events if event.kind == "word"]
    assert words == ["One.", "Three."]


def test_an_interrupted_sound_is_followed_by_another_one(hearing: tts2face.Session) -> None:
    with hearing.face_stream(draws=False) as stream:
        first = stream.push_sound(tone(1.0), 16_000)
        eventually(lambda: stream.read(PATIENCE_S).utterance == first, PATIENCE_S)
        assert stream.interrupt() > 0.0
        second = stream.push_sound(tone(0.5, 24_000), 24_000)
        stream.end_sound()
        assert second != first
        assert len(said(until_end(stream, second), second)) == 15


def test_text_that_grows_is_one_utterance(session: tts2face.Session) -> None:
    with session.face_stream(draws=False, idle=False) as stream:
        numbers = {stream.push_text(part) for part in ("We were aw", "ay. Bob ", "may move.")}
        stream.end_text()
        frames = until_end(stream, min(numbers))
    assert len(numbers) == 1
    sentences = [event.text for frame in frames for event in frame.events if event.kind == "sentence"]
    assert sentences == ["We were away.", "Bob may move."]


def test_style_gesture_and_gaze_come_in_the_middle(session: tts2face.Session) -> None:
    with session.face_stream(draws=False, idle=False) as stream:
        stream.gesture("shake")
        stream.gesture("look left 20 2s")
        stream.style("wild")
        frames = until_end(stream, stream.say(TEXT))
    gestures = [event.text for frame in frames for event in frame.events if event.kind == "gesture"]
    assert sorted(gestures) == ["look_at", "shake"]
    assert np.ptp(np.degrees([frame.head[1] for frame in frames])) > 5.0


def test_a_listening_face_nods_at_what_it_hears_until_it_speaks(session: tts2face.Session) -> None:
    with session.face_stream(draws=False, idle=False) as stream:
        stream.listen(tone(2.0), 16_000)
        stream.listen(np.zeros(16_000, np.float32), 16_000)
        assert {stream.read(PATIENCE_S).state for _ in range(30)} == {"listening"}
        frames = until_end(stream, stream.say("Yes."))
    assert frames[-1].state == "speaking"


def test_a_listening_face_is_not_idle_in_between(session: tts2face.Session) -> None:
    with session.face_stream(draws=False) as stream:
        stream.listen()
        eventually(lambda: stream.read(PATIENCE_S).state == "listening", PATIENCE_S)
        assert {stream.read(PATIENCE_S).state for _ in range(60)} == {"listening"}


def test_errors_of_a_text_are_raised_by_the_next_read_and_the_stream_goes_on(session: tts2face.Session) -> None:
    with session.face_stream(draws=False, idle=False) as stream:
        stream.style("purple")
        with pytest.raises(InputError, match="there is no style 'purple'"):
            stream.read(PATIENCE_S)
        assert until_end(stream, stream.say("Yes."))


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda stream: stream.push_sound(np.zeros((2, 2)), 16_000), "must be a vector"),
        (lambda stream: stream.push_sound(np.full(4, np.nan), 16_000), "finite samples"),
        (lambda stream: stream.push_sound(np.zeros(4), 100), "between 8000 and 192000 Hz, not 100"),
        (lambda stream: (stream.push_sound(np.zeros(4), 16_000), stream.push_sound(np.zeros(4), 8_000)), "16000 Hz"),
        (lambda stream: stream.gesture("somersault"), "there is no gesture 'somersault'"),
        (lambda stream: stream.listen(np.zeros(4)), "need their rate"),
        (lambda stream: stream.gesture(5), "there is no gesture '5'"),
        (lambda stream: stream.say(None), "text must be a text in quotes, not null"),
        (lambda stream: stream.push_text(5), "part must be a text in quotes, not 5"),
        (lambda stream: stream.style(None), "style must be a text in quotes, not null"),
    ],
)
def test_what_cannot_be_followed_is_refused_at_once(session: tts2face.Session, call: object, reason: str) -> None:
    with session.face_stream(draws=False) as stream, pytest.raises(InputError, match=reason):
        call(stream)


def test_each_utterance_ends_also_one_that_cannot_be_spoken(session: tts2face.Session) -> None:
    """Whoever waits for an end gets one, behind the error and in the order of what was said."""
    lacks_map = np.zeros(800, np.float32)
    reasons: list[str] = []
    with session.face_stream(draws=False) as stream:
        numbers = [
            stream.say("One."),
            stream.say("<speak>a<b"),
            stream.say("   "),
            stream.push_sound(lacks_map, 16_000),
        ]
        stream.end_sound()
        numbers += [stream.push_text("<speak>a<b"), stream.say("Two.")]
        stream.end_text()
        ended: list[int] = []
        while len(ended) < len(numbers):
            try:
                frame = stream.read(PATIENCE_S)
            except InputError as refused:
                reasons.append(str(refused))
                continue
            assert frame is not None
            ended += [frame.utterance] * frame.ends
    assert ended == numbers
    assert sum("not well-formed" in reason for reason in reasons) == 2


@pytest.mark.parametrize("ahead_s", [0.0, 2.5])
def test_lines_of_other_lengths_are_refused(session: tts2face.Session, ahead_s: float) -> None:
    with pytest.raises(InputError, match="ahead_s must be above 0"):
        session.face_stream(ahead_s=ahead_s)


def test_a_closed_stream_takes_nothing_and_has_no_frames(session: tts2face.Session) -> None:
    stream = session.face_stream(draws=False)
    stream.close()
    assert THREAD not in {thread.name for thread in threading.enumerate()}
    assert stream.read(PATIENCE_S) is None
    assert list(stream.frames()) == []
    with pytest.raises(InputError, match="the stream is closed"):
        stream.say("Yes.")


def test_frames_have_pictures_of_their_poses(session: tts2face.Session) -> None:
    """Of a reader who waits for them, nearly all frames have a picture of their own."""
    with session.face_stream(size="48x48", idle=False, fps=10) as stream:
        number = stream.say(TEXT)
        frames = list(_paced(stream, number))
    drawn = [frame for frame in frames if frame.pixels is not None]
    assert len(drawn) >= len(frames) - stream.late
    assert {frame.pixels.shape for frame in drawn} == {(48, 48, 3)}
    assert len({frame.pixels.tobytes() for frame in drawn}) > 3


def _paced(stream: FaceStream, number: int) -> Iterator[Frame]:
    for frame in stream.frames():
        yield frame
        if frame.ends and frame.utterance == number:
            return


def test_an_event_loop_reads_frames_and_goes_on_meanwhile(session: tts2face.Session) -> None:
    turns = 0

    async def turn() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    async def run() -> list[Frame]:
        found: list[Frame] = []
        async with session.face_stream(draws=False) as stream:
            number = stream.say("Yes.")
            async for frame in stream:
                found.append(frame)
                if frame.ends and frame.utterance == number:
                    break
        return found

    async def both() -> list[Frame]:
        other = asyncio.create_task(turn())
        try:
            return await run()
        finally:
            other.cancel()

    frames = asyncio.run(both())
    assert [frame.number for frame in frames] == list(range(len(frames)))
    assert turns > len(frames)


def test_the_face_lives_while_a_sentence_is_synthesised(session: tts2face.Session) -> None:
    goes_on = threading.Event()
    with session.face_stream(draws=False) as stream:
        say = stream._face.speech.say

        def wait_and_say(text: str) -> Iterator[Piece]:
            goes_on.wait(PATIENCE_S)
            return say(text)

        stream._face.speech.say = wait_and_say  # type: ignore[method-assign]
        number = stream.say("Yes.")
        idle = [stream.read(PATIENCE_S) for _ in range(200)]  # longer than what is made of the idle motion
        goes_on.set()
        until_end(stream, number)
    steps = np.abs(np.diff([frame.head[:3] for frame in idle], axis=0))
    assert steps.max() < np.radians(2.0)
    assert (steps.max(axis=1) > 0.0).mean() > 0.9


def test_without_idle_motion_nothing_comes_between_two_utterances(session: tts2face.Session) -> None:
    with session.face_stream(draws=False, idle=False) as stream:
        numbers = [stream.say("One.")]
        found = []
        for frame in stream.frames():
            found.append(frame.utterance)
            if frame.ends and len(numbers) == 2:
                break
            if frame.ends:
                numbers.append(stream.say("Two."))
    assert set(found) == set(numbers)


def test_the_first_frame_has_a_picture(session: tts2face.Session) -> None:
    with session.face_stream(size="16x16") as stream:
        assert stream.read(PATIENCE_S).pixels is not None


@pytest.mark.parametrize("is_own", [False, True])
def test_faces_without_gestures_and_a_talker_s_own_face_are_live_too(world: World, is_own: bool) -> None:
    """What is said, and idle frames around it, are in the channels of the face."""
    own: dict[str, Any] = {"talker": with_pictures(world.talker), "face": "self"}
    session = world.session(**own if is_own else {"palette": None})
    with session.face_stream(size="32x32") as stream:
        frames = until_end(stream, stream.say("Yes."))
    assert {len(frame.weights) for frame in frames} == {len(stream.channels)}
    assert session.animated_face().channels == stream.channels
    assert any(frame.pixels is not None for frame in frames)


def test_sound_and_lips_are_those_of_a_clip(session: tts2face.Session) -> None:
    with session.face_stream(draws=False, idle=False) as stream:
        frames = until_end(stream, stream.say(TEXT))
    clip = session.clip(TEXT, fps=30)
    sound = clip.speech.waveform.resampled(SOUND_RATE).samples
    found = np.concatenate([frame.sound for frame in frames])
    assert abs(len(found) - len(sound)) <= SOUND_RATE / 30
    n_samples = min(len(found), len(sound))
    assert np.abs(found[:n_samples] - sound[:n_samples]).max() < 1e-2  # each sentence is resampled alone
    jaw = [frame.weights[stream.channels.index("jawOpen")] for frame in frames[: len(clip.motion)]]
    np.testing.assert_allclose(jaw, clip.motion.columns(["jawOpen"])[: len(jaw), 0], atol=1e-6)
