"""Tasks of the service: each makes a result step by step with a session."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from tts2face.picture.options import Picture
from tts2face.picture.pace import Pace
from tts2face.request import Request
from tts2face.serving.service.live import listen, live
from tts2face.serving.service.messages import DRAWING_THREADS, QUALITY, Event, Inputs, Task, Work
from tts2face.serving.service.scheduler import lead
from tts2face.types import Chunk, Waveform

if TYPE_CHECKING:
    from tts2face.session.session import Session
    from tts2face.session.speech_stream import Piece


def stream_file(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """Bytes of a movie, of sound, or of lines; an event with each change of the quality of pictures."""
    request, picture = Request(**work.request), Picture(**work.picture)
    pace = Pace(lead) if work.keeps_pace else None
    quality = pace.quality if pace is not None else None
    for chunk in session.stream_file(
        request, work.format, picture=picture, threads=DRAWING_THREADS, pace=pace, is_complete=work.is_complete
    ):
        yield chunk
        if pace is not None and pace.quality != quality:
            quality = pace.quality
            yield Event({"type": QUALITY, **asdict(quality)})


def timed_speech(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """For each sentence an event with its words, phones and visemes in seconds of the whole, then its sound.

    The format of a task without one is PCM. The sound of a complete file comes after all events.
    """
    from tts2face.picture.sound_stream import encode_sound
    from tts2face.session.encoded_stream import encode_complete

    format = work.format or "pcm"
    events: list[Event] = []

    def sounds() -> Iterator[Waveform]:
        for timed in session.stream_speech(Request(**work.request)):
            events.append(_timed_event(timed))
            yield timed.speech.waveform

    def write(path: Path | None = None) -> Iterator[Chunk]:
        return encode_sound(sounds(), format, path)

    for chunk in encode_complete(write, format) if work.is_complete else write():
        yield from events
        events.clear()
        yield chunk


def _timed_event(timed: "Piece") -> Event:
    from tts2face.interchange.exports.labels import Label
    from tts2face.interchange.exports.visemes import viseme_labels

    spoken, start = timed.speech, timed.begin
    phones = spoken.phones
    times = [(float(a) + start, float(b) + start) for a, b in zip(phones.edges, phones.edges[1:], strict=False)]
    labels = [Label(phone, *span) for phone, span in zip(phones.phones, times, strict=True)]
    return Event({
        "rate": spoken.waveform.rate,
        "marks": [[mark.name, mark.seconds] for mark in timed.marks],
        "words": [[word.text, times[word.first][0], times[word.last - 1][1]] for word in spoken.words],
        "phones": [[label.text, label.start, label.end] for label in labels],
        "visemes": [[viseme.text, viseme.start, viseme.end, label.text]
                    for label in labels for viseme in viseme_labels(label, "oculus")],
    })  # fmt: skip


def pronounce(_: "Session", work: Work, __: Inputs) -> Iterator[Event]:
    """One event with the words of a text in IPA."""
    from lexicon.spoken_words import pronounce_marked
    from lexicon.text_marks import parse_marks

    text, language = str(work.request["text"]), str(work.request["language"])
    yield Event(
        {"words": [word.ipa + word.mark for word in pronounce_marked(parse_marks(text, language), language).words]}
    )


TASKS: Mapping[str, Task] = MappingProxyType({
    "file": stream_file, "speech": timed_speech, "phones": pronounce, "live": live, "listen": listen,
})  # fmt: skip
