"""A child process that renders segments, so that a crash or a lack of memory ends one segment and not the batch."""

from pathlib import Path

from tts2face.processes.parent import Child
from tts2face.processes.program import Program
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.segment_result import SegmentResult, result_from_json

RENDER = "render"  # name of the call
HANDLERS = "tts2face.serving.batch.render:HANDLERS"  # what the parent itself does not import


class RenderProcess(Child):
    """A child process with sessions of its own; one segment at a time.

    Parameters
    ----------
    core
        Core to which the child is bound, so that several of them do not compete; None: all cores.
    """

    def __init__(self, core: int | None = None) -> None:
        super().__init__(Program(HANDLERS, core=core))

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        """Render a segment in the child; a child that ended is started again at the next call.

        Raises
        ------
        InputError, DataError, BackendError
            As `tts2face.serving.batch.render.SegmentRenderer.render`.
        ChildEndedError
            The child ended.
        BackendError
            The process was closed.
        """
        return result_from_json(self.call(RENDER, {"segment": segment.as_json(), "out": str(out)}).content)
