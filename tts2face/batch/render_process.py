"""A child process that renders segments, so that a crash or a lack of memory ends one segment and not the batch.

Requests are lines of JSON on its standard input, answers on its standard output. It ends with its parent, as the pipe
of the requests closes then.
"""

import json
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError, DataError, InputError, Tts2faceError
from tts2face.batch.segment import Segment, segment_from_json
from tts2face.batch.segment_result import SegmentResult, result_from_json
from tts2face.child_process import bind_to_core, child_environment, claim_standard_output, received_requests

if TYPE_CHECKING:
    from tts2face.batch.render_segment import SegmentRenderer

KINDS: dict[str, type[Tts2faceError]] = {"InputError": InputError, "DataError": DataError, "BackendError": BackendError}
KILL_AGAIN_S = 0.05
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
        self.is_closed = False

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
        BackendError
            The process was closed.
        """
        with self._lock:
            if self.is_closed:
                raise BackendError("the rendering process was closed; run again")
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
        """End the child process at once and for good, also while another thread waits for it."""
        self.is_closed = True
        self.kill()
        while not self._lock.acquire(timeout=KILL_AGAIN_S):  # the other thread was about to start the child
            self.kill()
        try:
            self._end()
        finally:
            self._lock.release()

    def _start(self) -> subprocess.Popen[bytes]:
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the child
        arguments = [sys.executable, "-m", "tts2face.batch.render_process"]
        if self._core is not None:
            arguments.append(str(self._core))
        self._child = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
            env=child_environment(self._core),
        )  # fmt: skip
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
    bind_to_core(int(sys.argv[1]) if len(sys.argv) > 1 else None)
    answers, requests = claim_standard_output(), received_requests()
    from tts2face.batch.render_segment import SegmentRenderer  # a second of imports, only in the child

    renderer = SegmentRenderer()
    while True:
        request, _ = requests.get()
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
