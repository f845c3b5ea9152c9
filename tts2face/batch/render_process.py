"""A child process that renders segments, so that a crash or a lack of memory ends one segment and not the batch.

Requests are lines of JSON on its standard input, answers on its standard output. It ends with its parent, as the pipe
of the requests closes then.
"""

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError, DataError, InputError, Tts2faceError
from tts2face.batch.segment import Segment, segment_from_json
from tts2face.batch.segment_result import SegmentResult, result_from_json
from tts2face.child_process import exit_after

if TYPE_CHECKING:
    from tts2face.batch.render_segment import SegmentRenderer

KINDS: dict[str, type[Tts2faceError]] = {"InputError": InputError, "DataError": DataError, "BackendError": BackendError}
# glibc returns blocks of 1 MiB and more to the system, instead of keeping those of each thread (decision 064).
RETURNED_BLOCKS = {"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "1048576"}
MAX_SHOWN_CHARACTERS = 300  # of the standard error of a child that ended


class ChildDiedError(BackendError):
    """The child process ended while it rendered; another try may succeed."""


class RenderProcess:
    """A child process with sessions of its own; one segment at a time.

    Parameters
    ----------
    core
        Core to which the child is bound, so that several of them do not compete; None: all cores.
    """

    def __init__(self, core: int | None = None) -> None:
        self._core = core
        self._child: subprocess.Popen[bytes] | None = None
        self._errors: Any = None
        self._lock = threading.Lock()

    @property
    def pid(self) -> int | None:
        """Number of the child process; None before the first segment."""
        return None if self._child is None else self._child.pid

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        """Render a segment in the child; a child that ended is started again at the next call.

        Raises
        ------
        InputError, DataError, BackendError
            As `SegmentRenderer.render`.
        ChildDiedError
            The child ended.
        """
        with self._lock:
            child = self._child or self._start()
            request = json.dumps({"segment": segment.as_json(), "out": str(out)})
            try:
                child.stdin.write(request.encode() + b"\n")  # type: ignore[union-attr]
                child.stdin.flush()  # type: ignore[union-attr]
                answer = child.stdout.readline()  # type: ignore[union-attr]
            except (OSError, ValueError):
                answer = b""
            if not answer.endswith(b"\n"):
                raise ChildDiedError(f"the rendering process ended: {self._end()}; check its memory and run again")
        found = json.loads(answer)
        if "error" in found:
            raise KINDS.get(found["error"], BackendError)(found["message"])
        return result_from_json(found["result"])

    def kill(self) -> None:
        """End the child process while another thread waits for it."""
        child = self._child
        if child is not None:
            child.kill()

    def close(self) -> None:
        """End the child process."""
        if self._child is not None:
            self._child.kill()
            self._end()

    def _start(self) -> subprocess.Popen[bytes]:
        environment = dict(os.environ) | RETURNED_BLOCKS
        if self._core is not None:
            environment |= {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the child
        arguments = [sys.executable, "-m", "tts2face.batch.render_process"]
        if self._core is not None:
            arguments.append(str(self._core))
        self._child = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, env=environment
        )
        return self._child

    def _end(self) -> str:
        """Wait for the child; why it ended."""
        child, self._child = self._child, None
        if child is None:
            return "it was closed"
        for stream in (child.stdin, child.stdout):
            if stream is not None:
                try:
                    stream.close()
                except OSError:
                    continue
        code = child.wait()
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        self._errors.close()
        return (lines[-1] if lines else f"exit code {code}")[:MAX_SHOWN_CHARACTERS]


def main() -> None:
    """Answer requests until standard input ends."""
    if len(sys.argv) > 1 and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(sys.argv[1])})
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints must not mix with the answers
    requests: queue.Queue[bytes] = queue.Queue()

    def read_requests() -> None:
        while line := sys.stdin.buffer.readline():
            requests.put(line)

    exit_after(read_requests)
    from tts2face.batch.render_segment import SegmentRenderer  # a second of imports, only in the child

    renderer = SegmentRenderer()
    while True:
        request = json.loads(requests.get())
        answers.write(json.dumps(_answer(renderer, request)).encode() + b"\n")
        answers.flush()


def _answer(renderer: "SegmentRenderer", request: dict[str, Any]) -> dict[str, Any]:
    try:
        result = renderer.render(segment_from_json(request["segment"]), Path(request["out"]))
        return {"result": result.as_json()}
    except Tts2faceError as error:
        kind = next((name for name, one in KINDS.items() if isinstance(error, one)), "BackendError")
        return {"error": kind, "message": str(error)}


if __name__ == "__main__":
    main()
