"""The process in which the service shows a live face on targets of its operator.

Inputs are those of a live stream without targets: ``say``, ``gesture``, ``style``, ``listen``, ``heard``, ``cancel``,
or ``audio``, and ``end``. Results are events: ``target`` with its state, ``said``, ``cancelled`` and ``error``.
"""

import threading
import time
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from lexicon.errors import Tts2faceError
from lexicon.marked_text import GestureMark
from tts2face.picture.options import Picture
from tts2face.processes.child import Call, Handler, StoppedError
from tts2face.processes.message import Message
from tts2face.processes.program import Program
from tts2face.session.named_models import Models
from tts2face.storage.wave_files import pcm_samples
from tts2face.targets.broadcast import Broadcast, Listener, LivePlan
from tts2face.targets.states import TargetState
from tts2face.targets.table import parse_targets

LIVE_PROGRAM = Program(f"{__name__}:HANDLERS", at_once=2)  # so that a caller who leaves ends the call, not the process
PRESENT = "present"  # name of the call


class _Stream:
    """One live stream of a client on its way to a face."""

    def __init__(self, call: Call, request: dict[str, Any]) -> None:
        self._call, self._lock = call, threading.Lock()
        self._open: list[int] = []  # utterances of which the client has not been informed
        self._rate: int | None = None
        self.is_stopped = False
        given = call.content["targets"]
        self.fps = float(request.pop("fps", 30.0))
        plan = LivePlan(parse_targets(tuple(given.values())), Picture(), request, self.fps, names=tuple(given))
        listener = Listener(self._show_state, self._show_error, self._note_end)
        self.broadcast = Broadcast(plan, plan.make_targets(), listener)

    def feed(self, face: Any, _: Callable[[], bool]) -> int:
        """Follow the client's inputs until ``end``."""
        last = 0
        try:
            while (given := self._call.more()).content["type"] != "end":
                is_forgotten = given.content["type"] == "cancel"  # what was said before ends no more
                last = self._follow(face, given) or (0 if is_forgotten else last)
        except StoppedError:
            self.is_stopped = True
            self.broadcast.end()
        face.end_sound()
        return last

    def _follow(self, face: Any, given: Message) -> int:
        """The utterance of an input; 0 where it is none."""
        content = given.content
        match content["type"]:
            case "say":
                number: int = face.say(content["text"])
                with self._lock:
                    self._open.append(number)
                return number
            case "audio":
                spoken: int = face.push_sound(pcm_samples(given.payload), self._call.content["rate"])
                return spoken
            case "gesture":
                face.gesture(GestureMark(**content["gesture"]))
            case "style":
                face.style(content["style"])
            case "listen":
                self._rate = content["rate"]
                face.listen()
            case "heard" if self._rate is not None:
                face.listen(pcm_samples(given.payload), self._rate)
            case "cancel":
                face.interrupt()
                self._say(0)
                at, after_s = self.broadcast.n_frames / self.fps, time.monotonic() - content["arrived"]
                self._event({"type": "cancelled", "at": round(at, 4), "after_ms": round(1000 * after_s, 1)})
        return 0

    def _show_state(self, state: TargetState) -> None:
        shown = {"type": "target", "name": state.target, "state": state.state}
        self._event(shown | ({"reason": state.reason, "retry_s": state.retry_s} if state.reason else {}))

    def _show_error(self, error: Tts2faceError) -> None:
        self._event({"type": "error", "message": " ".join(str(error).split())})

    def _note_end(self, utterance: int) -> None:
        self._say(utterance)

    def _say(self, utterance: int) -> None:
        """Tell the service that utterances up to one have ended; 0: all have."""
        with self._lock:
            rest = [number for number in self._open if 0 < utterance < number]
            n, self._open = len(self._open) - len(rest), rest
        if n:
            self._event({"type": "said", "n": n})

    def _event(self, content: Mapping[str, Any]) -> None:
        self._call.event({"event": content, "seconds": round(self.broadcast.n_spoken / self.fps, 4)})


def present(call: Call) -> Mapping[str, Any]:
    """Show a live face on targets until the client ends it or leaves.

    Raises
    ------
    InputError, DataError, BackendError
        A model, an option or a target is wrong, or no target can be reached.
    """
    stream = _Stream(call, dict(call.content["request"]))
    stream.broadcast.run(Models(**call.content["models"]).open_session(), stream.feed)
    if stream.is_stopped:
        raise StoppedError
    return {"seconds": round(stream.broadcast.n_spoken / stream.fps, 4), "cpu_s": time.process_time()}


HANDLERS: Mapping[str, Handler] = MappingProxyType({PRESENT: present})
