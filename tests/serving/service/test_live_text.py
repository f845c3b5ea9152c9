"""Text of live streams: limits, what waits for the task, and how much is done in one step of the event loop."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from lexicon.marked_text import GestureMark
from tts2face.serving.service import live_text
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.live_text import (
    MAX_CANCELS,
    MAX_MESSAGE_CHARACTERS,
    MAX_WAITING_CHARACTERS,
    N_GIVEN,
    PART_CHARACTERS,
    LiveText,
    parse_message,
)

NO_LIMITS = (10**9, 10**9)
SENTENCE = "We were away a year ago. "
N_STEPS = 2000  # of the event loop: more than any test here needs


def live(limits: tuple[int, int] = NO_LIMITS, count: Callable[[], None] = lambda: None) -> LiveText:
    return LiveText("en-us", limits, count)


def given(text: LiveText) -> list[str]:
    """What the task has been given since the last look: sentences, or the types of other inputs."""
    found = []
    while not text.inputs.empty():
        content, _ = text.inputs.get_nowait()
        found.append(content.get("text", content["type"]))
    return found


def follow(text: LiveText, messages: Sequence[dict[str, Any]]) -> None:
    async def run() -> None:
        for message in messages:
            await text.receive(message)

    asyncio.run(run())


async def steps() -> None:
    """Let all tasks go on until they wait for something."""
    for _ in range(N_STEPS):
        await asyncio.sleep(0)


def say(*texts: str) -> list[dict[str, Any]]:
    return [{"type": "text", "text": text} for text in texts]


def test_the_task_gets_the_next_sentence_when_it_has_said_one() -> None:
    text = live()
    follow(text, [*say("One. ", "Two. Thr", "ee. Four. Five"), {"type": "end"}])
    assert given(text) == ["One.", "Two."]
    text.is_note({"type": "said", "n": 1})
    assert given(text) == ["Three."]
    text.is_note({"type": "said", "n": 2})
    assert given(text) == ["Four.", "Five", "end"]


def test_cancel_forgets_what_waits() -> None:
    text = live()
    follow(text, [*say("One. Two. Three. Four. And"), {"type": "interrupt"}, *say("A new one."), {"type": "flush"}])
    assert given(text) == ["One.", "Two.", "cancel"]
    assert not text.is_note({"type": "cancelled"})
    text.is_note({"type": "said", "n": N_GIVEN})
    assert given(text) == ["A new one."]


def test_a_client_is_read_from_while_there_is_room() -> None:
    """The memory of a stream is bounded; a message more is followed when the task has said some sentences."""
    part = SENTENCE * 100
    n_fitting = MAX_WAITING_CHARACTERS // len(part) + 1

    async def run() -> tuple[int, int]:
        text, n_read = live(), 0

        async def read() -> None:
            nonlocal n_read
            for message in say(*[part] * (3 * n_fitting)):
                await text.receive(message)
                n_read += 1

        reading = asyncio.create_task(read())
        await steps()
        before = n_read
        for _ in range(2 * len(part) // len(SENTENCE)):
            text.is_note({"type": "said", "n": 1})
        await steps()
        reading.cancel()
        return before, n_read

    before, after = asyncio.run(run())
    assert n_fitting - 1 <= before <= n_fitting
    assert before < after <= before + 3


def test_cancels_that_nobody_answers_are_not_read_without_end() -> None:
    async def run() -> int:
        text = live()

        async def read() -> None:
            while True:
                await text.receive({"type": "cancel"})

        reading = asyncio.create_task(read())
        await steps()
        reading.cancel()
        return text.inputs.qsize()

    assert asyncio.run(run()) == MAX_CANCELS


def test_no_step_of_the_event_loop_divides_more_than_a_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step of `PART_CHARACTERS` takes some milliseconds, whatever they are (`tests/lexicon/fuzz/test_cost.py`)."""
    sizes: list[int] = [0]

    class Counted(live_text.GrowingText):
        def add(self, part: str) -> list[str]:
            sizes[-1] += len(part)
            return super().add(part)

    monkeypatch.setattr(live_text, "GrowingText", Counted)

    async def run() -> None:
        text = live()
        reading = asyncio.create_task(text.receive(say("A. " * 9000)[0]))
        while not reading.done():
            await asyncio.sleep(0)
            sizes.append(0)
            text.is_note({"type": "said", "n": N_GIVEN})

    asyncio.run(run())
    assert sum(sizes) == 27_000
    assert max(sizes) <= PART_CHARACTERS


def test_a_long_message_is_refused_before_it_is_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    parsed: list[int] = []
    monkeypatch.setattr(live_text, "parse_json", lambda text, _, **__: parsed.append(len(text)))
    with pytest.raises(RefusedError, match="a message has 1000000 characters; send at most 32768, in parts"):
        parse_message("1" * 1_000_000)
    parse_message("1" * MAX_MESSAGE_CHARACTERS)
    assert {*parsed} == {MAX_MESSAGE_CHARACTERS}


@pytest.mark.parametrize(
    ("limits", "texts", "reason"),
    [
        ((100, 1000), ["x" * 60, "x" * 41], "the stream has sent its 100 characters; begin another one"),
        ((1000, 100), ["x" * 60, "x" * 41], "has sent its 100 characters a minute; wait 1 s and send the text again"),
        ((1000, 100), ["x" * 101], "the text has more than 100 characters; divide it"),
    ],
)
def test_the_text_of_a_stream_is_limited(limits: tuple[int, int], texts: list[str], reason: str) -> None:
    with pytest.raises(RefusedError, match=reason):
        follow(live(limits), say(*texts))


@pytest.mark.parametrize("text", [5, {"a": 1}, ["Hello."], True])
def test_what_is_no_text_is_refused(text: object) -> None:
    with pytest.raises(RefusedError, match="text must be a text, or null for none, not"):
        follow(live(), [{"type": "text", "text": text}])


def test_no_text_is_nothing() -> None:
    text = live()
    follow(text, [{"type": "text", "text": None}, {"type": "text"}, {"type": "end"}])
    assert given(text) == ["end"]


def test_each_sentence_is_a_request_of_its_key() -> None:
    n_left = 2

    def count() -> None:
        nonlocal n_left
        if not n_left:
            raise RefusedError(429, "rate_limited", "the key a has used its 2 requests a minute")
        n_left -= 1

    text = live(count=count)
    with pytest.raises(RefusedError, match=r"'Three.' and what follows it in the message is not spoken: the key a"):
        follow(text, say("One. Two. Three. Four. And"))
    assert given(text) == ["One.", "Two."]


def test_sound_of_the_partner_is_given_in_blocks_after_its_rate() -> None:
    text = live()

    async def run() -> None:
        with pytest.raises(RefusedError, match="sound of the other is heard after listen with its sample rate"):
            await text.receive({"type": "audio"}, bytes(320))
        await text.receive({"type": "listen", "rate": 16_000})
        for _ in range(11):
            await text.receive({"type": "audio"}, bytes(320))  # 10 ms

    asyncio.run(run())
    assert [text.inputs.get_nowait() for _ in range(2)] == [
        ({"type": "listen", "rate": 16_000}, b""),
        ({"type": "heard"}, bytes(3200)),
    ]
    assert text.inputs.empty()


@pytest.mark.parametrize("rate", [7_999, 16_000.0, "16000", [1]], ids=str)
def test_a_rate_that_is_none_is_refused(rate: Any) -> None:
    text = live()
    with pytest.raises(RefusedError, match="rate must be a sample rate from 8000 to 192000 Hz, or null, not"):
        follow(text, [{"type": "listen", "rate": rate}])
    assert text.inputs.empty()


@pytest.mark.parametrize(
    ("message", "mark"),
    [
        ({"name": "nod"}, {"name": "nod"}),
        ({"name": "Brows up", "size": 0.5}, {"name": "brows_up", "size": 0.5}),
        ({"name": "look left 2s", "size": None}, {"name": "look_at", "left_deg": 15.0, "seconds": 2.0}),
        ({"name": "look_at", "down_deg": 5, "left_deg": -20}, {"name": "look_at", "down_deg": 5.0, "left_deg": -20.0}),
    ],
)
def test_gestures_are_given_at_once(message: dict[str, Any], mark: dict[str, Any]) -> None:
    text = live()
    follow(text, [{"type": "gesture", **message}, {"type": "style", "style": " delighted "}])
    gesture, style = (text.inputs.get_nowait()[0] for _ in range(2))
    assert GestureMark(**gesture["gesture"]) == GestureMark(0, **mark)
    assert style == {"type": "style", "style": "delighted"}


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        ({"type": "gesture"}, "name must be the name of a gesture, not null; choose nod, shake"),
        ({"type": "gesture", "name": "wave"}, 'name must be the name of a gesture, not "wave"'),
        ({"type": "gesture", "name": "nod", "size": 9}, "size of the gesture nod must lie between 0.1 and 2, not 9"),
        ({"type": "gesture", "name": "nod", "size": "big"}, "the gesture: size must be a number"),
        ({"type": "gesture", "name": "nod", "speed": 1}, "the gesture: there is no 'speed' here; choose size"),
        ({"type": "gesture", "name": "blink", "left_deg": 4}, "the gesture blink has no direction"),
        ({"type": "style"}, "style must be the name of a style, not null"),
        ({"type": "style", "style": 3}, "style must be the name of a style, not 3"),
    ],
)
def test_wrong_gestures_and_styles_are_refused(message: dict[str, Any], reason: str) -> None:
    with pytest.raises(RefusedError, match=reason):
        follow(live(), [message])


def test_half_a_character_waits_in_a_message_of_text_alone() -> None:
    assert live_text.parse_message('{"type": "text", "text": "Hi \\ud83c"}') == {"type": "text", "text": "Hi \ud83c"}
    assert live_text.parse_message('{"type": "end", "text": "Hi \\ud83c"}') is None
    growing = live_text.GrowingText("en-us")
    assert [growing.add("Hi \ud83c"), growing.add("\udf89! You"), growing.add(" \ud83c x\udf89."), growing.flush()] == [
        [], ["Hi 🎉!"], [], ["You x."]
    ]  # fmt: skip


def test_a_flush_with_an_id_is_answered_when_its_text_has_been_spoken() -> None:
    text = live()
    follow(text, [*say("One. Two. Three"), {"type": "flush", "id": "a"}, *say("Four"), {"type": "flush", "id": "b"}])
    assert text.answers() == []
    text.is_note({"type": "said", "n": 2})
    assert text.answers() == []
    text.is_note({"type": "said", "n": 1})
    assert text.answers() == [{"type": "flushed", "id": "a"}]
    text.is_note({"type": "said", "n": 1})
    assert text.answers() == [{"type": "flushed", "id": "b"}]
    assert text.answers() == []


def test_a_flush_of_nothing_is_answered_at_once_and_cancel_forgets_flushes() -> None:
    text = live()
    follow(text, [{"type": "flush", "id": "a"}, {"type": "flush"}])
    assert text.answers() == [{"type": "flushed", "id": "a"}]
    follow(text, [*say("One. Two. Three. Four"), {"type": "flush", "id": "b"}, {"type": "cancel"}])
    text.is_note({"type": "cancelled"})
    text.is_note({"type": "said", "n": N_GIVEN})
    assert text.answers() == []
    follow(text, [*say("Five"), {"type": "flush", "id": "c"}])
    assert text.answers() == []
    text.is_note({"type": "said", "n": 1})
    assert text.answers() == [{"type": "flushed", "id": "c"}]


def test_a_flush_whose_sentence_is_refused_is_answered() -> None:
    def count() -> None:
        raise RefusedError(429, "rate_limited", "the key has used its requests")

    text = live(count=count)
    with pytest.raises(RefusedError, match="used its requests"):
        follow(text, [*say("One"), {"type": "flush", "id": "a"}])
    assert text.answers() == [{"type": "flushed", "id": "a"}]


@pytest.mark.parametrize("name", [7, "x" * 65])
def test_ids_of_flushes_are_short_texts(name: Any) -> None:
    with pytest.raises(RefusedError, match="id must be a text of up to 64 characters"):
        follow(live(), [{"type": "flush", "id": name}])
