"""A worker whose rendering is a short sleep: ``python -m tests.serving.work.stub_worker DATABASE STORE LOG SECONDS``.

Each rendering adds a line to the log. A segment whose words contain "poison" ends the whole worker.
"""

import os
import sys
import time
from pathlib import Path

from lexicon.errors import InputError
from tts2face.processes.child import exit_after
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.work.worker import Worker


class Stub:
    def __init__(self, log: Path, seconds: float) -> None:
        self.log, self.seconds = log, seconds

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        text = segment.request["text"]
        if "poison" in text:
            os._exit(9)
        if "wrong" in text:
            raise InputError("these words are wrong")
        time.sleep(self.seconds)
        out.write_bytes(b"movie of " + segment.address.encode())
        with self.log.open("a") as log:
            log.write(f"{segment.address} {os.getpid()} {time.time()}\n")
        return SegmentResult(segment.window_frames, 10.0)


def main() -> None:
    database, store, log, seconds = sys.argv[1:5]
    exit_after(lambda: os.read(0, 1))
    renderer = Stub(Path(log), float(seconds))
    Worker(database, store, renderer=renderer, on_message=lambda text: sys.stderr.write(f"{text}\n")).run()


if __name__ == "__main__":
    main()
