"""Task of the studio that explains a phone: the recorded examples that made it, and outlines of their lips."""

from collections.abc import Iterator
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lexicon.errors import DataError, InputError
from tts2face.exemplar.explanation import PhoneExplanation
from tts2face.exemplar.lip_outlines import N_INSTANTS, LipOutline, lip_outlines, token_outlines
from tts2face.models.talker import Talker
from tts2face.service.synthesis.project_tasks import read_project
from tts2face.service.synthesis.work import Event, Inputs, Work
from tts2face.synthesis.animated_face import AnimatedFace
from tts2face.types import Chunk

if TYPE_CHECKING:
    from tts2face.session import Session
    from tts2face.synthesis.speech_stream import Piece

MAX_EXAMPLES = 12  # of an explained phone
N_DECIMALS = 2  # of outlines, mm


def explain(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """The phone at ``time`` seconds with the recorded examples that made it; no phone where none is used.

    Each example has ``outlines`` of its lips, the phone those of the lips that were ``made``; empty if there are none.
    """
    project, time = read_project(work), float(work.request["time"])
    phone: PhoneExplanation | None = None
    made: list[dict[str, Any]] = []
    for piece in session.stream(project.prepare()):
        is_here = time < piece.begin + piece.clip.speech.waveform.duration
        if phone is None and (is_here or piece.transcript is not None):
            phone = next((one for one in piece.explain() if one.start <= time < one.end), None)
        if is_here and phone is not None:
            face = session.animated_face(has_gestures=project.request.has_gestures)
            made = _made_outlines(face, piece, phone)
        if is_here:
            break
        yield Chunk(b"")
    yield Event({"type": "explanation", "phone": None if phone is None else _described(session.talker, phone, made)})


def _described(talker: Talker, phone: PhoneExplanation, made: list[dict[str, Any]]) -> dict[str, Any]:
    found = asdict(phone)
    used = phone.tokens[:MAX_EXAMPLES]
    found["tokens"] = [asdict(one) | {"outlines": _json(token_outlines(talker, one))} for one in used]
    return found | {"made": made}


def _made_outlines(face: AnimatedFace, piece: "Piece", phone: PhoneExplanation) -> list[dict[str, Any]]:
    """Outlines of the lips of a piece from the beginning of a phone to its end; empty if the face cannot tell."""
    motion = piece.clip.motion
    times = np.linspace(phone.start, phone.end, N_INSTANTS) - piece.begin
    shown = motion.at(times)
    still = np.zeros_like(shown[:1])
    try:
        moved, rest = (face.landmarks(replace(motion, values=values)) for values in (shown, still))
    except (DataError, InputError):
        return []
    return _json(lip_outlines(moved, rest[0]))


def _json(outlines: tuple[LipOutline, ...]) -> list[dict[str, Any]]:
    return [
        {name: getattr(one, name).astype(float).round(N_DECIMALS).tolist() for name in ("outer", "inner")}
        for one in outlines
    ]
