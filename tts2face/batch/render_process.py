"""A child process that renders segments, so that a crash or a lack of memory ends one segment and not the batch."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from tts2face.batch.segment import Segment, segment_from_json
from tts2face.batch.segment_result import SegmentResult, result_from_json
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import Child
from tts2face.processes.program import Program

if TYPE_CHECKING:
    from tts2face.batch.render_segment import SegmentRenderer

RENDER = "render"  # name of the call


class RenderProcess(Child):
    """A child process with sessions of its own; one segment at a time.

    Parameters
    ----------
    core
        Core to which the child is bound, so that several of them do not compete; None: all cores.
    """

    def __init__(self, core: int | None = None) -> None:
        super().__init__(Program(f"{__name__}:HANDLERS", core=core))

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        """Render a segment in the child; a child that ended is started again at the next call.

        Raises
        ------
        InputError, DataError, BackendError
            As `SegmentRenderer.render`.
        ChildEndedError
            The child ended.
        BackendError
            The process was closed.
        """
        return result_from_json(self.call(RENDER, {"segment": segment.as_json(), "out": str(out)}).content)


@lru_cache(maxsize=1)
def _renderer() -> "SegmentRenderer":
    from tts2face.batch.render_segment import SegmentRenderer  # a second of imports, only in the child

    return SegmentRenderer()


def _render(call: Call) -> dict[str, Any]:
    return _renderer().render(segment_from_json(call.content["segment"]), Path(call.content["out"])).as_json()


HANDLERS: Mapping[str, Handler] = MappingProxyType({RENDER: _render})
