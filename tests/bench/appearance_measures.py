"""Accuracy of appearance models on held-out recordings."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.appearance.frame import MOUTH_LANDMARKS
from corpus_tools.appearance.pca import IncrementalPca
from corpus_tools.appearance.procrustes import align_shapes, apply_similarities, fit_similarities
from corpus_tools.appearance.train import LearnedAppearance
from corpus_tools.appearance.videos import AppearanceRecording
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.sync import estimate_sync_by_video
from corpus_tools.training.train_talker import CLOSED_GAP
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LOWER_LIP_INNER_MID,
    N_MESH_LANDMARKS,
    UPPER_LIP_INNER_MID,
)

N_SHAPE_MODES = 20
N_SAMPLED_TEXTURES = 1000  # frames from which the number of texture modes is read
BILABIALS = frozenset({"p", "b", "m"})
CLOSURE_MARGIN_S = 0.03  # either side of a phone in which its closure may lie
INNER_LIPS = (*INNER_LIP_UPPER, *INNER_LIP_LOWER)


@dataclass(frozen=True, slots=True)
class AppearanceMeasures:
    """Figures of shape and texture; pixels are those of the video, ``held_out`` was not used for training.

    ``shape_modes``, ``texture_modes`` and ``mouth_modes`` explain 95 and 99 % of the variance (0: more than were kept).
    ``lag_ms`` is by how much the sound follows the lips that a shipped talker has for its phones.
    """

    shape_modes: tuple[int, int]
    texture_modes: tuple[int, int]
    mouth_modes: tuple[int, int]
    held_out_shape_px: float
    held_out_lips_px: float
    held_out_gap_px: float
    held_out_texture_db: float
    held_out_mouth_db: float
    closed: float
    lag_ms: float

    def as_dict(self) -> dict[str, object]:
        """The figures by name, for JSON."""
        return asdict(self)


def measure_appearance(
    learnt_from: Sequence[AppearanceRecording],
    learnt: LearnedAppearance,
    held_out: Sequence[AppearanceRecording],
    observations: Sequence[Observation],
) -> AppearanceMeasures:
    """Accuracy of a model on held-out recordings; closures and lag of all `observations`."""
    components, mean = shape_components(learnt_from)
    shape, lips, gap = shape_errors(held_out, components, mean)
    texture, mouth = texture_quality(held_out, learnt)
    return AppearanceMeasures(
        shape_modes=n_modes_for_variance(components.explained_variance()),
        texture_modes=n_modes_for_variance(texture_variance(learnt_from, learnt)),
        mouth_modes=n_modes_for_variance(learnt.explained_variance[1]),
        held_out_shape_px=shape,
        held_out_lips_px=lips,
        held_out_gap_px=gap,
        held_out_texture_db=texture,
        held_out_mouth_db=mouth,
        closed=bilabial_closure_share(observations),
        lag_ms=sound_lag_ms(observations),
    )


def shape_components(recordings: Sequence[AppearanceRecording]) -> tuple[IncrementalPca, NDArray[np.float64]]:
    """Components of the aligned shapes (eq. 1), and the mean shape (468, 2) that they are aligned with."""
    shapes, mean = align_shapes(np.concatenate([recording.points[:, :N_MESH_LANDMARKS] for recording in recordings]))
    grown = IncrementalPca(60)
    for block in np.array_split(shapes.reshape(len(shapes), -1), max(1, len(shapes) // 500)):
        grown.add(block)
    return grown, mean


def shape_errors(
    recordings: Sequence[AppearanceRecording], components: IncrementalPca, mean: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Mean distance in pixels of all landmarks, of the inner lips, and mean error of the inner gap, with 20 modes."""
    everywhere, lips, gaps = [], [], []
    basis = components.basis[:N_SHAPE_MODES].astype(np.float64)
    for recording in recordings:
        points = recording.points[:, :N_MESH_LANDMARKS].astype(np.float64)
        turns, shifts = fit_similarities(points, mean)
        flat = apply_similarities(points, turns, shifts).reshape(len(points), -1) - components.mean
        modelled = ((flat @ basis.T) @ basis + components.mean).reshape(points.shape)
        back = (modelled - shifts[:, None]) @ np.array([1.0, 1j]) / turns[:, None]
        seen = np.stack([back.real, back.imag], axis=-1)
        away = np.linalg.norm(seen - points, axis=2)
        everywhere.append(away.mean())
        lips.append(away[:, list(INNER_LIPS)].mean())
        gaps.append(np.abs(_inner_lip_gaps(seen) - _inner_lip_gaps(points)).mean())
    return float(np.mean(everywhere)), float(np.mean(lips)), float(np.mean(gaps))


def texture_variance(recordings: Sequence[AppearanceRecording], learnt: LearnedAppearance) -> NDArray[np.float64]:
    """Share of the face texture's variance in the first 1, 2, ... components of a sample of frames."""
    frame, light_of = learnt.frames[0], learnt.lights.of
    n_frames = sum(len(recording.points) for recording in recordings)
    every, rows = max(1, n_frames // N_SAMPLED_TEXTURES), []
    for recording in recordings:
        light = light_of(recording)
        for number, picture in enumerate(recording.pictures()):
            if number % every == 0:
                rows.append(light.apply(frame.texture(picture, recording.points[number])).ravel())
    centred = np.array(rows) - np.mean(rows, axis=0)
    variances = np.linalg.eigvalsh((centred @ centred.T).astype(np.float64))[::-1]
    shares: NDArray[np.float64] = np.cumsum(variances) / variances.sum()
    return shares


def texture_quality(recordings: Sequence[AppearanceRecording], learnt: LearnedAppearance) -> tuple[float, float]:
    """Peak signal-to-noise ratio in dB of the face's and of the inner mouth's texture through their models."""
    (face, mouth), appearance = learnt.frames, learnt.appearance
    face_errors, mouth_errors = [], []
    for recording in recordings:
        light = learnt.lights.of(recording)
        gaps = _inner_lip_gaps(recording.points)
        for number, picture in enumerate(recording.pictures()):
            points = recording.points[number]
            seen = light.apply(face.texture(picture, points))[None]
            face_errors.append(_mean_square(seen, appearance.face.textures(appearance.face.parameters(seen))))
            if gaps[number] >= np.median(gaps):
                seen = light.apply(mouth.texture(picture, points[list(MOUTH_LANDMARKS)]))[None]
                mouth_errors.append(_mean_square(seen, appearance.mouth.textures(appearance.mouth.parameters(seen))))
    return _peak_snr_db(face_errors), _peak_snr_db(mouth_errors)


def bilabial_closure_share(observations: Sequence[Observation]) -> float:
    """Share of /p b m/ during which, extended by `CLOSURE_MARGIN_S` on both sides, the inner lips close."""
    least = []
    for seen in observations:
        gap = np.linalg.norm(seen.landmarks[:, UPPER_LIP_INNER_MID] - seen.landmarks[:, LOWER_LIP_INNER_MID], axis=1)
        relative = gap / np.linalg.norm(seen.landmarks[:, 33] - seen.landmarks[:, 263], axis=1)
        times = np.arange(len(gap)) / seen.fps
        for phone, start, end in zip(seen.phones.phones, seen.phones.edges, seen.phones.edges[1:], strict=False):
            here = (times >= start - CLOSURE_MARGIN_S) & (times <= end + CLOSURE_MARGIN_S)
            if phone in BILABIALS and here.any():
                least.append(relative[here].min())
    return float(np.mean(np.array(least) < CLOSED_GAP)) if least else float("nan")


def sound_lag_ms(observations: Sequence[Observation]) -> float:
    """Mean lag of the sound of the videos, by their seconds."""
    found = list(estimate_sync_by_video(observations).values())
    seconds = [video.seconds for video in found]
    return float(1000 * np.average([video.lag for video in found], weights=seconds)) if sum(seconds) else float("nan")


def n_modes_for_variance(explained: NDArray[np.float64]) -> tuple[int, int]:
    """Numbers of modes for 95 and 99 % of the variance; 0 if the kept modes have less."""
    needed = [int(np.searchsorted(explained, share)) + 1 for share in (0.95, 0.99)]
    reached = [count if count <= len(explained) else 0 for count in needed]
    return reached[0], reached[1]


def _inner_lip_gaps(points: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(points[:, UPPER_LIP_INNER_MID] - points[:, LOWER_LIP_INNER_MID], axis=1))


def _mean_square(seen: NDArray[np.floating], modelled: NDArray[np.floating]) -> float:
    return float(np.square(seen - modelled).mean())


def _peak_snr_db(errors: Sequence[float]) -> float:
    return float(10 * np.log10(255.0**2 / np.mean(errors)))
