"""Aligner whose work another process does, so that this one serves other tasks meanwhile.

PocketSphinx holds Python's lock while it aligns a sentence and cannot be interrupted. What a task no longer needs is
aligned to its end all the same, and dropped.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import Child
from tts2face.processes.program import Program
from tts2face.serving.service.scheduler import wait_elsewhere
from tts2face.sound.alignment import Aligner, Alignment, Pronunciations
from tts2face.types import Waveform

ALIGN = "align"  # name of the call


class RemoteAligner:
    """Aligner with the results of `tts2face.sound.alignment.Aligner`; thread-safe, one sentence at a time.

    Its process starts with the first sentence, which takes a second; the voice ``heart`` needs none.
    """

    def __init__(self) -> None:
        self._child = Child(Program(f"{__name__}:handlers"))
        self._thread = ThreadPoolExecutor(1, "aligner")

    @property
    def pid(self) -> int | None:
        """Number of the process; None while there is none."""
        return self._child.pid

    def align(self, sound: Waveform, words: Sequence[tuple[str, Pronunciations]]) -> Alignment:
        """As `Aligner.align`.

        Raises
        ------
        DataError
            As `Aligner.align`.
        ChildEndedError
            The process ended.
        """
        content = {"rate": sound.rate, "words": list(words)}
        payload = sound.samples.astype("<f4").tobytes()
        found = wait_elsewhere(self._thread.submit(self._child.call, ALIGN, content, payload)).content
        spans = tuple(WordSpan(*word) for word in found["words"])
        phones = PhoneSequence(found["phones"], found["edges"])
        return Alignment(phones, spans, found["confidence"], np.array(found["scores"], np.float64))

    def close(self) -> None:
        """End the process."""
        self._child.close()


def handlers() -> Mapping[str, Handler]:
    """Handlers of the process, with a loaded aligner."""
    aligner = Aligner()
    aligner.load()

    def align(call: Call) -> dict[str, Any]:
        words = [(text, [tuple(phones) for phones in alternatives]) for text, alternatives in call.content["words"]]
        found = aligner.align(Waveform(np.frombuffer(call.payload, "<f4"), call.content["rate"]), words)
        return {
            "phones": list(found.phones.phones),
            "edges": found.phones.edges.tolist(),
            "words": [[word.text, word.first, word.last] for word in found.words],
            "confidence": found.confidence,
            "scores": found.scores.tolist(),
        }

    return {ALIGN: align}
