"""A clip as a column of steps: each piece gains speech, then lip motion, gestures, edits and the motion of the body.

The first step makes the pieces: `spoken_pieces` those of a text and of idle animation, `recorded_pieces` those of a
recording. Gestures are drawn in a thread from the step before the lips on. Shapes of combinations come last.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from tts2face.face.combinations import with_combinations
from tts2face.request import Recorded
from tts2face.session.gesture_layer import GestureLayer
from tts2face.session.lip_steps import Lips, RecordedLips, SynthesisModels
from tts2face.session.prepared import PreparedRequest
from tts2face.session.recorded_speech import hear, recorded_pieces
from tts2face.session.speech_stream import Piece, spoken_ahead, spoken_pieces
from tts2face.types import Progress, YieldTurn, ignore_progress

Step = Callable[[Piece], Piece]


def pieces(
    prepared: PreparedRequest,
    models: SynthesisModels,
    gestures: GestureLayer | None,
    on_heard: Progress = ignore_progress,
) -> Iterator[Piece]:
    """Synthesise the clip of a request piece by piece.

    Each piece ends on a frame boundary, so that sound and picture stay synchronous at any length, in bounded memory.
    The face is at rest at both ends of the pieces of a text.

    Parameters
    ----------
    gestures
        Gestures of this clip; None for lip motion only.
    on_heard
        Called while the phones of a recording are found, before its first piece.
    """
    yield from pieces_from(prepared, models, gestures, on_heard=on_heard)
    if gestures is not None:
        gestures.finish()


def pieces_from(
    prepared: PreparedRequest,
    models: SynthesisModels,
    gestures: GestureLayer | None,
    first_frame: int = 0,
    on_heard: Progress = ignore_progress,
    *,
    ends_on_frame: bool = False,
) -> Iterator[Piece]:
    """Pieces of a recording, or of a text or idle animation, which begins, and may end, on a frame of a longer clip."""
    source = prepared.request.source
    speech = models.speech
    lips: Step = Lips(prepared, models)
    if isinstance(source, Recorded):
        heard = hear(prepared, source, models.talker, speech.memory, on_heard)
        started, lips = recorded_pieces(prepared, source, heard), RecordedLips(Lips(prepared, models), source, heard)
    else:
        started = spoken_pieces(prepared, speech, first_frame, ends_on_frame=ends_on_frame)
        if gestures is not None:
            started = spoken_ahead(started, prepared.timeline, speech.yield_turn)
    yield from moved_pieces(started, lips, gestures, speech.yield_turn)


def moved_pieces(
    started: Iterable[Piece], lips: Step, gestures: GestureLayer | None, yield_turn: YieldTurn
) -> Iterator[Piece]:
    """Pieces that have speech, with lip motion and all that follows it."""
    steps: list[Step] = [lips] if gestures is None else [gestures.draw, lips, gestures, gestures.edits, gestures.body]
    for piece in started:
        for step in steps:
            yield_turn()
            piece = step(piece)  # noqa: PLW2901 - it gains from step to step
        # no turn is given before: gestures continue from a piece that is interrupted here
        yield _combine_shapes(piece)


def _combine_shapes(piece: Piece) -> Piece:
    motion = with_combinations(piece.clip.motion)
    return piece if motion is piece.clip.motion else replace(piece, clip=replace(piece.clip, motion=motion))
