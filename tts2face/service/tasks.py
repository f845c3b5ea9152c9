"""Tasks of a synthesis process: each makes a result step by step with a session."""

import queue
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.service.messages import Event
from tts2face.types import Chunk

if TYPE_CHECKING:
    from tts2face.session import Session

Inputs = queue.SimpleQueue[Any]


@dataclass(frozen=True, slots=True)
class Work:
    """What a task makes; all values are JSON.

    Parameters
    ----------
    kind
        Name of one of `TASKS`.
    models
        Fields of `tts2face.session_cache.Models` that differ from their defaults.
    request, picture
        Fields of `Request` and `Picture` that differ from their defaults.
    format
        Format of `Session.stream_file`.
    """

    kind: str = "file"
    models: Mapping[str, Any] = field(default_factory=dict)
    request: Mapping[str, Any] = field(default_factory=dict)
    picture: Mapping[str, Any] = field(default_factory=dict)
    format: str = "mp4"

    def as_json(self) -> dict[str, Any]:
        """JSON object from which `work_from_json` makes the work again."""
        return asdict(self)


def work_from_json(content: Mapping[str, Any]) -> Work:
    """The work of `Work.as_json`."""
    return Work(**content)


def stream_file(session: "Session", work: Work, _: Inputs) -> Iterator[Chunk]:
    """Bytes of a movie, of sound, or of lines."""
    request, picture = Request(**work.request), Picture(**work.picture)
    return session.stream_file(request, work.format, picture=picture, threads=1)


def timed_speech(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """For each sentence an event with its words, phones and visemes in seconds of the whole, then its sound (PCM)."""
    from tts2face.exports.labels import Label
    from tts2face.exports.visemes import viseme_labels
    from tts2face.render.sound_stream import pcm_bytes

    for timed in session.stream_speech(Request(**work.request)):
        spoken, phones, begin = timed.speech, timed.speech.phones, timed.begin
        times = [(float(a) + begin, float(b) + begin) for a, b in zip(phones.edges, phones.edges[1:], strict=False)]
        labels = [Label(phone, *span) for phone, span in zip(phones.phones, times, strict=True)]
        yield Event({
            "rate": spoken.waveform.rate,
            "marks": [[mark.name, mark.seconds] for mark in timed.marks],
            "words": [[word.text, times[word.first][0], times[word.last - 1][1]] for word in spoken.words],
            "visemes": [[viseme.text, viseme.start, viseme.end, label.text]
                        for label in labels for viseme in viseme_labels(label, "oculus")],
        })  # fmt: skip
        yield Chunk(pcm_bytes(spoken.waveform), spoken.waveform.duration)


TASKS: Mapping[str, Callable[["Session", Work, Inputs], Iterator[Any]]] = {
    "file": stream_file,
    "speech": timed_speech,
}
