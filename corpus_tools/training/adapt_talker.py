"""A talker from little material: a base talker carried to the new person, with the person's own sentences."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.training.base_map import N_OFFSETS, BaseMap, FrameTerms, fit_base_map, frame_terms
from corpus_tools.training.train_talker import build_utterances, resting_parameters
from lexicon.phones import ARPABET
from lexicon.sequence import SILENCE
from tts2face.lips.cloning import face_size
from tts2face.lips.exemplar import DEFAULT_OPTIONS, ExemplarModel, build_exemplar_model, speech_trajectory
from tts2face.lips.lip_gaps import UNBOUNDED_MM, facing_gaps, nearest_valid_parameters
from tts2face.lips.retargeting import inner_product_map
from tts2face.models.audio_map import AudioMap
from tts2face.models.landmarks import (
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    MOUTH_REGION,
    N_LANDMARKS,
    UPPER_LIP_INNER_MID,
)
from tts2face.models.talker import ShapeModel, Talker, Utterance
from tts2face.numeric.arrays import FloatArray, fix_signs, interpolate_columns, principal_axes

PRIOR_FRAMES = 500.0  # of the base's motion that the shape model counts beside the person's own frames
NO_CHANGE = 1e12  # penalty with which the articulation of the base does not change
SPEECH_MARGIN_S = 0.2  # of silence around speech in the frames on which the map is fitted
REFERENCE_FPS = 25.0  # frame rate to which the penalty refers


@dataclass(frozen=True, slots=True)
class Adaptation:
    """How own material changes a base: arguments of `fit_base_map`; with a `NO_CHANGE` penalty only the mean pose.

    ``gain`` multiplies the motion of opening and width about the mean pose: predictions by regression are smaller than
    the motion, and people's lips move over other ranges.
    """

    trust: float
    penalty: float
    gain: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """A base talker, indexed for synthesis."""

    talker: Talker
    exemplars: ExemplarModel

    @classmethod
    def of(cls, talker: Talker) -> "Base":
        """Index a talker."""
        return cls(talker, build_exemplar_model(talker))


def adapted_talker(
    base: Base, observations: Sequence[Observation], adaptation: Adaptation, metadata: Mapping[str, Any]
) -> Talker:
    """The talker of the observed person with the base's utterances, networks and audio maps carried to it.

    Own utterances come first; those of the base follow, resampled to the frame rate of the recordings.
    """
    model = combined_shapes(base.talker.model, observations)
    own = build_utterances(observations, model)
    mapped = _default_base_map(base, observations, model, adaptation)
    fps = observations[0].fps
    carried = tuple(
        _carry_utterance(utterance, base.talker, model, mapped, fps) for utterance in base.talker.utterances
    )
    network = base.talker.network
    return Talker(
        fps,
        model,
        own + carried,
        dict(metadata),
        network=None if network is None else mapped.network(network),
        audio_maps={name: mapped.audio_map(audio_map) for name, audio_map in base.talker.audio_maps.items()},
    )


def carried_audio_maps(
    base: Base, observations: Sequence[Observation], model: ShapeModel, adaptation: Adaptation
) -> dict[str, AudioMap]:
    """Audio maps of a base by name, carried to the speech parameters of a person's shape model."""
    mapped = _default_base_map(base, observations, model, adaptation)
    return {name: mapped.audio_map(audio_map) for name, audio_map in base.talker.audio_maps.items()}


def _default_base_map(
    base: Base, observations: Sequence[Observation], model: ShapeModel, adaptation: Adaptation
) -> BaseMap:
    """`learn_base_map` for the default synthesis."""
    lips = {observation.name: base_lips(base, observation) for observation in observations}
    return learn_base_map(base, observations, model, adaptation, lips, amplitude=DEFAULT_OPTIONS.amplitude)


def learn_base_map(
    base: Base,
    observations: Sequence[Observation],
    model: ShapeModel,
    adaptation: Adaptation,
    lips: Mapping[str, NDArray[np.float32]],
    *,
    amplitude: float = 1.0,
) -> BaseMap:
    """Map from the base's speech parameters to those of the person.

    Parameters
    ----------
    lips
        What the base synthesises for each utterance, by name, as `base_lips` returns it.
    amplitude
        By which motion is multiplied after the map.
    """
    inventory = map_inventory(base, observations)
    prior = _prior_map(base.talker.model, model, inventory)
    terms, targets = zip(
        *(_own_frames(observation, lips[observation.name], model, inventory) for observation in observations),
        strict=True,
    )
    together = FrameTerms.joined(terms)
    scales = tuple(
        np.maximum(part.spread[: part.n_speech].astype(np.float64), 1e-6) for part in (base.talker.model, model)
    )
    penalty = adaptation.penalty * observations[0].fps / REFERENCE_FPS
    own = np.concatenate(targets)
    mapped = fit_base_map(together, own, prior, (scales[0], scales[1]), trust=adaptation.trust, penalty=penalty)
    return mapped.amplified(lip_gain(model, adaptation.gain), own.mean(axis=0)).before_amplification(
        amplitude, together
    )


def lip_gain(model: ShapeModel, gain: tuple[float, float]) -> FloatArray:
    """(D, D) matrix by which opening and width in speech parameters are multiplied, by the least motion.

    Motion is measured in units of its spread; what changes neither of the two remains.
    """
    n_speech = model.n_speech
    basis, variance = model.basis[:n_speech].astype(np.float64), model.spread[:n_speech].astype(np.float64) ** 2
    opening = basis[:, UPPER_LIP_INNER_MID, 1] - basis[:, LOWER_LIP_INNER_MID, 1]
    width = basis[:, MOUTH_CORNER_LEFT, 0] - basis[:, MOUTH_CORNER_RIGHT, 0]
    shown = np.stack([opening, width])
    change = np.linalg.pinv((variance * shown) @ shown.T) @ (variance * shown)
    return np.asarray(np.eye(n_speech) + change.T @ ((np.array(gain)[:, None] - 1.0) * shown))


def map_inventory(base: Base, observations: Sequence[Observation]) -> tuple[str, ...]:
    """Phones of a map: those of English, of the base and of the recordings."""
    spoken = {label for observation in observations for label in observation.phones.phones}
    # sorted: sets have another order in each process
    return tuple(sorted({*ARPABET.values(), SILENCE, *base.exemplars.tokens.inventory, *spoken}))


def base_lips(base: Base, observation: Observation) -> NDArray[np.float32]:
    """Speech parameters (T, B) that the base synthesises for an utterance."""
    n_frames = len(observation.landmarks)
    return speech_trajectory(observation.phones, base.exemplars, fps=observation.fps, n_frames=n_frames).values


def _own_frames(
    observation: Observation, lips: NDArray[np.float32], model: ShapeModel, inventory: tuple[str, ...]
) -> tuple[FrameTerms, FloatArray]:
    """Frames of an utterance around its speech: what the base does, and the person's speech parameters."""
    phones = observation.phones
    times = np.arange(len(observation.landmarks)) / observation.fps
    sounding = [at for at, label in enumerate(phones.phones) if label != SILENCE]
    start, end = phones.edges[sounding[0]], phones.edges[sounding[-1] + 1]
    near = (times >= start - SPEECH_MARGIN_S) & (times <= end + SPEECH_MARGIN_S)
    own = model.parameters(observation.landmarks[near])[:, : model.n_speech].astype(np.float64)
    return frame_terms(phones, times[near], inventory, lips[near]), own


def combined_shapes(base: ShapeModel, observations: Sequence[Observation]) -> ShapeModel:
    """Shape model of the person's frames and of `PRIOR_FRAMES` frames of the base's motion at the person's size.

    Principal components of both together, as many as the base has, about the person's mean shape.
    """
    frames = np.concatenate([observation.landmarks for observation in observations]).astype(np.float64)
    mean = frames.mean(axis=0)
    plain = replace(base, mean=mean.astype(np.float32))
    size = face_size(plain) / face_size(base)
    mouth = np.isin(np.arange(N_LANDMARKS), MOUTH_REGION)
    rows, variances = [], []
    for region, modes in ((mouth, slice(base.n_speech)), (~mouth, slice(base.n_speech, None))):
        own = (frames - mean)[:, region].reshape(len(frames), -1)
        prior = size * base.spread[modes, None] * base.basis[modes][:, region].reshape(len(base.basis[modes]), -1)
        scatter = (own.T @ own + PRIOR_FRAMES * prior.T @ prior) / (len(frames) + PRIOR_FRAMES)
        variance, components = principal_axes(scatter, len(prior))
        basis = np.zeros((len(prior), N_LANDMARKS, 3))
        basis[:, region] = fix_signs(components).reshape(len(prior), -1, 3)
        rows.append(basis)
        variances.append(variance)
    spread = np.sqrt(np.concatenate(variances)).astype(np.float32)
    model = ShapeModel(
        mean.astype(np.float32), np.concatenate(rows).astype(np.float32), spread, base.n_speech, np.zeros_like(spread)
    )
    return replace(model, rest=resting_parameters(observations, model))


def _prior_map(base: ShapeModel, model: ShapeModel, inventory: tuple[str, ...]) -> BaseMap:
    """Displacements from rest by inner products of the bases, at the person's size (T07, eq. 5)."""
    n_base, n_own = base.n_speech, model.n_speech
    flat = [part.basis[: part.n_speech].reshape(part.n_speech, -1).astype(np.float64) for part in (base, model)]
    matrix = face_size(model) / face_size(base) * inner_product_map(flat[0], flat[1])
    offset = model.rest[:n_own].astype(np.float64) - matrix @ base.rest[:n_base].astype(np.float64)
    return BaseMap(inventory, matrix, offset, np.zeros((N_OFFSETS, len(inventory), n_own)))


def _carry_utterance(utterance: Utterance, base: Talker, model: ShapeModel, mapped: BaseMap, fps: float) -> Utterance:
    """An utterance of the base as the person's; the rest of the face is at rest."""
    before = np.arange(len(utterance.shape)) / base.fps
    times = np.arange(int(before[-1] * fps) + 1) / fps
    read = interpolate_columns(utterance.shape[:, : base.model.n_speech], before, times)
    speech = separate_lips(mapped.parameters(frame_terms(utterance.phones, times, mapped.inventory, read)), model)
    shape = np.repeat(model.rest[None].astype(np.float64), len(times), axis=0)
    shape[:, : model.n_speech] = speech
    head = interpolate_columns(utterance.head, before, times)
    # shifts of the head are in mm, of another head
    head[:, 3:] *= face_size(model) / face_size(base.model)
    intensity = np.interp(times, before, utterance.intensity)
    return Utterance(
        utterance.name,
        utterance.phones,
        utterance.words,
        shape.astype(np.float32),
        head.astype(np.float32),
        intensity.astype(np.float32),
    )


def separate_lips(parameters: FloatArray, model: ShapeModel) -> FloatArray:
    """Speech parameters (T, D); frames in which the lips would cross are replaced by the nearest without."""
    gaps = facing_gaps(model)
    n_speech = model.n_speech
    constant = gaps[:, -1] + gaps[:, n_speech:-1] @ model.rest[n_speech:].astype(np.float64)
    gaps = np.column_stack([gaps[:, :n_speech], constant])
    crossed = (parameters @ gaps[:, :-1].T + gaps[:, -1] < 0.0).any(axis=1)
    if not crossed.any():
        return parameters
    free = np.full(n_speech, UNBOUNDED_MM)
    separated = parameters.copy()
    any_gap = np.full((int(crossed.sum()), len(gaps)), UNBOUNDED_MM)
    separated[crossed] = nearest_valid_parameters(parameters[crossed], free, gaps, any_gap)
    return separated
