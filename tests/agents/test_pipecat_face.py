"""A face before Pipecat's own output transport: order, interruption, ends of speech."""

import numpy as np
import pytest

from tests.agents.made import FPS, SIZE, TICK, FakeSession, tone
from tests.agents.pipecat_stage import RATE, Stage, perform
from tts2face.types import SOUND_RATE

pytestmark = [
    pytest.mark.needs("pipecat"),
    pytest.mark.filterwarnings("ignore:'audioop' is deprecated:DeprecationWarning"),  # which Pipecat imports
]
CHUNK_S = 0.02  # of sound, as the parameters of the transport say


def test_sound_leaves_whole_with_its_pictures_and_the_bot_stops_behind_it() -> None:
    async def script(stage: Stage) -> None:
        await stage.until(lambda: stage.count("picture") > 5)
        assert stage.count("sound") == 0
        await stage.say(tone(0.5, RATE))
        await stage.until(lambda: stage.count("stopped"))

    stage = perform(script)
    kinds = [kind for kind, _ in stage.written]
    assert kinds.count("stopped") == 1
    assert "sound" not in kinds[kinds.index("stopped") :]
    n_samples = round(0.5 * SOUND_RATE)
    assert len(stage.sound) == pytest.approx(n_samples, abs=CHUNK_S * SOUND_RATE)
    assert abs(stage.sound[:n_samples]).min() > 0
    seconds_seen = seconds_heard = 0.0
    for kind, value in stage.written:
        seconds_seen += kind == "picture" and value[1, 0, 0] == 1 and 1 / FPS
        seconds_heard += len(value) / SOUND_RATE if kind == "sound" else 0.0
        if kind == "picture" and value[1, 0, 0] == 1:
            assert abs(seconds_seen - seconds_heard) <= 0.04


def test_after_an_interruption_nothing_old_is_seen_or_heard_and_the_bot_stops_once() -> None:
    from pipecat.frames.frames import InterruptionFrame

    async def script(stage: Stage) -> None:
        await stage.say(tone(3.0, RATE))
        await stage.until(lambda: len(stage.sound) > 0.3 * SOUND_RATE)
        await stage.worker.queue_frame(InterruptionFrame())
        await stage.until(lambda: stage.count("stopped"))
        n_written = len(stage.written)
        await stage.until(lambda: len(stage.written) > n_written + 20)
        old = stage.written[n_written:]
        assert [kind for kind, _ in old if kind != "picture"] == []
        assert [int(value[1, 0, 0]) for _, value in old if value[1, 0, 0] == 1] == []
        await stage.say(tone(0.1, RATE))
        await stage.until(lambda: stage.count("stopped") == 2)
        assert len(stage.sound) < 1.5 * SOUND_RATE

    stage = perform(script)
    last = [value for kind, value in stage.written if kind == "sound"][-5:]
    assert sum(map(len, last)) == pytest.approx(0.1 * SOUND_RATE, abs=CHUNK_S * SOUND_RATE)


def test_a_pipeline_ends_when_all_has_been_spoken() -> None:
    async def script(stage: Stage) -> None:
        await stage.say(tone(0.3, RATE), is_whole=False)  # of a service that does not tell its end
        await stage.say(tone(0.2, RATE))

    stage = perform(script)
    assert len(stage.sound) == pytest.approx(0.5 * SOUND_RATE, abs=2 * CHUNK_S * SOUND_RATE)
    assert stage.face.face.stream.is_closed  # type: ignore[attr-defined]


def test_a_text_is_spoken_without_a_speech_service() -> None:
    from pipecat.frames.frames import LLMFullResponseEndFrame, LLMTextFrame, TTSSpeakFrame

    async def script(stage: Stage) -> None:
        for frame in (LLMTextFrame("Hello "), LLMTextFrame("there."), LLMFullResponseEndFrame(), TTSSpeakFrame("Bye.")):
            await stage.worker.queue_frame(frame)
        await stage.until(lambda: stage.count("stopped") == 2)

    stage = perform(script, speaks_text=True)
    assert len(stage.sound) == pytest.approx(16 * TICK, abs=2 * CHUNK_S * SOUND_RATE)


def test_sound_that_cannot_be_spoken_ends_and_the_next_is_spoken() -> None:
    async def script(stage: Stage) -> None:
        await stage.say(np.full(4800, -30_000, "<i2").tobytes())
        await stage.say(tone(0.1, RATE))
        await stage.until(lambda: stage.count("stopped") == 2)

    stage = perform(script)
    assert len(stage.sound) == pytest.approx(0.1 * SOUND_RATE + TICK, abs=CHUNK_S * SOUND_RATE)


def test_no_attribute_of_the_base_class_is_taken() -> None:
    """One of Pipecat's own attributes, such as ``_next``, with another value breaks the pipeline in silence."""
    from pipecat.processors.frame_processor import FrameProcessor

    from tts2face.agents import PipecatFace

    own = set(vars(PipecatFace(FakeSession(), size=str(SIZE)))) - set(vars(FrameProcessor()))
    assert own == {"face", "_speaks_text", "_showing", "_contexts", "_is_silent"}
    overridden = {name for name in vars(PipecatFace) if hasattr(FrameProcessor, name) and not name.startswith("_")}
    assert overridden == {"process_frame", "cleanup"}
