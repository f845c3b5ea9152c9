"""A made live face on its way to made targets: when it speaks, when it ends, and what it says of errors."""

import io
import os
import threading
import time
import wave
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lexicon.errors import BackendError, InputError, Tts2faceError
from tests.targets.made import FORMAT, Frame, States
from tests.targets.test_live_targets import MadeTarget
from tts2face.picture.options import Picture
from tts2face.targets import broadcast as broadcast_module
from tts2face.targets import live_targets
from tts2face.targets.broadcast import Broadcast, Listener, LivePlan
from tts2face.targets.feeds import AHEAD_S, growing_feed, microphone_feed, recording_feed, text_feed, with_notice
from tts2face.targets.table import parse_target

FPS = 100.0
N_FRAMES = 12  # of an utterance


class MadeStream:
    """Speaks each text in `N_FRAMES` frames; a text with ``?`` cannot be spoken, and has one."""

    channels = ("jawOpen",)
    late = 3

    def __init__(self) -> None:
        self.given: list[Any] = []
        self._frames: list[int] = []  # utterances of the frames that wait
        self._errors: list[Tts2faceError] = []
        self._n = self._number = 0
        self._lock = threading.Lock()

    def __enter__(self) -> "MadeStream":
        return self

    def __exit__(self, *_: object) -> None:
        self.given.append("closed")

    def push_text(self, part: str) -> int:
        with self._lock:
            self.given.append(part)
            self._n += 1
            if "?" in part:
                self._errors.append(InputError(f"cannot speak {part!r}"))
            self._frames += [self._n] * (1 if "?" in part else N_FRAMES)
            return self._n

    def end_text(self) -> None:
        self.given.append("end")

    def push_sound(self, samples: np.ndarray, rate: int) -> int:
        with self._lock:
            self.given.append((len(samples), rate))
            self._n = self._n or 1
            self._frames += [self._n] * max(1, round(len(samples) / rate * FPS))
            return self._n

    end_sound = end_text

    def frames(self) -> Iterator[Any]:
        while True:
            with self._lock:
                if self._errors:
                    raise self._errors.pop()
                utterance = self._frames.pop(0) if self._frames else 0
                ends = bool(utterance) and utterance not in self._frames
            frame = Frame(
                self._number, None, np.zeros(480, np.float32), np.zeros(1, np.float32), np.zeros(6, np.float32)
            )
            object.__setattr__(frame, "utterance", utterance)
            object.__setattr__(frame, "ends", ends)
            yield frame
            self._number += 1
            time.sleep(1 / FPS)


class MadeSession:
    mesh = None

    def __init__(self) -> None:
        self.stream, self.options = MadeStream(), dict[str, Any]()

    def face_stream(self, picture: Picture, **options: Any) -> MadeStream:
        self.options = options
        return self.stream


@pytest.fixture(autouse=True)
def short_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_targets, "FIRST_WAIT_S", 0.05)
    monkeypatch.setattr(live_targets, "CLOSE_S", 0.2)


def made(*targets: MadeTarget, stays: bool = False) -> tuple[Broadcast, MadeSession, States, list[Tts2faceError]]:
    addresses = tuple(parse_target(f"vmc:a{n}") for n in range(len(targets)))
    plan = LivePlan(addresses, Picture(), {"style": "happy"}, FPS, stays=stays)
    states, errors = States(), list[Tts2faceError]()
    return Broadcast(plan, targets, Listener(states, errors.append)), MadeSession(), states, errors


def test_it_ends_after_what_it_says() -> None:
    target = MadeTarget("take")
    broadcast, session, states, errors = made(target)
    broadcast.run(session, text_feed("Hello."))  # type: ignore[arg-type]
    assert session.stream.given == ["Hello.", "end", "closed"]
    assert session.options == {"fps": FPS, "draws": False, "style": "happy"}
    assert states.names()[-1] == "closed"
    assert (broadcast.n_late, errors) == (3, [])
    assert broadcast.n_frames > N_FRAMES
    assert target.taken == sorted(target.taken)


def test_it_speaks_when_each_target_was_tried_and_one_is_there() -> None:
    late, dead = MadeTarget("refuse", "refuse", "take"), MadeTarget("refuse")
    broadcast, session, states, _ = made(late, dead)
    broadcast.run(session, text_feed("Hello."))  # type: ignore[arg-type]
    assert states.names("a0").count("lost") == 2
    assert len(late.taken) > N_FRAMES


def test_nobody_is_waited_for_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broadcast_module, "REACH_S", 0.3)
    broadcast, session, *_ = made(MadeTarget("refuse"))
    with pytest.raises(BackendError, match=r"no target was reached in 0\.3 s; start the receiver"):
        broadcast.run(session, text_feed("Hello."))  # type: ignore[arg-type]
    assert session.stream.given == ["closed"]


def test_a_text_that_cannot_be_spoken_is_said_and_the_rest_goes_on() -> None:
    broadcast, session, _, errors = made(MadeTarget("take"))

    def feed(speaker: Any, _: Callable[[], bool]) -> int:
        speaker.push_text("One.")
        number: int = speaker.push_text("?")
        return number

    broadcast.run(session, feed)  # type: ignore[arg-type]
    assert [str(error) for error in errors] == ["cannot speak '?'"]
    assert broadcast.n_frames > N_FRAMES


def test_it_stays_until_it_is_ended() -> None:
    broadcast, session, states, _ = made(MadeTarget("take"), stays=True)
    running = threading.Thread(target=broadcast.run, args=(session, None))
    running.start()
    states.wait_for("connected")
    broadcast.end()
    running.join(30)
    assert not running.is_alive()
    assert states.names()[-1] == "closed"


def test_a_text_is_said_as_it_is_written() -> None:
    read, write = os.pipe()
    broadcast, session, states, _ = made(MadeTarget("take"))
    running = threading.Thread(target=broadcast.run, args=(session, growing_feed(read)))
    running.start()
    states.wait_for("connected")
    for part in ("Grü".encode()[:3], "Grü".encode()[3:], b"ezi mitenand."):
        os.write(write, part)
        time.sleep(0.1)
    os.close(write)
    running.join(30)
    os.close(read)
    assert not running.is_alive()
    assert "".join(part for part in session.stream.given if part not in {"end", "closed"}) == "Grüezi mitenand."


def test_a_recording_is_given_little_ahead(tmp_path: Path) -> None:
    path, rate = tmp_path / "speech.wav", 16_000
    content = io.BytesIO()
    with wave.open(content, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate)
        tone = np.sin(np.arange(int(rate * (AHEAD_S + 0.5))) / 5)
        file.writeframes((20_000 * tone).astype("<i2").tobytes())
    path.write_bytes(content.getvalue())
    broadcast, session, *_ = made(MadeTarget("take"))
    broadcast.run(session, recording_feed(path))  # type: ignore[arg-type]
    blocks = [given for given in session.stream.given if isinstance(given, tuple)]
    assert {given_rate for _, given_rate in blocks} == {48_000}
    assert sum(n for n, _ in blocks) == pytest.approx(48_000 * (AHEAD_S + 0.5), abs=50)
    assert session.stream.given[-2:] == ["end", "closed"]


def test_a_notice_is_said_before_all_else() -> None:
    broadcast, session, *_ = made(MadeTarget("take"))
    broadcast.run(session, with_notice("This is synthetic.", text_feed("Hello.")))  # type: ignore[arg-type]
    assert session.stream.given == ["This is synthetic.", "end", "Hello.", "end", "closed"]
    broadcast, session, *_ = made(MadeTarget("take"))
    broadcast.run(session, with_notice("This is synthetic.", None))  # type: ignore[arg-type]
    assert session.stream.given == ["This is synthetic.", "end", "closed"]


def test_what_cannot_be_said_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the text is empty"):
        text_feed(" \n")
    with pytest.raises(InputError, match=r"there is no recording .*none\.wav; check the path"):
        recording_feed(tmp_path / "none.wav")


def test_a_microphone_that_is_not_there_ends_the_broadcast() -> None:
    broadcast, session, states, _ = made(MadeTarget("take"), stays=True)
    with pytest.raises(BackendError, match="the microphone 'no-such-device' cannot be opened"):
        broadcast.run(session, microphone_feed("no-such-device"))  # type: ignore[arg-type]
    assert states.names()[-1] == "closed"


def test_names_of_targets_are_those_of_the_operator() -> None:
    plan = LivePlan((parse_target("rtmp://a/secret"),), Picture(), names=("stage",))
    assert plan.shown_names == ("stage",)
    places = [parse_target(place) for place in ("rtmp://a/one", "vmc:a", "rtmp://a/two")]
    assert LivePlan((*places,), Picture()).shown_names == ("rtmp:a:1935", "vmc:a:39539", "rtmp:a:1935 (2)")
    assert plan.format == FORMAT.__class__(plan.format.fps, 512, 512)
