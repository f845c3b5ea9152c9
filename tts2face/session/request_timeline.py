"""Timelines of a request: gestures and expressions of its options and its file, and of a face that listens."""

from lexicon.errors import InputError
from tts2face.gestures.elements import ExpressionSpan, Gains, ListeningSpan
from tts2face.gestures.listening import CUE_RATE, cue_times, responses
from tts2face.gestures.timeline import Timeline, parse_expressions, parse_gains, parse_style
from tts2face.gestures.timeline_file import read_timeline
from tts2face.request import CAMERA, Listening, Recorded, Request

OF_VIDEO = "video"  # expression of the person in the video of a recording
SMILE_S = 10.0  # of its beginning are read


def build_request_timeline(request: Request) -> Timeline:
    """Timeline of a request's ``timeline`` file, overridden by its ``style``, ``gain`` and ``expression``."""
    flags = Timeline(
        style=parse_style(request.style) if request.style is not None else {},
        expressions=_expressions(request),
        gains=_gains(request),
    )
    return read_timeline(request.timeline).merge(flags) if request.timeline is not None else flags


def _expressions(request: Request) -> tuple[ExpressionSpan, ...]:
    if request.expression is None:
        return ()
    if request.expression.strip() != OF_VIDEO:
        return parse_expressions(request.expression)
    source = request.source
    if not isinstance(source, Recorded):
        raise InputError("--expression video needs a recording with pictures of the person; add --audio clip.mp4")
    from tts2face.lips.performer import held_smile, smile_weight
    from tts2face.video.blendshapes import BlendshapeReader
    from tts2face.video.streaming import StreamingTracker
    from tts2face.video.take import read_take

    take = read_take(source.audio, StreamingTracker(), BlendshapeReader(), seconds=SMILE_S)
    smile = held_smile(take.scores)
    return (ExpressionSpan("happy", smile_weight(smile)),) if smile else ()


def _gains(request: Request) -> Gains:
    gains = parse_gains(request.gain) if request.gain is not None else Gains()
    if request.gaze != CAMERA:
        return gains
    if "gaze" in gains.factors:
        raise InputError("--gain of the gaze has no effect with --gaze camera; remove one of them")
    return Gains({**gains.factors, "gaze": 0.0})


def listening_timeline(request: Request) -> Timeline:
    """Motion of the face while it listens; what is heard of a partner gives the responses."""
    source = request.source
    if not isinstance(source, Listening):
        return Timeline()
    span = ListeningSpan(0.0, source.seconds, reacts=source.partner is None)
    cues: list[float] = []
    if source.partner is not None:
        from tts2face.video.media import read_sound

        cues = [time for time in cue_times(read_sound(source.partner, CUE_RATE)) if time < source.seconds]
    return responses(cues, request.known_seed).merge(Timeline(listens=(span,)))
