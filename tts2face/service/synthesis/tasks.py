"""Tasks of the service: each makes a result step by step with a session."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.service.synthesis.live_task import listen, live
from tts2face.service.synthesis.work import Event, Inputs, Task, Work
from tts2face.types import Chunk

if TYPE_CHECKING:
    from tts2face.session import Session


def stream_file(session: "Session", work: Work, _: Inputs) -> Iterator[Chunk]:
    """Bytes of a movie, of sound, or of lines."""
    request, picture = Request(**work.request), Picture(**work.picture)
    return session.stream_file(request, work.format, picture=picture, threads=1)


def timed_speech(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """For each sentence an event with its words, phones and visemes in seconds of the whole, then its sound (PCM)."""
    from tts2face.exports.labels import Label
    from tts2face.exports.visemes import viseme_labels
    from tts2face.storage.wave_files import pcm_bytes

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
        yield Chunk(pcm_bytes(spoken.waveform.samples), spoken.waveform.duration)


TASKS: Mapping[str, Task] = MappingProxyType({
    "file": stream_file, "speech": timed_speech, "live": live, "listen": listen,
})  # fmt: skip
