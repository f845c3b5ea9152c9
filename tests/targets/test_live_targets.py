"""What becomes of targets: states, another try after a loss, and what waits for a slow one."""

import asyncio
import errno
import itertools
import os
import socket
import ssl
import threading
from collections.abc import Callable

import numpy as np
import pytest

from tests.running import eventually
from tests.targets.made import FORMAT, States, made_tick
from tts2face.targets import live_targets
from tts2face.targets.address import Address
from tts2face.targets.live_targets import LiveTargets
from tts2face.targets.states import TargetState
from tts2face.targets.table import make_target, parse_target
from tts2face.targets.target import ConnectedTarget, Outbox, TargetLostError
from tts2face.targets.tick import LiveFrame, TickMaker
from tts2face.targets.vts import parameters


class MadeTarget(ConnectedTarget):
    """Fails, takes nothing, or takes ticks, by its plan: one word for each connection."""

    def __init__(self, *plan: str, n_kept: int = 1) -> None:
        super().__init__(Address("made", "here", 1), FORMAT, n_kept)
        self.plan, self.taken = list(plan), list[int]()

    async def deliver(self, on_connected: Callable[[], None]) -> None:
        step = self.plan.pop(0) if len(self.plan) > 1 else self.plan[0]
        if step == "refuse":
            raise TargetLostError("it is full")
        if step == "hang":
            await asyncio.Event().wait()
        on_connected()
        while ticks := await self.outbox.take():
            self.taken += [tick.number for tick in ticks]
            if step == "lose":
                raise ConnectionResetError(104, "Connection reset by peer")
            if step == "stall":
                await asyncio.Event().wait()


@pytest.fixture(autouse=True)
def short_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_targets, "FIRST_WAIT_S", 0.01)
    monkeypatch.setattr(live_targets, "CLOSE_S", 0.2)


def kept(*targets: MadeTarget) -> tuple[LiveTargets, States]:
    states = States()
    return LiveTargets(targets, [f"t{n}" for n in range(len(targets))], states), states


def test_a_lost_target_is_tried_again_and_says_why() -> None:
    target = MadeTarget("refuse", "lose", "take")
    live, states = kept(target)
    numbers = itertools.count()
    with live:
        eventually(lambda: (live.send(made_tick(next(numbers))), states.names().count("connected") == 2)[1])
        eventually(lambda: (live.send(made_tick(next(numbers))), len(target.taken) > 1)[1])
    assert states.names() == [
        "connecting", "lost", "connecting", "connected", "lost", "connecting", "connected", "closed",
    ]  # fmt: skip
    sentences = [state.sentence for state in states.all if state.state == "lost"]
    assert sentences == [
        "t0: lost: it is full; it is tried again in 0.01 s",
        "t0: lost: connection reset by peer; it is tried again in 0.02 s",
    ]


def test_waits_grow_to_the_longest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_targets, "LONGEST_WAIT_S", 0.03)
    live, states = kept(MadeTarget("refuse"))
    with live:
        eventually(lambda: states.names().count("lost") > 4)
    waits = [state.retry_s for state in states.all if state.state == "lost"]
    assert waits[:4] == [0.01, 0.02, 0.03, 0.03]


def test_a_dead_a_slow_and_a_hanging_target_hold_no_other_up() -> None:
    slow, dead, hanging, good = (MadeTarget(word) for word in ("stall", "refuse", "hang", "take"))
    live, states = kept(slow, dead, hanging, good)
    with live:
        states.wait_for("connected", "t3")
        states.wait_for("connected", "t0")
        for number in range(50):
            live.send(made_tick(number))
            eventually(lambda number=number: good.taken[-1:] == [number])
    assert good.taken == list(range(50))
    assert len(slow.taken) <= 1
    assert states.names()[-4:] == ["closed"] * 4


def test_what_waits_is_sent_before_the_end() -> None:
    target = MadeTarget("take", n_kept=10)
    live, states = kept(target)
    with live:
        states.wait_for("connected")
        for number in range(5):
            live.send(made_tick(number))
    assert target.taken == list(range(5))


def test_a_fault_of_the_product_is_not_a_loss() -> None:
    class Faulty(MadeTarget):
        async def deliver(self, on_connected: Callable[[], None]) -> None:
            raise AssertionError("a fault")

    faults: list[BaseException | None] = []
    hook, threading.excepthook = threading.excepthook, lambda given: faults.append(given.exc_value)
    try:
        live, states = kept(Faulty("take"))
        with live:
            states.wait_for("connecting")
    finally:
        threading.excepthook = hook
    assert [str(fault) for fault in faults] == ["a fault"]


def test_an_outbox_keeps_the_newest_picture_and_bounded_sound() -> None:
    async def run() -> None:
        outbox = Outbox(4)
        outbox.put(made_tick(0))
        outbox.begin()
        for number in range(1, 8):
            outbox.put(made_tick(number))
        taken = await outbox.take()
        assert [tick.number for tick in taken] == [4, 5, 6, 7]
        assert [tick.pixels is not None for tick in taken] == [False, False, False, True]
        outbox.end()
        assert await outbox.take() == []

    asyncio.run(run())


def test_datagrams_to_nobody_cost_nothing_and_lose_nothing() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(30)
        port = receiver.getsockname()[1]
        names = [f"livelink:127.0.0.1:{port}", "vmc:127.0.0.1:9"]
        targets = [make_target(parse_target(name), FORMAT) for name in names]
        states = States()
        with LiveTargets(targets, names, states) as live:
            for name in names:
                states.wait_for("connected", name)
            for number in range(20):
                live.send(made_tick(number))
            received = [receiver.recv(4096) for _ in range(20)]
    assert len({len(data) for data in received}) == 1


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(errno.ECONNREFUSED, "Connect call failed ('10.0.0.7', 9790)"), os.strerror(errno.ECONNREFUSED)),
        (OSError("Multiple exceptions: Connect call failed ('10.0.0.7', 80)"), "it cannot be reached"),
        (socket.gaierror(-2, "Name or service not known"), "name or service not known"),
        (ssl.SSLCertVerificationError(1, "certificate is not valid for '10.0.0.7'"), "the encryption fails"),
        (TimeoutError("timed out during opening handshake"), "it does not answer"),
        (TargetLostError("it is full"), "it is full"),
    ],
)
def test_reasons_hold_no_address(error: Exception, reason: str) -> None:
    """A client of the service reads them, too."""
    found = live_targets.reason_of(error)
    assert found.lower().startswith(reason.lower())
    assert "10.0.0.7" not in found


def test_an_unknown_host_is_a_loss_with_its_reason() -> None:
    target = make_target(parse_target("vmc:no-such-host.invalid"), FORMAT)
    states = States()
    with LiveTargets([target], ["vmc"], states):
        lost = states.wait_for("lost")
    assert lost.reason
    assert lost.sentence.startswith("vmc: lost: ")


def test_ticks_project_weights_once_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    class Frame:
        number, pixels = 6, None
        sound = np.zeros(1600, np.float32)
        weights = np.array([0.25, 0.5], np.float32)
        head = np.zeros(6, np.float32)

    frame: LiveFrame = Frame()
    plain = TickMaker(FORMAT, ("jawOpen", "eyeBlinkLeft"), None).make(frame)
    assert plain.weights is None
    assert plain.seconds == pytest.approx(0.2)
    assert np.array_equal(plain.motion, Frame.weights)


def test_parameters_of_vtube_studio_follow_the_table() -> None:
    tick = made_tick(5)
    assert tick.weights is not None
    tick.weights[:] = 0
    rest = parameters(tick)
    assert rest["MouthOpen"] == 0
    assert rest["EyeOpenLeft"] == rest["EyeOpenRight"] == 1
    assert rest["MouthSmile"] == rest["Brows"] == 0.5
    assert rest["FaceAngleX"] == pytest.approx(np.degrees(0.2), abs=1e-3)
    assert rest["FaceAngleY"] == pytest.approx(-np.degrees(0.1), abs=1e-3)
    names = ("jawOpen", "mouthClose", "eyeBlinkLeft")
    from tts2face.interchange.exports.arkit import ARKIT_SHAPES

    tick.weights[[ARKIT_SHAPES.index(name) for name in names]] = [0.5, 0.5, 1.0]
    closed = parameters(tick)
    assert closed["MouthOpen"] == 0
    assert closed["EyeOpenLeft"] == 0


def test_states_are_one_sentence() -> None:
    assert TargetState("vmc:a:1", "connected").sentence == "vmc:a:1: connected"
    assert TargetState("a", "lost", "it does not answer", 4.0).sentence == (
        "a: lost: it does not answer; it is tried again in 4 s"
    )
