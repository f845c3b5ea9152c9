"""The timeline that a request asks for, in its file and in its flags."""

from tts2face.gesture.notation import parse_expressions, parse_gains, parse_style
from tts2face.gesture.spans import Gains
from tts2face.gesture.timeline import Timeline
from tts2face.gesture.timeline_file import read_timeline
from tts2face.request import Request


def build_request_timeline(request: Request) -> Timeline:
    """What a request's ``timeline``, ``style``, ``gain`` and ``expression`` ask for; flags win over the file.

    Raises
    ------
    InputError, DataError
        A flag or the file is wrong.
    """
    flags = Timeline(
        style=parse_style(request.style) if request.style is not None else {},
        expressions=parse_expressions(request.expression) if request.expression is not None else (),
        gains=parse_gains(request.gain) if request.gain is not None else Gains(),
    )
    return read_timeline(request.timeline).merge(flags) if request.timeline is not None else flags
