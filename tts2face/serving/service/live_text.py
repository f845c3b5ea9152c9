"""Text of a live stream on its way to a synthesis process: within limits, sentence by sentence, never far ahead."""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, make_dataclass, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.gesture_marks import parse_gesture
from lexicon.gesture_names import GESTURES
from lexicon.growing_text import GrowingText
from lexicon.mark_table import read_marks_table
from lexicon.values.checks import format_value
from lexicon.values.json_text import parse_json
from lexicon.values.records import checked
from tts2face.serving.service.access import Bucket
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import MINUTE_S
from tts2face.serving.service.pool import InputQueue

MAX_MESSAGE_CHARACTERS = 32_768  # of JSON, whose reading is one step of the event loop, of at most 5 ms
PART_CHARACTERS = 1000  # that are divided into sentences in one step of the event loop: some milliseconds
MAX_WAITING_CHARACTERS = 65_536  # of sentences that have not been given; then the client is not read from
MAX_CANCELS = 8  # that have not been answered; likewise
N_GIVEN = 2  # sentences that a task has: one is spoken, the next one waits
HEARD_S = 0.1  # of the partner's sound that the task gets at once
MESSAGE_CHARACTERS = 20  # of text, as which a gesture or a style counts within the limits of a stream
MAX_STYLE_CHARACTERS = 400
REFUSED_S = 0.1  # for which a client that sends what is refused is not read from

MAX_AHEAD_S = 5.0  # by which a client's sound is read ahead of real time
SAMPLE_BYTES, SAMPLE_RATES = 2, (8_000, 192_000)  # of sound, and its rates in Hz

MAX_ID_CHARACTERS = 64  # of a flush

_Given: Any = make_dataclass(
    "_Given", [(name, float | None, None) for name in ("size", "seconds", "down_deg", "left_deg")]
)
Count = Callable[[], None]  # counts a sentence as a request of its key, or raises its refusal


def parse_message(text: str) -> Any:
    """Content of a message of a WebSocket; None where it is no JSON."""
    if len(text) > MAX_MESSAGE_CHARACTERS:
        raise RefusedError(
            413, "too_large", f"a message has {len(text)} characters; send at most {MAX_MESSAGE_CHARACTERS}, in parts"
        )
    try:
        content = parse_json(text, "the message", has_halves=True)
        # a text may end within a character, whose other half is in the next one
        is_text = isinstance(content, dict) and content.keys() == {"type", "text"} and content["type"] == "text"
        return content if is_text and isinstance(content["text"], str) else parse_json(text, "the message")
    except DataError:
        return None


class Pace:
    """Slows a sender of sound down to real time once it is `MAX_AHEAD_S` ahead."""

    def __init__(self, bytes_per_s: float) -> None:
        self._bytes_per_s = bytes_per_s
        self._seconds, self._began = 0.0, time.monotonic()

    async def add(self, n_bytes: int) -> None:
        """Wait after so many more bytes, if they are too far ahead."""
        self._seconds += n_bytes / self._bytes_per_s
        ahead = self._seconds - (time.monotonic() - self._began)
        if ahead < 0:  # a pause of the sender is no credit
            self._began += -ahead
        if ahead > MAX_AHEAD_S:
            await asyncio.sleep(ahead - MAX_AHEAD_S)


@dataclass(slots=True)
class _Flush:
    """A flush that is answered, and the number of sentences before it that are not spoken yet."""

    id: str
    n_unsaid: int


class LiveText:
    """The text of one stream.

    Parameters
    ----------
    language
        Of the text.
    limits
        Characters of the whole stream, and of each minute.
    count
        Counts a sentence.
    markup, text_marks
        How it is read, and the table of its marks.

    Attributes
    ----------
    inputs
        Of the task: ``say`` with one sentence, ``listen``, ``heard`` with sound of the partner, ``cancel`` and ``end``.
    """

    def __init__(
        self,
        language: str,
        limits: tuple[int, int],
        count: Count,
        markup: str = "auto",
        text_marks: Path | None = None,
    ) -> None:
        self.inputs: InputQueue = asyncio.Queue()
        self._growing, self._count = GrowingText(language, markup, read_marks_table(text_marks)), count
        self._most, self._most_a_minute = limits
        self._n_characters, self._minute = 0, Bucket()
        self._sentences: deque[str] = deque()
        self._n_given, self._n_cancels = 0, 0
        self._n_unsaid = 0  # sentences that have been queued, and neither been spoken nor been forgotten
        self._flushes: list[_Flush] = []
        self._is_ended = False
        self._heard, self._block = (
            bytearray(),
            0.0,
        )  # sound of the partner that the task has not got, and bytes of a block
        self._partner_pace: Pace | None = None
        self._has_room = asyncio.Event()
        self._has_room.set()

    async def receive(self, content: Mapping[str, Any], samples: bytes = b"") -> None:
        """Follow a message of the client, as soon as there is room for its text or its sound."""
        try:
            if samples:
                await self._hear(samples)
            else:
                await self._follow(content)
        finally:
            self._give()
        await self._has_room.wait()

    async def _follow(self, content: Mapping[str, Any]) -> None:
        match content["type"]:
            case "text":
                await self._add(content.get("text"))
            case "listen":
                self._listen(content.get("rate"))
            case "gesture":
                self._gesture(content)
            case "style":
                self._style(content.get("style"))
            case "flush":
                self._flush(content.get("id"))
            case "end":
                self._is_ended = True
                self._queue(self._growing.flush())
            case _:
                self._n_unsaid -= len(self._sentences)
                self._sentences.clear()
                self._flushes.clear()
                self._growing.clear()
                self._n_cancels += 1
                self.inputs.put_nowait(({"type": "cancel", "arrived": time.monotonic()}, b""))

    def _flush(self, name: Any) -> None:
        """Speak what has come; a flush with an id is answered when that has been done."""
        if name is not None and not (isinstance(name, str) and len(name) <= MAX_ID_CHARACTERS):
            shown = format_value(name)
            raise RefusedError(
                400, "invalid_request", f"id must be a text of up to {MAX_ID_CHARACTERS} characters, not {shown}"
            )
        try:
            self._queue(self._growing.flush())
        finally:  # what is refused is not waited for
            if name is not None:
                self._flushes.append(_Flush(name, self._n_unsaid))

    def answers(self) -> list[dict[str, str]]:
        """Events for the client since the last call: ``flushed``, of each flush whose text has been spoken."""
        done = [flush for flush in self._flushes if flush.n_unsaid <= 0]
        self._flushes = self._flushes[len(done) :]
        return [{"type": "flushed", "id": flush.id} for flush in done]

    def _listen(self, rate: Any) -> None:
        low, high = SAMPLE_RATES
        if rate is not None and not (isinstance(rate, int) and low <= rate <= high):
            shown = format_value(rate)
            raise RefusedError(
                400, "invalid_request", f"rate must be a sample rate from {low} to {high} Hz, or null, not {shown}"
            )
        self._heard.clear()
        self._partner_pace = None if rate is None else Pace(SAMPLE_BYTES * rate)
        self._block = HEARD_S * SAMPLE_BYTES * (rate or 0)
        self.inputs.put_nowait(({"type": "listen", "rate": rate}, b""))

    def _gesture(self, content: Mapping[str, Any]) -> None:
        """Pass a gesture on: a name as in a mark of a text, and fields of one."""
        given = {name: value for name, value in content.items() if name not in {"type", "name"} and value is not None}
        name = content.get("name")
        try:
            mark = parse_gesture(name, 0) if isinstance(name, str) else None
            if mark is None:
                shown = format_value(name)
                raise InputError(f"name must be the name of a gesture, not {shown}; choose {', '.join(GESTURES)}")
            mark = replace(
                mark,
                **{
                    name: value
                    for name, value in vars(checked(_Given, given, "the gesture", InputError)).items()
                    if value is not None
                },
            )
        except InputError as wrong:
            raise RefusedError(400, "invalid_request", str(wrong)) from wrong
        self._check(MESSAGE_CHARACTERS)
        self.inputs.put_nowait(({"type": "gesture", "gesture": asdict(mark)}, b""))

    def _style(self, style: Any) -> None:
        if not isinstance(style, str) or not style.strip():
            raise RefusedError(
                400, "invalid_request", f"style must be the name of a style, not {format_value(style)}; send one"
            )
        self._check(MESSAGE_CHARACTERS)
        self.inputs.put_nowait(({"type": "style", "style": style.strip()[:MAX_STYLE_CHARACTERS]}, b""))

    async def _hear(self, samples: bytes) -> None:
        if self._partner_pace is None:
            raise RefusedError(
                400, "invalid_request", "sound of the other is heard after listen with its sample rate; send that first"
            )
        self._heard += samples
        await self._partner_pace.add(len(samples))
        if len(self._heard) >= self._block:
            self.inputs.put_nowait(({"type": "heard"}, bytes(self._heard)))
            self._heard.clear()

    def is_note(self, event: Mapping[str, Any]) -> bool:
        """Follow an event of the task; whether it is for this object alone."""
        if event["type"] == "said":
            self._n_given -= event["n"]
            self._n_unsaid -= event["n"]
            for flush in self._flushes:
                flush.n_unsaid -= event["n"]
        elif event["type"] == "cancelled":
            self._n_cancels -= 1
        self._give()
        return bool(event["type"] == "said")

    async def _add(self, text: Any) -> None:
        if text is None:  # as in the last part of what a language model writes
            return
        if not isinstance(text, str):
            shown = format_value(text)
            raise RefusedError(
                400, "invalid_request", f"text must be a text, or null for none, not {shown}; send words"
            )
        self._check(len(text))
        for at in range(0, len(text), PART_CHARACTERS):
            self._queue(self._growing.add(text[at : at + PART_CHARACTERS]))
            # other connections have their turn
            await asyncio.sleep(0)

    def _check(self, n_characters: int) -> None:
        if self._n_characters + n_characters > self._most:
            raise _refused(f"the stream has sent its {self._most} characters; begin another one")
        left = self._minute.refill(time.monotonic(), self._most_a_minute, MINUTE_S)
        if n_characters > self._most_a_minute:
            raise _refused(f"the text has more than {self._most_a_minute} characters; divide it")
        if n_characters > left:
            wait_s = (n_characters - left) * MINUTE_S / self._most_a_minute
            raise _refused(
                f"the stream has sent its {self._most_a_minute} characters a minute; wait {int(wait_s) + 1} s and send "
                f"the text again"
            )
        self._minute.take(n_characters)
        self._n_characters += n_characters

    def _queue(self, sentences: list[str]) -> None:
        for sentence in sentences:
            try:
                self._count()
            except RefusedError as refused:
                message = f"{sentence[:40]!r} and what follows it in the message is not spoken: {refused.message}"
                raise RefusedError(refused.status, refused.code, message) from refused
            self._sentences.append(sentence)
            self._n_unsaid += 1

    def _give(self) -> None:
        """Give sentences to the task, and its end after the last one."""
        while self._sentences and self._n_given < N_GIVEN:
            self._n_given += 1
            self.inputs.put_nowait(({"type": "say", "text": self._sentences.popleft()}, b""))
        if self._is_ended and not self._sentences:
            self._is_ended = False
            self.inputs.put_nowait(({"type": "end"}, b""))
        n_waiting = sum(map(len, self._sentences))
        if n_waiting < MAX_WAITING_CHARACTERS and self._n_cancels < MAX_CANCELS:
            self._has_room.set()
        else:
            self._has_room.clear()


def _refused(message: str) -> RefusedError:
    return RefusedError(413, "too_long", message)
