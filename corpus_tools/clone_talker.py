"""A talker with one person's face model and another's recorded speech."""

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.appearance.transfer import build_appearance_transfer
from lexicon.errors import InputError
from tts2face.face.appearance_regression import fit_appearance_regression
from tts2face.lips.cloning import ParameterTransfer, build_parameter_transfer, extend_talker
from tts2face.models.consent import stated_consent
from tts2face.models.talker import NOT_STATED, Talker, Utterance, speech_channels
from tts2face.models.talker_file import load_talker, write_talker
from tts2face.types import Trajectory

CONTENT = (
    "motion only: one talker's recorded motion transferred to the shape model of another's face; no image, no sound"
)
CONTENT_WITH_PICTURES = (
    "one talker's recorded motion transferred to another's face, with pictures of that face by consent; no sound"
)
LICENCE_FIELDS = ("sources", "licence", "attribution")  # of both talkers; they apply to the clone
AppearanceFunction = Callable[[Utterance, NDArray[np.float32]], NDArray[np.float32] | None]


@dataclass(frozen=True, slots=True, eq=False)
class ClonedTalker:
    """A cloned talker.

    ``n_appended`` is the number of modes added to the target's; ``share_at_limits`` the share of frames with a
    parameter at the target's limits; ``lacks_appearance`` is true if only the source has an appearance model.
    """

    talker: Talker
    n_appended: int
    share_at_limits: float
    lacks_appearance: bool


def clone_talker(
    source: str, target: str, out: Path, *, gain: float = 1.0, append: bool = False, created: str | None = None
) -> ClonedTalker:
    """Clone one talker's speech onto another's face and write the talker; its bytes are reproducible except the date.

    Parameters
    ----------
    source, target
        Shipped talkers by name, or ``.talker`` files, of the speech and of the face.
    gain
        Factor on the motion from rest, before the target's limits.
    append
        Append modes for components of the source's motion outside the target's model.
    created
        Date for the metadata; today when None.

    Raises
    ------
    InputError
        There is no such talker, the source has no utterance, or the gain is not a number from 0 up.
    DataError
        A talker is damaged or its shape model is unsuitable.
    BackendError
        The file cannot be written.
    """
    clone = transfer_talker(load_talker(source), load_talker(target), gain=gain, append=append)
    flags = [*(["--gain", f"{gain:g}"] if gain != 1.0 else []), *(["--append-missing"] if append else [])]
    words = ["tts2face", "corpus", "clone", Path(source).name, Path(target).name, "--out", out.name, *flags]
    dated = {"command": shlex.join(words), "created": created or datetime.now(UTC).date().isoformat()}
    clone = replace(clone, talker=replace(clone.talker, metadata={**clone.talker.metadata, **dated}))
    write_talker(out, clone.talker)
    return clone


def transfer_talker(source: Talker, target: Talker, *, gain: float = 1.0, append: bool = False) -> ClonedTalker:
    """The talker with the target's face and the source's utterances.

    Head translations are scaled with the size of the faces; angles do not change. If the target has an appearance
    model, its parameters are transferred from the source by eq. 5, or predicted from the lips if the source has none.
    """
    if not source.utterances:
        raise InputError("the source talker has no utterance to clone; give a talker built from recordings")
    n_before = len(target.model.spread)
    target = extend_talker(source.model, target) if append else target
    ready = build_parameter_transfer(source.model, target.model, gain=gain)
    appearance = _appearance_function(source, target, gain)
    utterances = tuple(_transfer_utterance(utterance, ready, appearance) for utterance in source.utterances)
    shapes = np.concatenate([utterance.shape for utterance in utterances])
    n_appended = len(target.model.spread) - n_before
    about = {"gain": gain, "size": round(ready.size, 4), "appended_modes": n_appended}
    metadata = _metadata(source.metadata, target.metadata, about, has_pictures=target.appearance is not None)
    at_limits = float((np.abs(shapes) >= ready.limits).any(axis=1).mean())
    talker = Talker(source.fps, target.model, utterances, metadata, target.appearance)
    return ClonedTalker(talker, n_appended, at_limits, source.appearance is not None and target.appearance is None)


def _appearance_function(source: Talker, target: Talker, gain: float) -> AppearanceFunction:
    """Function from an utterance and its shape on the target to appearance parameters, or None without a model."""
    if target.appearance is None:
        return lambda spoken, shape: None
    if source.appearance is not None:
        transfer = build_appearance_transfer(source.appearance, target.appearance)
        return lambda spoken, shape: (
            None
            if spoken.appearance_parameters is None
            else transfer.parameters(spoken.appearance_parameters, gain=gain)
        )
    predict = appearance_from_lips(target)
    return lambda _spoken, shape: predict(shape, source.fps)


def appearance_from_lips(
    talker: Talker,
) -> Callable[[NDArray[np.float32], float], NDArray[np.float32]]:
    """Function from shape parameters (T, M) at a frame rate to a talker's appearance parameters, fitted on its own."""
    own, channels = fit_appearance_regression(talker), speech_channels(talker.model)

    def predict(shape: NDArray[np.float32], fps: float) -> NDArray[np.float32]:
        lips = Trajectory(channels, shape[:, : len(channels)], fps)
        return np.asarray(own.motion(lips).values[:, len(channels) :], np.float32)

    return predict


def _transfer_utterance(utterance: Utterance, ready: ParameterTransfer, appearance: AppearanceFunction) -> Utterance:
    head = utterance.head.copy()
    head[:, 3:] *= ready.size
    shape = ready.parameters(utterance.shape)
    return replace(utterance, shape=shape, head=head, appearance_parameters=appearance(utterance, shape))


def _metadata(
    source: Mapping[str, Any], target: Mapping[str, Any], about: Mapping[str, Any], *, has_pictures: bool
) -> dict[str, Any]:
    """Provenance of both talkers, with full details under ``cloning``."""
    origins = {
        role: {key: value for key, value in stated.items() if key != "refused"}
        for role, stated in (("speech", source), ("face", target))
    }
    return {
        "name": f"{target.get('name', NOT_STATED)} with the speech of {source.get('name', NOT_STATED)}",
        "language": source.get("language", NOT_STATED),
        **{key: _merge_statements(source.get(key, NOT_STATED), target.get(key, NOT_STATED)) for key in LICENCE_FIELDS},
        "content": CONTENT_WITH_PICTURES if has_pictures else CONTENT,
        **({"consent": target["consent"]} if has_pictures and stated_consent(target) is not None else {}),
        "cloning": {**about, **origins},
    }


def _merge_statements(of_speech: str, of_face: str) -> str:
    return of_speech if of_speech == of_face else f"speech: {of_speech}; face: {of_face}"
