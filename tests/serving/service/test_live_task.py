"""The task of a live stream, without a service."""

import itertools
import json
from collections import deque
from typing import Any

import numpy as np
import pytest

import tts2face
from tts2face.processes.message import MORE, Message
from tts2face.request import TURN_S
from tts2face.serving.service.live import LiveTask
from tts2face.serving.service.live_motion import Projection
from tts2face.serving.service.messages import Event, Inputs, Line, Step, Wait, Work
from tts2face.serving.service.scheduler import InterruptedTaskError
from tts2face.session.live import idle as idle_module
from tts2face.session.live.idle import IDLE_PART_S, idle_motion
from tts2face.session.live.speech import LiveSpeech
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import Chunk


def content_of(step: Step) -> Any:
    """JSON of an event."""
    assert isinstance(step, Event | Line)
    return step.content if isinstance(step, Event) else json.loads(step.content)


def type_of(step: Step) -> str:
    return str(content_of(step)["type"])


def test_a_face_listens_until_it_has_something_to_say() -> None:
    now = [0.0]
    inputs: Inputs = deque([Message(MORE, {"type": "listen", "rate": 16_000})])
    session = tts2face.Session()
    listened: list[Any] = []
    live_of = session.live

    def live(**options: Any) -> Any:
        speech = live_of(**options)
        listen = speech.listen
        speech.listen = lambda seconds, cues: listened.append(cues) or listen(seconds, cues)
        return speech

    session.live = live
    work = Work(kind="live", request={"with_idle": False})
    steps = LiveTask(session, work, inputs, clock=lambda: now[0]).steps()
    pulses = np.sign(np.sin(2 * np.pi * 200 * np.arange(32_000) / 16_000))
    inputs.append(Message(MORE, {"type": "heard"}, (8_000 * pulses).astype("<i2").tobytes()))
    for _ in range(3):
        assert type_of(next(steps)) == "curves"
        now[0] += 0.2
    inputs.append(Message(MORE, {"type": "heard"}, bytes(32_000)))  # a pause
    next(steps)
    assert [len(cues) for cues in listened] == [0, 0, 0, 1]
    inputs.append(Message(MORE, {"type": "say", "text": "Yes."}))
    speech = next(steps).content
    assert speech["type"] == "speech"
    assert speech["phones"][0][2] - speech["begin"] == pytest.approx(TURN_S, abs=0.1)
    assert [type_of(one) for one in itertools.islice(steps, 3) if not isinstance(one, Chunk)][:1] == ["curves"]
    assert len(listened) == 4


def test_idle_motion_is_interrupted_by_cancel() -> None:
    """The stream answers and goes on."""
    inputs: Inputs = deque()
    arriving = [Message(MORE, {"type": "cancel", "arrived": 0.0})]  # between the steps of idle motion

    def interrupt() -> None:
        if arriving:
            inputs.append(arriving.pop())
            raise InterruptedTaskError

    session = tts2face.Session(voices=VoicePool(yield_turn=interrupt))
    steps = LiveTask(session, Work(kind="live"), inputs, clock=lambda: 0.0).steps()
    found = [next(steps) for _ in range(2)]
    assert [type_of(one) for one in found] == ["cancelled", "curves"]


def idle_events(session: tts2face.Session, seconds: float, inputs: Inputs, **options: Any) -> list[Any]:
    """Events and sounds of a stream for some seconds of its clock, on which the making takes no time."""
    now = [0.0]
    found: list[Any] = []
    for step in LiveTask(session, Work(kind="live", request=options), inputs, clock=lambda: now[0]).steps():
        if isinstance(step, Wait):
            now[0] += step.seconds or 1.0
        elif not isinstance(step, Chunk):
            found.append(content_of(step))
        if now[0] > seconds:
            break
    return found


def frames_of(events: list[Any]) -> Any:
    """Weights and head poses of all frames, which follow one another without a gap."""
    curves = [one for one in events if one["type"] == "curves"]
    n_frames = 0
    for one in curves:
        assert one["begin"] == pytest.approx(n_frames / one["fps"], abs=2e-4)
        n_frames += len(one["weights"])
    return np.array(
        [[*weights, *head] for one in curves for weights, head in zip(one["weights"], one["head"], strict=True)]
    )


def test_streams_of_equal_options_share_their_idle_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is made once, in long parts; other options have another one."""
    session, made = tts2face.Session(), list[float]()
    idle = LiveSpeech.idle
    monkeypatch.setattr(LiveSpeech, "idle", lambda speech, seconds: made.append(seconds) or idle(speech, seconds))
    first, second = (frames_of(idle_events(session, 4.0, deque())) for _ in range(2))
    assert np.array_equal(first, second)
    assert made == [IDLE_PART_S]
    assert np.ptp(first[:, -6:], axis=0).max() > 0.01  # the head moves
    assert not np.array_equal(first, frames_of(idle_events(session, 4.0, deque(), seed=5)))
    assert made == [IDLE_PART_S] * 2


def test_idle_motion_is_that_of_a_clip() -> None:
    session = tts2face.Session()
    frames = frames_of(idle_events(session, 2.0, deque()))
    clip = next(iter(session.live().idle(IDLE_PART_S))).clip
    assert np.abs(frames - Projection(session).frames(clip.motion, clip.head)[: len(frames)]).max() <= 5e-5


def test_speech_and_idle_motion_join_without_a_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """From idle motion to speech, back, and where idle motion repeats: no step is larger than those within."""
    monkeypatch.setattr(idle_module, "IDLE_LOOP_S", IDLE_PART_S)
    session, inputs = tts2face.Session(), Inputs()
    inputs.append(Message(MORE, {"type": "say", "text": "Yes."}))
    spoken = frames_of(idle_events(session, 8.0, inputs, seed=3))
    idle = frames_of(idle_events(session, 12.0, deque(), seed=3))
    usual = np.abs(np.diff(idle[:140, -6:], axis=0)).max(axis=0)  # within the first part
    for frames in (spoken, idle):
        assert (np.abs(np.diff(frames[:, -6:], axis=0)) <= 3.0 * usual + 2e-3).all()
        assert frames[:, :52].min() >= 0.0
        assert frames[:, :52].max() <= 1.0


def test_another_stream_waits_while_idle_motion_is_made() -> None:
    """A turn in the middle of the making shows another stream nothing half made."""
    session = tts2face.Session()
    idle = idle_motion(session.live(sound_rate=None))
    with idle._growing:
        steps = LiveTask(session, Work(kind="live"), deque(), clock=lambda: 0.0).steps()
        assert isinstance(next(steps), Wait)
    assert type_of(next(steps)) == "curves"


def stream_events(session: tts2face.Session, *messages: dict[str, Any], **options: Any) -> list[Any]:
    """Events of a stream that gets messages at once, and its end."""
    return idle_events(session, 8.0, deque(Message(MORE, one) for one in (*messages, {"type": "end"})), **options)


def nod(**fields: Any) -> dict[str, Any]:
    return {"type": "gesture", "gesture": {"at": 0, "name": "nod", **fields}}


def test_a_gesture_is_made_with_the_next_word() -> None:
    session = tts2face.Session()
    say = {"type": "say", "text": "Well, yes."}
    events = stream_events(session, nod(), nod(name="shake"), nod(name="shake", size=2.0), say, with_idle=False)
    speech = next(one for one in events if one["type"] == "speech")
    made = [one for one in events if one["type"] == "gesture"]
    assert [one["name"] for one in made] == ["nod", "shake"]
    assert [one["at"] for one in made] == pytest.approx([speech["words"][0][1]] * 2, abs=1e-3)
    plain = stream_events(session, say, with_idle=False)
    still = frames_of(plain)
    pitch, turn, _ = np.degrees(frames_of(events)[: len(still), -6:-3] - still[:, -6:-3]).T
    assert pitch.max() > 5.0
    assert np.ptp(turn) > 15.0


def test_a_gesture_in_silence_is_made_now_and_the_stream_ends_behind_it() -> None:
    for options in ({"with_idle": False}, {}):
        events = stream_events(tts2face.Session(), nod(name="tilt"), **options)
        assert events[0]["type"] == "gesture"
        frames = np.degrees(frames_of(events)[:, -6:-3])
        assert np.abs(frames[:, 2]).max() > 6.0
        assert 1.8 < len(frames) / 30 < 3.0


def test_a_gesture_alone_in_a_text_is_one_of_the_silence() -> None:
    events = stream_events(tts2face.Session(), {"type": "say", "text": "[wink left]"}, with_idle=False)
    assert {one["type"] for one in events} >= {"gesture", "curves"}
    assert "error" not in {one["type"] for one in events}


def test_a_style_holds_from_the_next_word_on() -> None:
    session = tts2face.Session()
    say = [{"type": "say", "text": text} for text in ("We were away.", "We were away.")]
    style = {"type": "style", "style": "cheerful"}
    inputs: Inputs = deque(Message(MORE, one) for one in say[:1])
    events: list[Any] = []
    for step in LiveTask(session, Work(kind="live", request={"with_idle": False}), inputs, clock=lambda: 0.0).steps():
        if isinstance(step, Wait):
            if any(one["type"] == "style" for one in events):
                break
            inputs += [Message(MORE, one) for one in (style, say[1], {"type": "end"})]
        elif not isinstance(step, Chunk):
            events.append(content_of(step))
    first, second = (one for one in events if one["type"] == "speech")
    changed = next(one for one in events if one["type"] == "style")
    assert changed == {"type": "style", "style": "cheerful", "at": pytest.approx(second["begin"], abs=1e-3)}
    names = next(one["names"] for one in events if one["type"] == "curves")
    smiles = frames_of(events)[:, names.index("mouthSmileLeft")]
    middle = round(changed["at"] * 30)
    assert smiles[middle + 20 :].mean() > smiles[: middle - 10].mean() + 0.15
    # the voice is that of the style, too
    assert second["seconds"] != pytest.approx(first["seconds"], abs=0.02)


def test_an_unknown_style_is_an_error_and_the_stream_goes_on() -> None:
    events = stream_events(
        tts2face.Session(), {"type": "style", "style": "purple"}, {"type": "say", "text": "Yes."}, with_idle=False
    )
    assert events[0]["message"].startswith("there is no style 'purple' in the palette; it has neutral")
    assert "speech" in {one["type"] for one in events}


@pytest.mark.parametrize("style", ["cheerful", "delighted", "auto"])
def test_a_style_of_a_speech_service_holds_in_idle_motion_too(style: str) -> None:
    say, change = {"type": "say", "text": "Yes."}, {"type": "style", "style": style}
    events = stream_events(tts2face.Session(), say, change, say, with_idle=True)
    assert "error" not in {one["type"] for one in events}
    assert [one["style"] for one in events if one["type"] == "style"] == [style]
    assert sum(one["type"] == "speech" for one in events) == 2


def test_the_idle_motion_has_the_style() -> None:
    events = stream_events(
        tts2face.Session(), {"type": "listen", "rate": None}, {"type": "style", "style": "delighted"}
    )
    assert events[0] == {"type": "style", "style": "delighted", "at": 0.0}


def test_cancel_forgets_gestures_that_wait() -> None:
    events = stream_events(tts2face.Session(), nod(), {"type": "cancel", "arrived": 0.0}, with_idle=False)
    assert [one["type"] for one in events] == ["cancelled"]


def test_the_style_auto_follows_the_words_and_says_why() -> None:
    say = {"type": "say", "text": "We won the cup!"}
    events = stream_events(tts2face.Session(), {"type": "style", "style": "auto"}, say, with_idle=False)
    note = "'We won the cup!' is delighted, by We won (2.5)"
    assert [one["message"] for one in events if one["type"] == "note"] == [note]
    plain = stream_events(tts2face.Session(), say, with_idle=False)
    names = next(one["names"] for one in events if one["type"] == "curves")
    smile, usual = (frames_of(found)[:, names.index("mouthSmileLeft")].max() for found in (events, plain))
    assert smile > usual + 0.15
