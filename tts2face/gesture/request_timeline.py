"""The timeline that a request asks for, in its file and in its flags."""

from tts2face.gesture.notation import expressions_of, gains_of, style_of
from tts2face.gesture.spans import Gains
from tts2face.gesture.timeline import Timeline
from tts2face.gesture.timeline_file import read_timeline
from tts2face.request import Request


def asked(request: Request) -> Timeline:
    """What a request's ``timeline``, ``style``, ``gain`` and ``expression`` ask for; flags win over the file.

    Raises
    ------
    InputError, DataError
        A flag or the file is wrong.
    """
    flags = Timeline(
        style=style_of(request.style) if request.style is not None else {},
        expressions=expressions_of(request.expression) if request.expression is not None else (),
        gains=gains_of(request.gain) if request.gain is not None else Gains(),
    )
    return read_timeline(request.timeline).merged(flags) if request.timeline is not None else flags
