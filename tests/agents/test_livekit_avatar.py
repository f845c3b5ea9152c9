"""An avatar under LiveKit's own runner: order, interruption, playback, no lost sound."""

import asyncio

import numpy as np
import pytest

from lexicon.errors import InputError
from tests.agents.livekit_stage import RATE, Stage, perform
from tests.agents.made import FPS, SIZE, TICK, FakeSession, tone
from tts2face.types import SOUND_RATE

pytestmark = pytest.mark.needs("livekit.agents")


def test_sound_leaves_whole_with_a_picture_before_each_tick_and_its_end_is_told() -> None:
    async def script(stage: Stage) -> None:
        await stage.until(lambda: len(stage.given) > 5)  # idle: pictures alone
        assert {kind for kind, _ in stage.given} == {"picture"}
        await stage.say(tone(0.5, RATE))
        await stage.until(lambda: stage.ended)

    stage = perform(script)
    assert stage.ended == [(pytest.approx(0.5, abs=1 / FPS), False)]
    assert len(stage.sound) == round(0.5 * SOUND_RATE)
    assert abs(stage.sound).min() > 0  # nothing filled in
    # what is seen is at most the runner's own line before what is heard, and never behind it by more than that
    n_pictures = n_ticks = 0
    for kind, value in stage.given:
        n_ticks += kind == "sound"
        n_pictures += kind == "picture" and value[1, 0, 0] == 1
        assert abs(n_pictures - n_ticks) <= round(0.1 * FPS) + 1
    assert n_ticks == round(0.5 * SOUND_RATE / TICK)


def test_each_segment_has_an_end_of_its_own() -> None:
    async def script(stage: Stage) -> None:
        await stage.say(tone(0.2, RATE))
        await stage.say(tone(0.02, RATE))  # one block
        await stage.say(tone(0.1, RATE))
        await stage.until(lambda: len(stage.ended) == 3)

    stage = perform(script)
    assert [position for position, _ in stage.ended] == pytest.approx([0.2, 0.02, 0.1], abs=1 / FPS)
    assert not any(interrupted for _, interrupted in stage.ended)


def test_after_an_interruption_nothing_old_is_seen_or_heard() -> None:
    async def script(stage: Stage) -> None:
        await stage.say(tone(3.0, RATE), is_whole=False)
        await stage.until(lambda: len(stage.sound) > 0.3 * SOUND_RATE)
        stage.audio.clear_buffer()
        await stage.until(lambda: stage.ended)
        n_given = len(stage.given)
        await stage.until(lambda: len(stage.given) > n_given + 20)
        old = stage.given[n_given:]
        assert [kind for kind, _ in old if kind == "sound"] == []
        # a picture that the runner has taken from its line already, and waits to show
        assert stage.utterances(n_given).count(1) <= 1
        assert stage.runner._audio_source.queued_duration < 0.02
        stage.audio.flush()
        await stage.say(tone(0.1, RATE))
        await stage.until(lambda: len(stage.ended) == 2)

    stage = perform(script)
    (first, was_interrupted), (second, is_interrupted) = stage.ended
    assert was_interrupted
    assert 0.3 <= first < 3.0
    assert not is_interrupted
    assert second == pytest.approx(0.1, abs=1 / FPS)


def test_sound_that_cannot_be_spoken_ends_and_the_next_is_spoken() -> None:
    async def script(stage: Stage) -> None:
        await stage.say(np.full(4800, -30_000, "<i2").tobytes())
        await stage.until(lambda: stage.ended)
        await stage.say(tone(0.1, RATE))
        await stage.until(lambda: len(stage.ended) == 2)

    stage = perform(script)
    assert stage.ended == [(pytest.approx(1 / FPS), False), (pytest.approx(0.1, abs=1 / FPS), False)]


@pytest.mark.parametrize("depth", [3, 4])
def test_pictures_have_the_bytes_that_their_form_needs(depth: int) -> None:
    async def script(stage: Stage) -> None:
        await stage.until(lambda: len(stage.given) > 3)

    stage = perform(script, FakeSession(depth=depth), style="happy")
    assert {value.shape for _, value in stage.given} == {(SIZE, SIZE, depth)}


def test_pictures_of_another_size_are_refused_before_they_are_sent() -> None:
    from tts2face.agents import LiveKitAvatar

    async def run() -> None:
        async for _ in LiveKitAvatar(FakeSession(size=32), size=str(SIZE), fps=FPS):
            raise AssertionError("a picture was given")

    with pytest.raises(InputError, match="the pictures have 32x32 pixels, not 64x64; give this size"):
        asyncio.run(run())


def test_half_samples_are_refused() -> None:
    from tts2face.agents import LiveKitAvatar

    avatar = LiveKitAvatar(FakeSession(), size=str(SIZE))
    with pytest.raises(InputError, match="a block of 3 bytes does not hold whole 16-bit samples of 1 channels"):
        avatar.face.push(b"abc", RATE, 1)
