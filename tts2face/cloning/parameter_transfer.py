"""Motion of one talker carried to another: the inner products of Theobald et al. 2007, eq. 5, within limits.

Talkers share their landmarks and axes (`tts2face.models.landmarks`), so that their shape vectors span parts of one
space once both faces have one size. Motion is counted from rest to rest: closed lips stay closed lips.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.cloning.lip_gaps import (
    MIN_LIP_GAP_MM,
    contact_mm,
    facing_gaps,
    gap_limits,
    nearest_valid_parameters,
    rest_with_open_lips,
)
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.talker import ShapeModel, Talker
from tts2face.numeric import ordered_product
from tts2face.retargeting.to_face import inner_product_map
from tts2face.types import Trajectory

FloatArray = NDArray[np.float64]

MAX_STANDARD_DEVIATIONS = (
    3.0  # a mapped parameter stays within so many standard deviations of the target's mean; T07, section 3.1
)
MIN_COMPONENT_MM = (
    0.5  # root of the sum over all landmarks; a component that moves less is not missed: 0.02 mm a landmark
)

MIN_REAL_MOTION_MM = 1e-4  # far above the rounding of a basis kept as float32, far below any measured motion
ROUNDING_TOLERANCE = 1e-12  # an entry of a unit vector below this is a rounding error of float64


@dataclass(frozen=True, slots=True, eq=False)
class ParameterTransfer:
    """The prepared way from a source talker's shape parameters to a target's.

    Parameters
    ----------
    relation : (q, r)
        R of T07, eq. 5, times `size` and the gain: the target's parameters per source parameter.
    size
        The target's face over the source's.
    source_rest, target_rest : (r,), (q,)
        Parameters at rest, the lips parted where they overlap.
    n_source, n_target
        Modes of either that speech moves.
    limits : (q,)
        Largest size of each mapped parameter.
    source_gaps, target_gaps : (P, r + 1), (P, q + 1)
        Gaps of facing inner lip points in the target's size, as `facing_gaps` gives them.
    resting_gaps : (P,)
        The target's gaps at rest.
    contact
        Gap up to which the source's lips touch, in the target's size.
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
        """Motion of the source as the target makes it: speech parameters become speech parameters, all become all.

        Raises
        ------
        InputError
            The channels are not the source's shape parameters.
        """
        width = len(motion.channels)
        if motion.channels != _channels(width) or width not in {self.n_source, len(self.source_rest)}:
            raise InputError(
                f"channels {motion.channels[:1]}... ({width}) are not the source's {self.n_source} speech parameters "
                f"or all {len(self.source_rest)} shape parameters; take a trajectory of the source talker"
            )
        kept = self.n_target if width == self.n_source else len(self.target_rest)
        return Trajectory(_channels(kept), self.parameters(motion.values)[:, :kept], motion.fps)

    def parameters(self, source: NDArray[np.floating]) -> NDArray[np.float32]:
        """(T, q) parameters of the target for (T, m) of the source's first m modes; the other modes are at rest.

        Each frame is the nearest to eq. 5 that keeps the limits, whose lips do not cross, and whose lips touch where
        the source's do; it does not depend on other frames.
        """
        wanted = self.clone_unlimited(source)
        limits = self.limits.astype(np.float64)
        held = np.clip(wanted, -limits, limits)
        most = gap_limits(self._scaled_source_gaps(source), self.contact, self.resting_gaps)
        gaps = ordered_product(held, self.target_gaps[:, :-1].T) + self.target_gaps[:, -1]
        wrong = np.flatnonzero(((gaps < MIN_LIP_GAP_MM) | (gaps > most)).any(axis=1))
        held[wrong] = nearest_valid_parameters(wanted[wrong], limits, self.target_gaps, most[wrong])
        return np.clip(held.astype(np.float32), -self.limits, self.limits)

    def clone_unlimited(self, source: NDArray[np.floating]) -> FloatArray:
        """(T, q) parameters by eq. 5 alone, for (T, m) of the source's first m modes."""
        n_modes = source.shape[1]
        moved = source.astype(np.float64) - self.source_rest[:n_modes]
        return self.target_rest + ordered_product(moved, self.relation[:, :n_modes].T)

    def _scaled_source_gaps(self, source: NDArray[np.floating]) -> FloatArray:
        """(T, P) gaps of the source in the target's size."""
        n_modes = source.shape[1]
        others = ordered_product(self.source_gaps[:, n_modes:-1], self.source_rest[n_modes:]) + self.source_gaps[:, -1]
        return ordered_product(source.astype(np.float64), self.source_gaps[:, :n_modes].T) + others


def build_parameter_transfer(source: ShapeModel, target: ShapeModel, *, gain: float = 1.0) -> ParameterTransfer:
    """Prepare the way from a source talker to a target.

    Parameters
    ----------
    gain
        Factor on the displacement from rest, before the limits: above 1 amplifies, below 1 attenuates.

    Raises
    ------
    InputError
        The gain is negative or not finite.
    DataError
        A model does not have the 478 landmarks, its rest lies beyond its limits, or its lips overlap everywhere.
    """
    if not (math.isfinite(gain) and gain >= 0.0):
        raise InputError(f"the gain must be 0 or more, not {gain}; 1 leaves the motion as large as it is")
    size = face_size(target) / face_size(source)
    rests, target_gaps = (_rest_of_model(source), _rest_of_model(target)), facing_gaps(target)
    relation = np.round(
        inner_product_map(_flat_basis(source), _flat_basis(target)), 9
    )  # last bits depend on the threads of BLAS
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
    """The target's model with the components that the source moves and the target cannot.

    Parameters
    ----------
    n
        How many, those that move most first; all that move more than `MIN_COMPONENT_MM` when None.

    Returns
    -------
    ShapeModel
        New modes of the mouth follow the target's mouth modes, the others come last; orthonormal as before. The
        target does not know how far to go along them: their spread is the source's about its rest, in the target's
        size; their rest is 0, so that the target rests as it did.

    Raises
    ------
    InputError
        The source has no such number of missing components.
    DataError
        A model does not have the 478 landmarks.

    Notes
    -----
    Principal components of what is lost, weighted with the source's spread. Source: T07, section 3.1, last paragraph.
    """
    size, own, speech = face_size(target) / face_size(source), _flat_basis(target), source.n_speech
    mouth, mouth_spread = _missing_components(source, slice(None, speech), own)
    other, other_spread = _missing_components(source, slice(speech, None), np.concatenate([own, mouth]))
    found = size * np.concatenate([mouth_spread, other_spread])
    if n is not None and not 0 <= n <= len(found):
        raise InputError(f"{len(found)} components of the source are missing in the target, not {n}; ask for fewer")
    n_added = int((found > MIN_COMPONENT_MM).sum()) if n is None else n
    chosen = np.sort(np.argsort(-found, kind="stable")[:n_added])
    of_mouth, others = chosen[chosen < len(mouth)], chosen[chosen >= len(mouth)]
    added = np.concatenate([mouth, other])

    def joined(own_part: NDArray[np.float32], new: FloatArray) -> NDArray[np.float32]:
        before, behind = own_part[: target.n_speech], own_part[target.n_speech :]
        return np.concatenate([before, new[of_mouth], behind, new[others]]).astype(np.float32)

    basis = joined(own.astype(np.float32), added).reshape(-1, *target.mean.shape)
    rest = joined(target.rest, np.zeros(len(found)))
    return ShapeModel(target.mean, basis, joined(target.spread, found), target.n_speech + len(of_mouth), rest)


def extend_talker(source: ShapeModel, target: Talker) -> Talker:
    """The target with the components that the source moves and it cannot; its own utterances and plate leave them at 0.

    Raises
    ------
    DataError
        A model does not have the 478 landmarks.
    """
    model, before = append_missing_components(source, target.model), target.model
    n_mouth = model.n_speech - before.n_speech
    n_other = len(model.spread) - len(before.spread) - n_mouth

    def widened(shape: NDArray[np.float32]) -> NDArray[np.float32]:
        mouth, other = (np.zeros((len(shape), n), np.float32) for n in (n_mouth, n_other))
        return np.concatenate([shape[:, : before.n_speech], mouth, shape[:, before.n_speech :], other], axis=1)

    utterances = tuple(replace(spoken, shape=widened(spoken.shape)) for spoken in target.utterances)
    appearance = target.appearance
    if appearance is not None:
        appearance = replace(appearance, plate=replace(appearance.plate, shape=widened(appearance.plate.shape)))
    return replace(target, model=model, utterances=utterances, appearance=appearance, network=None, audio_maps={})


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
    """(M,) largest numbers that are not above `MAX_STANDARD_DEVIATIONS` times the spread."""
    exact = MAX_STANDARD_DEVIATIONS * model.spread.astype(np.float64)
    rounded = exact.astype(np.float32)
    return np.where(rounded > exact, np.nextafter(rounded, np.float32(0)), rounded)


def _rest_of_model(model: ShapeModel) -> FloatArray:
    limits = parameter_limits(model)
    beyond = np.flatnonzero(np.abs(model.rest) > limits)
    if len(beyond):
        raise DataError(
            f"a talker rests beyond {MAX_STANDARD_DEVIATIONS:g} spreads in mode {beyond[0]}; build it again"
        )
    return rest_with_open_lips(model, limits)


def _channels(n_modes: int) -> tuple[str, ...]:
    return tuple(f"shape{i}" for i in range(n_modes))


def _flat_basis(model: ShapeModel) -> FloatArray:
    """(M, 3 L) basis vectors."""
    return model.basis.reshape(len(model.basis), -1).astype(np.float64)


def _missing_components(source: ShapeModel, block: slice, span: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k, 3 L) orthonormal components of some of the source's modes outside `span`, and how far it moves along them.

    The distances are root mean squares from the source's rest. The largest entry of each component is positive.
    """
    modes = _flat_basis(source)[block]
    for _ in range(2):  # once leaves rounding errors, twice is enough
        modes = modes - (modes @ span.T) @ span
    moved = np.concatenate([source.spread[block, None] * modes, source.rest[None, block] @ modes])
    _, distances, components = np.linalg.svd(moved, full_matrices=False)
    real = distances > MIN_REAL_MOTION_MM  # what is below consists of rounding errors, which may point into the span
    components, distances = components[real], distances[real]
    components = components - (components @ span.T) @ span
    components[np.abs(components) < ROUNDING_TOLERANCE] = (
        0.0  # mouth modes leave the rest of the face exactly where it is
    )
    largest = components[np.arange(len(components)), np.abs(components).argmax(axis=1)]
    signed: FloatArray = components * np.sign(largest)[:, None]
    return signed, distances
