"""A synthesis process that loads no models: it sends known bytes in parts, until its caller leaves.

``python -m tests.serving.service.table_synthesis serve ...`` is ``tts2face serve`` with such processes, for tests of
signals and kills, to which it does not matter what is made.
"""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from lexicon.errors import InputError
from tts2face.processes.child import Call, Handler, StoppedError
from tts2face.serving.service.messages import SERVE, SYNTHESISE

PART = bytes(range(256)) * 16
N_PARTS, PAUSE_S = 60, 0.05  # of a film, which takes some seconds
FILM = PART * N_PARTS
FAILS, N_BEFORE_FAILURE = "fails late", 2  # words of a text whose film fails after some parts
FAILURE = "the nod at 60 s lies beyond the clip, which lasts 1.20 s; move it"


def synthesise(call: Call) -> Mapping[str, float]:
    """A film in parts, which fails where the text says so; of a live stream an event, and no end."""
    is_live, text = call.content["work"]["kind"] == "live", call.content["work"]["request"].get("text", "")
    if is_live:
        call.event({"seconds": 0.0, "event": {"type": "curves"}})
    for number in range(10**9 if is_live else N_PARTS):
        if number == N_BEFORE_FAILURE and FAILS in text:
            raise InputError(FAILURE)
        with call.changed:
            if call.changed.wait_for(lambda: call.is_stopped, PAUSE_S):
                raise StoppedError
        if not is_live:
            call.event({"seconds": 0.1}, PART)
    return {"seconds": 0.1 * N_PARTS, "cpu_s": 0.0}


def serve(call: Call) -> Mapping[str, Any]:
    """As `tts2face.serving.service.synthesis.serve`."""
    call.event({})
    return call.more().content


def prepare(_: Call) -> Mapping[str, Any]:
    """There is nothing to prepare."""
    return {}


def handlers(**_: Any) -> Mapping[str, Handler]:
    """Handlers of the process; the settings of the service make no difference."""
    return defaultdict(lambda: prepare, {SYNTHESISE: synthesise, SERVE: serve})


if __name__ == "__main__":
    from cli.main import main
    from tts2face.serving.service import warm_process

    warm_process.PROGRAM = "tests.serving.service.table_synthesis:handlers"
    main()
