"""Transfer of motion between talkers by inner products (Theobald et al. 2007, equation 5) within limits.

Talkers have the same landmarks and axes (`tts2face.models.landmarks`), so that their shape vectors lie in one space
once both faces are scaled to one size. Motion is measured from the rest of each talker, so that closed lips stay
closed.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.lips.lip_gaps import (
    MIN_LIP_GAP_MM,
    contact_mm,
    facing_gaps,
    gap_limits,
    nearest_valid_parameters,
    rest_with_open_lips,
)
from tts2face.lips.retargeting import inner_product_map
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.talker import ShapeModel, Talker
from tts2face.numeric.arrays import FloatArray, fix_signs, ordered_product
from tts2face.types import Trajectory

MAX_STANDARD_DEVIATIONS = 3.0  # limit of a mapped parameter about the target's mean; T07, section 3.1
# Of the rest. Talkers of eight sentences have few resting frames, and rest at up to 4.5 deviations of all their frames.
# beyond it the recordings did not begin with closed lips
MAX_REST_DEVIATIONS = 20.0
MIN_COMPONENT_MM = 0.5  # root of the sum of squares over all landmarks: about 0.02 mm per landmark
MIN_REAL_MOTION_MM = 1e-4  # above the rounding errors of a float32 basis, below any measured motion
ROUNDING_TOLERANCE = 1e-12  # smaller entries of a unit vector are float64 rounding errors


@dataclass(frozen=True, slots=True, eq=False)
class ParameterTransfer:
    """Mapping from a source talker's shape parameters to a target's; built by `build_parameter_transfer`.

    Parameters
    ----------
    relation : (q, r)
        R of T07, eq. 5, times `size` and the gain: target parameters per source parameter.
    size
        Ratio of face sizes, target to source.
    source_rest, target_rest : (r,), (q,)
        Parameters at rest, with overlapping lips separated.
    n_source, n_target
        Number of modes of each that speech moves.
    limits : (q,)
        Largest magnitude of each mapped parameter.
    source_gaps, target_gaps : (P, r + 1), (P, q + 1)
        Gaps of facing inner lip points at the target's scale, as `facing_gaps` returns them.
    resting_gaps : (P,)
        The target's gaps at rest, mm.
    contact
        Gap up to which the source's lips touch, in mm at the target's scale.
    """

    relation: FloatArray
    size: float
    source_rest: FloatArray
    target_rest: FloatArray
    n_source: int
    n_target: int
    limits: NDArray[np.float32]
    source_gaps: FloatArray
    target_gaps: FloatArray
    resting_gaps: FloatArray
    contact: float

    def clone(self, motion: Trajectory) -> Trajectory:
        """Motion of the source in the target's parameters: speech parameters map to speech parameters, all to all.

        Raises
        ------
        InputError
            The channels are neither the source's speech parameters nor all of its shape parameters.
        """
        width = len(motion.channels)
        if motion.channels != _channels(width) or width not in {self.n_source, len(self.source_rest)}:
            raise InputError(
                f"channels {motion.channels[:1]}... ({width}) are not the source's {self.n_source} speech parameters "
                f"or all {len(self.source_rest)} shape parameters; take a trajectory of the source talker"
            )
        n_channels = self.n_target if width == self.n_source else len(self.target_rest)
        return Trajectory(_channels(n_channels), self.parameters(motion.values)[:, :n_channels], motion.fps)

    def parameters(self, source: NDArray[np.floating]) -> NDArray[np.float32]:
        """Target parameters (T, q) for parameters (T, m) of the source's first m modes; other modes are at rest.

        Each frame is the nearest to eq. 5 within the limits whose lips do not cross and touch where the source's lips
        touch; frames are independent of each other.
        """
        unlimited = self.clone_unlimited(source)
        limits = self.limits.astype(np.float64)
        limited = np.clip(unlimited, -limits, limits)
        upper_gaps = gap_limits(self._scaled_source_gaps(source), self.contact, self.resting_gaps)
        gaps = ordered_product(limited, self.target_gaps[:, :-1].T) + self.target_gaps[:, -1]
        wrong = np.flatnonzero(((gaps < MIN_LIP_GAP_MM) | (gaps > upper_gaps)).any(axis=1))
        limited[wrong] = nearest_valid_parameters(unlimited[wrong], limits, self.target_gaps, upper_gaps[wrong])
        # again in single precision: rounding may pass a limit
        return np.clip(limited.astype(np.float32), -self.limits, self.limits)

    def clone_unlimited(self, source: NDArray[np.floating]) -> FloatArray:
        """Target parameters (T, q) by eq. 5 without limits, for (T, m) of the source's first m modes."""
        n_modes = source.shape[1]
        displacement = source.astype(np.float64) - self.source_rest[:n_modes]
        return self.target_rest + ordered_product(displacement, self.relation[:, :n_modes].T)

    def _scaled_source_gaps(self, source: NDArray[np.floating]) -> FloatArray:
        """Gaps (T, P) of the source at the target's scale, mm."""
        n_modes = source.shape[1]
        others = ordered_product(self.source_gaps[:, n_modes:-1], self.source_rest[n_modes:]) + self.source_gaps[:, -1]
        return ordered_product(source.astype(np.float64), self.source_gaps[:, :n_modes].T) + others


def build_parameter_transfer(source: ShapeModel, target: ShapeModel, *, gain: float = 1.0) -> ParameterTransfer:
    """Parameter transfer from a source talker to a target.

    Parameters
    ----------
    gain
        Factor on the displacement from rest, applied before the limits.

    Raises
    ------
    InputError
        The gain is negative or not finite.
    DataError
        A model does not have 478 landmarks, its rest is far from its mean, or its lips overlap at all parameters.
    """
    if not (math.isfinite(gain) and gain >= 0.0):
        raise InputError(f"the gain must be 0 or more, not {gain}; 1 keeps the size of the motion")
    size = face_size(target) / face_size(source)
    rests, target_gaps = (_rest_of_model(source), _rest_of_model(target)), facing_gaps(target)
    relation = np.round(
        inner_product_map(_flat_basis(source), _flat_basis(target)), 9
    )  # the last bits depend on the threads of BLAS
    return ParameterTransfer(
        relation=gain * size * relation,
        size=size,
        source_rest=rests[0],
        target_rest=rests[1],
        n_source=source.n_speech,
        n_target=target.n_speech,
        limits=parameter_limits(target),
        source_gaps=size * facing_gaps(source),
        target_gaps=target_gaps,
        resting_gaps=ordered_product(target_gaps[:, :-1], rests[1]) + target_gaps[:, -1],
        contact=size * contact_mm(source),
    )


def append_missing_components(source: ShapeModel, target: ShapeModel, n: int | None = None) -> ShapeModel:
    """Target model extended by the components of the source's motion outside its span.

    Parameters
    ----------
    n
        Number of components, in order of decreasing motion; all above `MIN_COMPONENT_MM` when None.

    Returns
    -------
    ShapeModel
        New mouth modes follow the target's mouth modes, other new modes come last; the basis stays orthonormal. The
        spread of new modes is the source's about its rest at the target's scale; their rest is 0, so that the rest of
        the target does not change.

    Notes
    -----
    Principal components of the residual motion, weighted with the source's spread. Source: T07, section 3.1, last
    paragraph.
    """
    size = face_size(target) / face_size(source)
    own = _flat_basis(target)
    speech = source.n_speech
    mouth, mouth_spread = _missing_components(source, slice(None, speech), own)
    other, other_spread = _missing_components(source, slice(speech, None), np.concatenate([own, mouth]))
    magnitudes = size * np.concatenate([mouth_spread, other_spread])
    if n is not None and not 0 <= n <= len(magnitudes):
        raise InputError(
            f"{len(magnitudes)} components of the source are missing in the target, not {n}; "
            f"choose 0 to {len(magnitudes)}"
        )
    n_added = int((magnitudes > MIN_COMPONENT_MM).sum()) if n is None else n
    # the largest, in the order that they have in the source
    chosen = np.sort(np.argsort(-magnitudes, kind="stable")[:n_added])
    of_mouth, others = chosen[chosen < len(mouth)], chosen[chosen >= len(mouth)]
    added = np.concatenate([mouth, other])

    def interleave(own_part: NDArray[np.float32], new: FloatArray) -> NDArray[np.float32]:
        before, behind = own_part[: target.n_speech], own_part[target.n_speech :]
        return np.concatenate([before, new[of_mouth], behind, new[others]]).astype(np.float32)

    basis = interleave(own.astype(np.float32), added).reshape(-1, *target.mean.shape)
    rest = interleave(target.rest, np.zeros(len(magnitudes)))
    return ShapeModel(target.mean, basis, interleave(target.spread, magnitudes), target.n_speech + len(of_mouth), rest)


def extend_talker(source: ShapeModel, target: Talker) -> Talker:
    """Target talker with the model of `append_missing_components`; its utterances and plate have 0 in new modes.

    Raises
    ------
    DataError
        A model does not have 478 landmarks.
    """
    model, before = append_missing_components(source, target.model), target.model
    n_mouth = model.n_speech - before.n_speech
    n_other = len(model.spread) - len(before.spread) - n_mouth

    def insert_zeros(shape: NDArray[np.float32]) -> NDArray[np.float32]:
        mouth, other = (np.zeros((len(shape), n), np.float32) for n in (n_mouth, n_other))
        return np.concatenate([shape[:, : before.n_speech], mouth, shape[:, before.n_speech :], other], axis=1)

    utterances = tuple(replace(utterance, shape=insert_zeros(utterance.shape)) for utterance in target.utterances)
    appearance = target.appearance
    if appearance is not None:
        appearance = replace(appearance, plate=replace(appearance.plate, shape=insert_zeros(appearance.plate.shape)))
    return replace(
        target, model=model, utterances=utterances, appearance=appearance, network=None, audio_maps={}, scores=None
    )


def face_size(model: ShapeModel) -> float:
    """Size of the mean shape: root mean square distance of the landmarks from their middle, mm.

    Raises
    ------
    DataError
        The model does not have the 478 landmarks.
    """
    if len(model.mean) != N_LANDMARKS:
        raise DataError(f"the shape model has {len(model.mean)} landmarks, not {N_LANDMARKS}; build the talker again")
    shape = model.mean.astype(np.float64)
    return float(np.sqrt(((shape - shape.mean(axis=0)) ** 2).sum(axis=1).mean()))


def parameter_limits(model: ShapeModel) -> NDArray[np.float32]:
    """Largest float32 values (M,) that do not exceed `MAX_STANDARD_DEVIATIONS` times the spread, or those at rest."""
    exact = MAX_STANDARD_DEVIATIONS * model.spread.astype(np.float64)
    rounded = exact.astype(np.float32)
    within = np.where(rounded > exact, np.nextafter(rounded, np.float32(0)), rounded)
    return np.maximum(within, np.abs(model.rest))


def _rest_of_model(model: ShapeModel) -> FloatArray:
    deviations = np.abs(model.rest) / np.maximum(model.spread, np.finfo(np.float32).tiny)
    furthest = int(deviations.argmax())
    if deviations[furthest] > MAX_REST_DEVIATIONS:
        raise DataError(
            f"the rest of a talker lies {deviations[furthest]:.3g} standard deviations from its mean "
            f"in mode {furthest}, limit {MAX_REST_DEVIATIONS:g}; build it from recordings that begin with closed lips"
        )
    return rest_with_open_lips(model, parameter_limits(model))


def _channels(n_modes: int) -> tuple[str, ...]:
    return tuple(f"shape{i}" for i in range(n_modes))


def _flat_basis(model: ShapeModel) -> FloatArray:
    """Basis vectors (M, 3 L)."""
    return model.basis.reshape(len(model.basis), -1).astype(np.float64)


def _missing_components(source: ShapeModel, block: slice, span: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Orthonormal components (k, 3 L) of a block of the source's modes outside `span`, and the motion along them (k,).

    The motion is the root mean square about the source's rest, mm. The largest entry of each component is positive.
    """
    modes = _flat_basis(source)[block]
    for _ in range(2):  # the second pass removes the rounding errors of the first
        modes = modes - (modes @ span.T) @ span
    displacement = np.concatenate([source.spread[block, None] * modes, source.rest[None, block] @ modes])
    _, distances, components = np.linalg.svd(displacement, full_matrices=False)
    real = distances > MIN_REAL_MOTION_MM  # smaller ones are rounding errors and may lie in the span
    components, distances = components[real], distances[real]
    components = components - (components @ span.T) @ span
    components[np.abs(components) < ROUNDING_TOLERANCE] = 0.0  # mouth modes are exactly 0 on the rest of the face
    return fix_signs(components), distances
