"""A synthesis process of the server: it keeps sessions warm, and its tasks make results step by step, in turns."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lexicon.errors import Tts2faceError
from tts2face.picture.options import Picture
from tts2face.picture.pace import Pace
from tts2face.processes.child import Call, Handler
from tts2face.processes.program import Program
from tts2face.request import Request
from tts2face.serving.service.live import listen, live
from tts2face.serving.service.logs import configure_logs, log_event
from tts2face.serving.service.messages import (
    DRAWING_THREADS,
    QUALITY,
    SERVE,
    SYNTHESISE,
    DefectError,
    Event,
    Inputs,
    Step,
    Task,
    Work,
)
from tts2face.serving.service.scheduler import OneAtATime, Turns, give_turn, lead, wait_elsewhere
from tts2face.session import warm_up
from tts2face.session.named_models import Models
from tts2face.session.session_cache import SessionCache
from tts2face.sound.voice_pool import VoicePool
from tts2face.storage.signing import Credentials
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
        # an event with each change: the cache and the metrics follow it
        if pace is not None and pace.quality != quality:
            quality = pace.quality
            yield Event({"type": QUALITY, **asdict(quality)})


def timed_speech(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """For each sentence an event with its words, phones and visemes in seconds of the whole, then its sound.

    The format of a task without one is PCM. The sound of a complete file comes after all events.
    """
    from tts2face.picture.sound_stream import encode_sound
    from tts2face.session.encoded_stream import encode_media
    from tts2face.storage.marks import sound_mark

    format, prepared = work.format or "pcm", session.prepare(Request(**work.request))
    events: list[Event] = []

    def sounds() -> Iterator[Waveform]:
        for timed in session.stream_speech(prepared):
            events.append(_timed_event(timed))
            yield timed.speech.waveform

    def write(path: Path | None) -> Iterator[Chunk]:
        return encode_sound(sounds(), format, path, sound_mark(session.making(prepared)))

    for chunk in encode_media(write, format, is_complete=work.is_complete):
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


class Synthesis:
    """Handlers that share sessions and take turns; `tasks` by the kinds of their tasks."""

    def __init__(self, sessions: SessionCache, tasks: Mapping[str, Task] = TASKS) -> None:
        self._sessions, self._tasks = sessions, tasks
        self._turns = Turns()

    def synthesise(self, call: Call) -> Mapping[str, float]:
        """Send the parts of the result of a ``work``; its measures."""
        try:
            return self._turns.run(call, lambda: self._steps(call), call.content["priority"], call.content["key"])
        except Tts2faceError:
            raise
        except Exception as error:
            # in the child, whose traceback the parent does not get
            log_event("defect", level=logging.ERROR, error=error, id=call.content["id"])
            raise DefectError(f"internal error: {type(error).__name__}; see the log of the service") from error

    def _steps(self, call: Call) -> Iterator[Step]:
        work = Work(**call.content["work"])
        return self._tasks[work.kind](self._sessions.get(Models(**work.models), work.owner), work, call.inputs)


def serve(call: Call) -> Mapping[str, Any]:
    """Send an event as soon as the process has loaded; the call lasts as long as the process."""
    call.event({})
    return call.more().content


def handlers(  # noqa: PLR0913 - one parameter a setting
    *,
    log_format: str,
    log_text: bool,
    n_sessions: int,
    memory_mb: int,
    sentences_mb: int,
    tasks: Sequence[str] = (),
    signing: Mapping[str, str] | None = None,
) -> Mapping[str, Handler]:
    """Handlers of a process with the settings of the service.

    Parameters
    ----------
    tasks
        ``module:NAME`` of further tables of tasks by kind.
    signing
        Arguments of the `Credentials` with which complete files are signed; None: they are not.
    """
    configure_logs(log_format, with_text=log_text)
    sessions = SessionCache(
        n_sessions, voices=VoicePool(OneAtATime(), give_turn, wait_elsewhere),
        max_bytes=memory_mb * 1_000_000 or None,
        memory_mb=sentences_mb, signer=None if signing is None else Credentials.from_json(signing).open(),
    )  # fmt: skip
    known = dict(TASKS)
    for table in tasks:
        known |= Program(table).load()
    return {SYNTHESISE: Synthesis(sessions, known).synthesise, SERVE: serve, **warm_up.HANDLERS}
