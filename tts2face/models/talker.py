"""Talker model, built from the recordings of one person."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.values.checks import whole
from tts2face.models.appearance import Appearance
from tts2face.models.audio_map import AudioMap
from tts2face.models.codec import InHeader, StoredModel
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.phone_network import PhoneNetwork
from tts2face.models.score_map import ScoreMap
from tts2face.numeric.arrays import make_read_only
from tts2face.storage.schema import MAX_MM, Contents, Tensor, millimetres
from tts2face.types import Trajectory

NOT_STATED = "not stated"  # by who made the model: its name, language, sources, licence


@dataclass(frozen=True, slots=True, eq=False)
class ShapeModel(StoredModel):
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

    mean: Annotated[NDArray[np.float32], millimetres(N_LANDMARKS, 3)]
    basis: Annotated[NDArray[np.float32], Tensor("float32", ("modes", N_LANDMARKS, 3), -1.01, 1.01)]
    spread: Annotated[NDArray[np.float32], Tensor("float32", ("modes",), 0.0, MAX_MM)]
    n_speech: Annotated[int, InHeader(whole(1, 10_000))]
    rest: Annotated[NDArray[np.float32], millimetres("modes")]

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree, then make them read-only."""
        modes, landmarks = self.basis.shape[:2]
        fits = self.mean.shape == (landmarks, 3) and self.basis.shape[2:] == (3,)
        if not fits or not self.spread.shape == self.rest.shape == (modes,) or not 0 < self.n_speech <= modes:
            raise DataError("the shape model's mean, basis, spread and rest do not fit each other; build it again")
        make_read_only(self)

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse a basis that is not orthonormal, and more modes of speech than there are."""
        contents.orthonormal("basis")
        n_speech, n_modes = contents.header["n_speech"], contents.sizes["modes"]
        contents.require(n_speech <= n_modes, f"n_speech is {n_speech}, but there are {n_modes} modes")

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
        make_read_only(self)


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
