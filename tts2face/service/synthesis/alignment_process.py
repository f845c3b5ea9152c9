"""Forced alignment in a process of its own, which can be ended in the middle of a sentence.

Started as ``python -m tts2face.service.synthesis.alignment_process``. A job is a line of JSON (number, rate, number of
samples, words with pronunciations) and the samples as float32; its answers are lines of JSON: that it is read, and the
result.
The process loads the acoustic model and forks a worker; on `CANCEL`, which may follow once a job is read, it ends the
worker, forks another one within some milliseconds, and answers ``null``.
"""

import json
import os
import signal
import sys
from typing import Any, BinaryIO

import numpy as np

from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.processes.child import claim_standard_output
from tts2face.speech.forced_alignment import Aligner, Alignment, Pronunciations
from tts2face.types import Waveform

SAMPLE_BYTES = 4
CANCEL = signal.SIGUSR1


def encode_job(number: int, sound: Waveform, words: list[tuple[str, Pronunciations]]) -> bytes:
    """Bytes of a job."""
    head = {"job": number, "rate": sound.rate, "samples": len(sound.samples), "words": words}
    return json.dumps(head).encode() + b"\n" + sound.samples.astype("<f4").tobytes()


def decode_answer(content: dict[str, Any]) -> Alignment:
    """Alignment of an answer.

    Raises
    ------
    DataError
        As `Aligner.align`.
    """
    if "error" in content:
        raise DataError(content["error"])
    phones = PhoneSequence(content["phones"], content["edges"])
    words = tuple(WordSpan(*word) for word in content["words"])
    return Alignment(phones, words, content["confidence"], np.array(content["scores"], np.float64))


def _answer(aligner: Aligner, head: dict[str, Any], samples: bytes) -> dict[str, Any]:
    words = [(text, [tuple(phones) for phones in alternatives]) for text, alternatives in head["words"]]
    try:
        found = aligner.align(Waveform(np.frombuffer(samples, "<f4"), head["rate"]), words)
    except DataError as error:
        return {"error": str(error)}
    return {
        "phones": list(found.phones.phones),
        "edges": found.phones.edges.tolist(),
        "words": [[word.text, word.first, word.last] for word in found.words],
        "confidence": found.confidence,
        "scores": found.scores.tolist(),
    }


def _work(aligner: Aligner, answers: BinaryIO) -> None:
    """Execute jobs until standard input ends."""
    while line := sys.stdin.buffer.readline():
        head = json.loads(line)
        samples = sys.stdin.buffer.read(SAMPLE_BYTES * head["samples"])
        _write(answers, {"job": head["job"], "is_read": True})  # from now on it may be ended
        _write(answers, {"job": head["job"], **_answer(aligner, head, samples)})


def _write(answers: BinaryIO, answer: Any) -> None:
    answers.write(json.dumps(answer).encode() + b"\n")
    answers.flush()


def main() -> None:
    """Keep a worker until standard input ends."""
    answers = claim_standard_output()
    aligner = Aligner()
    aligner.load()  # once for all workers
    worker = 0
    signal.signal(CANCEL, lambda *_: os.kill(worker, signal.SIGKILL) if worker else None)
    while True:
        signal.pthread_sigmask(signal.SIG_BLOCK, {CANCEL})  # until the worker's number is known
        worker = os.fork()
        if worker == 0:
            signal.signal(CANCEL, signal.SIG_IGN)
            _work(aligner, answers)
            os._exit(0)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {CANCEL})
        _, status = os.waitpid(worker, 0)
        worker = 0
        if not os.WIFSIGNALED(status):
            return
        _write(answers, None)


if __name__ == "__main__":
    main()
