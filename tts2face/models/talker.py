"""Talker model, built from the recordings of one person, and the ``.talker`` file format."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.models.appearance import STEPS_PER_PARAMETER, Appearance, appearance_arrays, appearance_from_arrays
from tts2face.models.audio_map import AudioMap, audio_map_arrays, audio_maps_from_arrays
from tts2face.models.networks import (
    PhoneNetwork,
    ScoreMap,
    network_arrays,
    network_from_arrays,
    score_map_arrays,
    score_map_from_arrays,
)
from tts2face.models.talker_schema import check_talker
from tts2face.processes.shared import Shared, file_state
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.types import HEAD_CHANNELS, Trajectory

KIND = "talker"
FORMAT_VERSION = 1
STEPS_PER_SPREAD = 2000.0
NOT_STATED = "not stated"  # by who made the model: its name, language, sources, licence


@dataclass(frozen=True, slots=True, eq=False)
class ShapeModel:
    """Linear model of landmark shapes with head pose removed: ``shape = mean + sum_i p_i basis_i``.

    Parameters
    ----------
    mean : (L, 3)
        Millimetres; axes as in `tts2face.models.landmarks`.
    basis : (M, L, 3)
        Orthonormal as rows of (M, 3 L), so that inner products map parameters between models (T07 eq. 5).
        The first `n_speech` move only the mouth region; the others move only the rest of the face.
    spread : (M,)
        Standard deviation of each parameter over the training frames, millimetres.
    n_speech
        Number of leading modes that speech moves.
    rest : (M,)
        Parameters of the talker at rest: silent, lips closed.
    """

    mean: NDArray[np.float32]
    basis: NDArray[np.float32]
    spread: NDArray[np.float32]
    n_speech: int
    rest: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree, then make them read-only."""
        modes, landmarks = self.basis.shape[:2]
        fits = self.mean.shape == (landmarks, 3) and self.basis.shape[2:] == (3,)
        if not fits or not self.spread.shape == self.rest.shape == (modes,) or not 0 < self.n_speech <= modes:
            raise DataError("the shape model's mean, basis, spread and rest do not fit each other; build it again")
        for array in (self.mean, self.basis, self.spread, self.rest):
            array.setflags(write=False)

    def shapes(self, parameters: NDArray[np.floating]) -> NDArray[np.float32]:
        """Landmarks (T, L, 3), mm, for parameters (T, m) of the first m modes."""
        n_modes = parameters.shape[1]
        flat = self.basis[:n_modes].reshape(n_modes, -1)
        offsets = parameters.astype(np.float32) @ flat
        return self.mean + offsets.reshape(len(parameters), *self.mean.shape)

    def parameters(self, shapes: NDArray[np.floating]) -> NDArray[np.float32]:
        """Parameters (T, M) of landmarks (T, L, 3), mm."""
        offsets = (shapes - self.mean).astype(np.float32).reshape(len(shapes), self.mean.size)
        return offsets @ self.basis.reshape(len(self.basis), -1).T


@dataclass(frozen=True, slots=True, eq=False)
class Utterance:
    """Recorded utterance of a talker.

    ``shape`` (T, M) are shape parameters, ``head`` (T, 6) the head pose (`HEAD_CHANNELS`, relative to the talker's
    mean pose), ``intensity`` (T,) the sound level in dB; frame i is at ``i / fps`` seconds on the clock of ``phones``.
    ``appearance_parameters`` (T, A) are texture parameters, None without an appearance model.
    """

    name: str
    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    shape: NDArray[np.float32]
    head: NDArray[np.float32]
    intensity: NDArray[np.float32]
    appearance_parameters: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (self.shape, self.head, self.intensity, self.appearance_parameters):
            if array is not None:
                array.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Talker:
    """Visual speech of one person: shape model, utterances, metadata and, with consent, an appearance model.

    ``metadata`` holds at least name, language, sources, licence, attribution, command and created. ``network`` predicts
    speech parameters from phones, None if there was too little training data; ``audio_maps`` predict them from sound,
    by name, empty if the talker was built without sound; ``scores`` gives what the face tracker reads in the talker's
    mouth for speech parameters, None if unknown.
    """

    fps: float
    model: ShapeModel
    utterances: tuple[Utterance, ...]
    metadata: Mapping[str, Any]
    appearance: Appearance | None = None
    network: PhoneNetwork | None = None
    audio_maps: Mapping[str, AudioMap] = field(default_factory=dict)
    scores: ScoreMap | None = None

    def speech_trajectory(self, utterance: Utterance) -> Trajectory:
        """Speech parameters (T, S) of a recorded utterance."""
        n = self.model.n_speech
        return Trajectory(speech_channels(self.model), utterance.shape[:, :n], self.fps)


def speech_channels(model: ShapeModel) -> tuple[str, ...]:
    """Names (S,) of the shape parameters that speech moves."""
    return tuple(f"shape{i}" for i in range(model.n_speech))


def require_appearance(talker: Talker) -> Appearance:
    """Appearance model of a talker.

    Raises
    ------
    InputError
        The talker has no appearance model.
    """
    if talker.appearance is None:
        raise InputError(
            f"the talker {talker.metadata.get('name', '')} has motion only and no own face; build one with --appearance"
        )
    return talker.appearance


def write_talker(path: Path, talker: Talker) -> None:
    """Write a ``.talker`` file (docs/file-formats.md).

    Shape parameters are stored as 16-bit integers in steps of 1/2000 of their spread, finer than the tracker's noise.
    """
    utterances = talker.utterances
    inventory = sorted({phone for utterance in utterances for phone in utterance.phones.phones})
    numbers = {phone: number for number, phone in enumerate(inventory)}
    step = talker.model.spread / STEPS_PER_SPREAD
    shape = np.concatenate([utterance.shape for utterance in utterances]) / step
    arrays = {
        "mean": talker.model.mean,
        "basis": talker.model.basis,
        "spread": talker.model.spread,
        "rest": talker.model.rest,
        "shape": np.clip(np.rint(shape), -32768, 32767).astype(np.int16),
        "head": np.concatenate([utterance.head for utterance in utterances]).astype(np.float16),
        "intensity": np.concatenate([utterance.intensity for utterance in utterances]).astype(np.float16),
        "n_frames": np.array([len(utterance.shape) for utterance in utterances], np.int32),
        "phones": np.array([numbers[phone] for utterance in utterances for phone in utterance.phones.phones], np.int16),
        "n_phones": np.array([len(utterance.phones) for utterance in utterances], np.int32),
        "edges": np.concatenate([utterance.phones.edges for utterance in utterances]),
    }
    if talker.appearance is not None:
        parameters = [utterance.appearance_parameters for utterance in utterances]
        recorded = np.concatenate([values for values in parameters if values is not None])
        steps = recorded / (talker.appearance.spread / STEPS_PER_PARAMETER)
        arrays["looks"] = np.clip(np.rint(steps), -32768, 32767).astype(np.int16)
        arrays |= appearance_arrays(talker.appearance)
    if talker.network is not None:
        arrays |= network_arrays(talker.network)
    arrays |= audio_map_arrays(talker.audio_maps) | score_map_arrays(talker.scores)
    header = {
        **talker.metadata,
        "fps": talker.fps,
        "n_speech": talker.model.n_speech,
        "inventory": inventory,
        **({"network_inventory": talker.network.inventory} if talker.network is not None else {}),
        "head_channels": HEAD_CHANNELS,
        "utterances": [
            [utterance.name, [[word.text, word.first, word.last] for word in utterance.words]]
            for utterance in utterances
        ],
    }
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header)


def read_talker(path: Path) -> Talker:
    """Read a ``.talker`` file.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is damaged, of another kind or version, or invalid (`tts2face.models.talker_schema`).
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    check_talker(path, arrays, header)
    return _talker_from_arrays(arrays, header)


def load_talker(name: str) -> Talker:
    """A shipped talker by name, or one from a ``.talker`` file; errors as `find_file` and `read_talker`.

    All who load the same file share one talker; a file that has changed is read again.
    """
    path = find_file(name, KIND)
    return _TALKERS.get(file_state(path), lambda: read_talker(path))


_TALKERS: Shared[Talker] = Shared()


def _talker_from_arrays(arrays: dict[str, NDArray[Any]], header: dict[str, Any]) -> Talker:
    n_speech = int(header.pop("n_speech"))
    model = ShapeModel(arrays["mean"], arrays["basis"], arrays["spread"], n_speech, arrays["rest"])
    inventory, fps = header.pop("inventory"), float(header.pop("fps"))
    header.pop("head_channels")
    frames = np.concatenate([[0], np.cumsum(arrays["n_frames"])])
    phones = np.concatenate([[0], np.cumsum(arrays["n_phones"])])
    shape = arrays["shape"].astype(np.float32) * (model.spread / STEPS_PER_SPREAD)
    head, intensity = arrays["head"].astype(np.float32), arrays["intensity"].astype(np.float32)
    appearance = appearance_from_arrays(arrays)
    network = network_from_arrays(arrays, header.pop("network_inventory", ()))
    recorded = arrays["looks"] * (appearance.spread / STEPS_PER_PARAMETER) if appearance is not None else None
    utterances = []
    for i, (name, words) in enumerate(header.pop("utterances")):
        labels = [inventory[number] for number in arrays["phones"][phones[i] : phones[i + 1]]]
        sequence = PhoneSequence(labels, arrays["edges"][phones[i] + i : phones[i + 1] + i + 1])
        spans = tuple(WordSpan(text, first, last) for text, first, last in words)
        span = slice(frames[i], frames[i + 1])
        appearance_parameters = None if recorded is None else recorded[span]
        utterances.append(
            Utterance(name, sequence, spans, shape[span], head[span], intensity[span], appearance_parameters)
        )
    maps = audio_maps_from_arrays(arrays, fps)
    scores = score_map_from_arrays(arrays, speech_channels(model))
    return Talker(fps, model, tuple(utterances), header, appearance, network, maps, scores)
