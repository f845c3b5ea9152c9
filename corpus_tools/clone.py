"""A talker with one person's face model and another's recorded speech."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from lexicon.errors import InputError
from tts2face.face.clone import Cloning, append_missing, cloning
from tts2face.talker import Talker, Utterance, load_talker, write_talker

CONTENT = "motion only: one talker's recorded motion carried to the shape model of another's face; no image, no sound"
STATED = ("sources", "licence", "attribution")  # these bind whoever uses the clone, for both talkers
UNSTATED = "not stated"


@dataclass(frozen=True, slots=True, eq=False)
class Cloned:
    """A cloned talker and what happened on the way.

    ``n_appended`` modes were added to the target's; ``at_limits`` is the share of frames with a parameter at the
    target's limits; ``left_pictures`` tells that a talker had pictures, which are not carried over.
    """

    talker: Talker
    n_appended: int
    at_limits: float
    left_pictures: bool


def clone_talker(
    source: str, target: str, out: Path, *, gain: float = 1.0, append: bool = False, created: str | None = None
) -> Cloned:
    """Clone one talker's speech onto another's face and write it; equal talkers give equal bytes but for the date.

    Parameters
    ----------
    source, target
        Shipped talkers by name, or ``.talker`` files: who speaks, and whose face moves.
    gain
        Factor on the motion from rest, before the target's limits.
    append
        Give the target the components of the source's motion that its own modes lack.
    created
        Date for the metadata; today when None.

    Raises
    ------
    InputError
        There is no such talker, the source has no utterance, or the gain is no number from 0 up.
    DataError
        A talker is damaged or its model unfit.
    BackendError
        The file cannot be written.
    """
    made = cloned_talker(load_talker(source), load_talker(target), gain=gain, append=append)
    flags = [*(["--gain", f"{gain:g}"] if gain != 1.0 else []), *(["--append-missing"] if append else [])]
    words = ["tts2face", "corpus", "clone", Path(source).name, Path(target).name, "--out", out.name, *flags]
    dated = {"command": shlex.join(words), "created": created or datetime.now(UTC).date().isoformat()}
    made = replace(made, talker=replace(made.talker, metadata={**made.talker.metadata, **dated}))
    write_talker(out, made.talker)
    return made


def cloned_talker(source: Talker, target: Talker, *, gain: float = 1.0, append: bool = False) -> Cloned:
    """The talker with the target's shape model whose utterances are the source's, carried over.

    Sizes of the head's motion follow the faces' sizes, its angles stay. Pictures are left behind: the source's belong
    to another face, and the target's show no frame of these utterances.

    Raises
    ------
    InputError
        The source has no utterance, or the gain is no number from 0 up.
    DataError
        A shape model is unfit.
    """
    if not source.utterances:
        raise InputError("the source talker has no utterance to clone; give one that was built from recordings")
    model = append_missing(source.model, target.model) if append else target.model
    ready = cloning(source.model, model, gain=gain)
    utterances = tuple(_carried(utterance, ready) for utterance in source.utterances)
    shapes = np.concatenate([utterance.shape for utterance in utterances])
    n_appended = len(model.spread) - len(target.model.spread)
    about = {"gain": gain, "size": round(ready.size, 4), "appended_modes": n_appended}
    metadata = _metadata(source.metadata, target.metadata, about)
    at_limits = float((np.abs(shapes) >= ready.limits).any(axis=1).mean())
    left = source.appearance is not None or target.appearance is not None
    return Cloned(Talker(source.fps, model, utterances, metadata), n_appended, at_limits, left)


def _carried(utterance: Utterance, ready: Cloning) -> Utterance:
    head = utterance.head.copy()
    head[:, 3:] *= ready.size
    return replace(utterance, shape=ready.parameters(utterance.shape), head=head, looks=None)


def _metadata(source: Mapping[str, Any], target: Mapping[str, Any], about: Mapping[str, Any]) -> dict[str, Any]:
    """Provenance of both, and in full under ``cloning``."""
    origins = {
        role: {key: value for key, value in stated.items() if key != "refused"}
        for role, stated in (("speech", source), ("face", target))
    }
    return {
        "name": f"{target.get('name', UNSTATED)} with the speech of {source.get('name', UNSTATED)}",
        "language": source.get("language", UNSTATED),
        **{key: _both(source.get(key, UNSTATED), target.get(key, UNSTATED)) for key in STATED},
        "content": CONTENT,
        "cloning": {**about, **origins},
    }


def _both(of_speech: str, of_face: str) -> str:
    return of_speech if of_speech == of_face else f"speech: {of_speech}; face: {of_face}"
