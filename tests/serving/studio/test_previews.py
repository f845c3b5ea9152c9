"""Previews of a project: partial ones, cancelled ones, and those whose process ended; the works are made by hand."""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Any

from tests.serving.studio.test_bundle import piece
from tts2face.processes.message import EVENT, Message
from tts2face.processes.parent import ChildEndedError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.messages import Work
from tts2face.serving.studio.preview_bundle import Preview
from tts2face.serving.studio.previews import PARTIAL_S, ProjectPreview
from tts2face.storage.memory import ResultMemory

Stream = Callable[[Work], AsyncIterator[Message]]


def event(content: dict[str, Any]) -> Message:
    return Message(EVENT, {"seconds": 0.0, "event": content})


def pieces_of(text: str) -> list[tuple[dict[str, Any], bytes]]:
    """A piece for each letter, whose motion is the letter's number."""
    found = []
    for number, letter in enumerate(text):
        memory = ResultMemory(10_000)
        made = piece(memory, number, motion=float(ord(letter))) | {"type": "piece", "notes": [], "text": letter}
        found.append((made, memory.get(made["digest"]) or b""))
    return found


class Works:
    """Results of works, whose text says what they hold."""

    def __init__(self, *, pause_s: float = 0.0, n_ends: int = 0) -> None:
        self.begun: list[str] = []
        self.ended: list[str] = []
        self.sent: list[str] = []
        self._pause_s, self._n_ends = pause_s, n_ends

    async def stream(self, work: Work) -> AsyncIterator[Message]:
        text = work.request["text"]
        self.begun.append(text)
        try:
            if len(self.begun) <= self._n_ends:
                raise RefusedError(503, "unavailable", "gone") from ChildEndedError("gone")
            if text == "wrong":
                raise RefusedError(400, "invalid_request", "the text is wrong")
            yield event({"type": "begin", "fps": 30.0})
            for made, content in pieces_of(text):
                await asyncio.sleep(self._pause_s)
                yield event(made)
                if made["digest"] not in work.request["have"]:
                    self.sent.append(made["text"])
                    yield Message(EVENT, {"seconds": 0.0}, content)
            yield event({"type": "end", "dropped": [], "cut_to": None})
        finally:
            self.ended.append(text)


def make(works: Works) -> tuple[ProjectPreview, list[Preview], list[float]]:
    """A preview, its states, and the seconds of speech that it counted."""
    states: list[Preview] = []
    speech: list[float] = []
    shown = ProjectPreview(
        works.stream, ResultMemory(1_000_000), on_change=lambda: states.append(shown.current),
        on_fit=lambda *_: [], on_speech=speech.append,
    )  # fmt: skip
    return shown, states, speech


def start(shown: ProjectPreview, text: str) -> None:
    async def ask(have: tuple[str, ...]) -> Work:
        return Work("project", request={"text": text, "have": list(have)})

    shown.start(ask)


def letters(shown: Preview) -> str:
    return "".join(one["text"] for one in shown.pieces)


def test_a_newer_edit_cancels_the_work_before() -> None:
    async def run() -> None:
        works = Works(pause_s=0.02)
        shown, states, _ = make(works)
        start(shown, "abcdefghij")
        await asyncio.sleep(0.05)
        start(shown, "xy")
        await shown.wait(5)
        assert letters(shown.current) == "xy"
        assert works.ended[0] == "abcdefghij"
        assert all(letters(one) != "abcdefghij" for one in states)

    asyncio.run(run())


def test_pieces_that_are_here_are_not_sent_again_and_not_counted_again() -> None:
    async def run() -> None:
        works = Works()
        shown, _, speech = make(works)
        start(shown, "abc")
        await shown.wait(5)
        start(shown, "abd")
        await shown.wait(5)
        assert works.sent == list("abcd")
        assert [round(one, 3) for one in speech] == [0.3, 0.0]  # all sounds of the letters are the same

    asyncio.run(run())


def test_a_long_preview_is_shown_while_it_is_made() -> None:
    async def run() -> None:
        works = Works(pause_s=PARTIAL_S / 2)
        shown, states, _ = make(works)
        start(shown, "abcdef")
        await shown.wait(10)
        assert [one.is_complete for one in states] == [False] * (len(states) - 1) + [True]
        assert len(states) > 2
        lengths = [len(one.pieces) for one in states]
        assert lengths == sorted(lengths)
        states.clear()
        start(shown, "xbcdef")  # the page keeps the rest of the clip while the new one is made
        await shown.wait(10)
        assert {len(one.pieces) for one in states} == {6}
        assert letters(states[0])[0] == "x"

    asyncio.run(run())


def test_a_process_that_ended_is_asked_again() -> None:
    async def run() -> None:
        works = Works(n_ends=2)
        shown, _, _ = make(works)
        start(shown, "ab")
        await shown.wait(5)
        assert (letters(shown.current), shown.current.error, len(works.begun)) == ("ab", "", 3)

    asyncio.run(run())


def test_an_error_keeps_the_last_clip() -> None:
    async def run() -> None:
        works = Works()
        shown, _, _ = make(works)
        start(shown, "ab")
        await shown.wait(5)
        start(shown, "wrong")
        await shown.wait(5)
        assert (letters(shown.current), shown.current.error) == ("ab", "the text is wrong")
        assert shown.bundle(None) is not None

    asyncio.run(run())


def test_dropped_contents_are_made_again() -> None:
    async def run() -> None:
        works = Works()
        shown, _, _ = make(works)
        start(shown, "ab")
        await shown.wait(5)
        shown._memory.__init__(1_000_000)  # type: ignore[misc]
        assert shown.bundle(None) is None
        await shown.wait(5)
        assert shown.bundle(None) is not None
        assert works.begun == ["ab", "ab"]

    asyncio.run(run())
