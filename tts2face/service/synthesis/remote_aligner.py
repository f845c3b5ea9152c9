"""Aligner whose work another process does, so that this one serves other tasks meanwhile, and can cancel it."""

import json
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import Any

from lexicon.errors import BackendError
from tts2face.service.synthesis.alignment_process import CANCEL, decode_answer, encode_job
from tts2face.service.synthesis.turns import AbandonedError, QueueLock, wait_elsewhere
from tts2face.speech.forced_alignment import Alignment, Pronunciations
from tts2face.types import Waveform


class RemoteAligner:
    """Aligner with the results of `tts2face.speech.forced_alignment.Aligner`; thread-safe, one sentence at a time."""

    def __init__(self) -> None:
        self._lock = QueueLock()  # held during a job
        self._child: subprocess.Popen[bytes] | None = None
        self._number, self._n_cancelled = 0, 0  # jobs; signals that no answer has come to
        self._counting = threading.Lock()

    def start(self) -> None:
        """Start the process, which takes a second, unless it runs."""
        if self._child is None or self._child.poll() is not None:
            self.close()
            command = [sys.executable, "-m", "tts2face.service.synthesis.alignment_process"]
            self._child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def align(self, sound: Waveform, words: Sequence[tuple[str, Pronunciations]]) -> Alignment:
        """As `Aligner.align`.

        Raises
        ------
        BackendError
            The process ended.
        """
        job = _Job(self, sound, list(words))
        return decode_answer(wait_elsewhere(job.run, job.abandon))

    def _count_cancelled(self, change: int) -> None:
        with self._counting:  # signals are sent in one thread, and answers read in another
            self._n_cancelled += change

    def close(self) -> None:
        """End the process."""
        child, self._child, self._n_cancelled = self._child, None, 0
        if child is not None:
            child.kill()
            child.communicate()


class _Job:
    """One sentence."""

    def __init__(self, aligner: RemoteAligner, sound: Waveform, words: list[tuple[str, Pronunciations]]) -> None:
        self._aligner, self._sound, self._words = aligner, sound, words
        self._lock = threading.Lock()
        self._child: subprocess.Popen[bytes] | None = None  # while it may be ended
        self._is_abandoned = threading.Event()

    def run(self) -> dict[str, Any]:
        """Answer of the process."""
        with self._aligner._lock.hold(self._is_abandoned):
            self._aligner.start()
            self._aligner._number += 1
            child, number = self._aligner._child, self._aligner._number
            assert child is not None
            with self._lock:
                if self._is_abandoned.is_set():
                    raise AbandonedError
            try:
                while self._aligner._n_cancelled:  # a worker that is about to end must not read this job
                    self._read(child)
                _send(child, encode_job(number, self._sound, self._words))
                return self._receive(child, number)
            except BackendError:
                self._aligner.close()  # what a worker that ended has left unread
                raise
            finally:
                with self._lock:
                    self._child = None

    def abandon(self) -> None:
        """End the work, as soon as the process has read it."""
        with self._lock:
            self._is_abandoned.set()
            self._end()

    def _end(self) -> None:
        if self._child is not None:
            self._aligner._count_cancelled(1)
            self._child.send_signal(CANCEL)
            self._child = None

    def _receive(self, child: "subprocess.Popen[bytes]", number: int) -> dict[str, Any]:
        while True:
            answer = self._read(child)
            if answer is None and self._is_abandoned.is_set():
                raise AbandonedError
            if answer is None or answer["job"] != number:
                continue
            if "is_read" not in answer:
                return answer
            with self._lock:
                self._child = child
                if self._is_abandoned.is_set():
                    self._end()

    def _read(self, child: "subprocess.Popen[bytes]") -> dict[str, Any] | None:
        """Next answer; None after the end of a cancelled worker."""
        assert child.stdout is not None
        line = child.stdout.readline()
        if not line or (line == b"null\n" and not self._aligner._n_cancelled):
            raise BackendError("the process that aligns speech ended; repeat the request")
        answer: dict[str, Any] | None = json.loads(line)
        if answer is None:
            self._aligner._count_cancelled(-1)
        return answer


def _send(child: "subprocess.Popen[bytes]", content: bytes) -> None:
    assert child.stdin is not None
    try:
        child.stdin.write(content)
        child.stdin.flush()
    except OSError as ended:
        raise BackendError("the process that aligns speech ended; repeat the request") from ended
