"""Lip tracks as observations: landmarks of another face that show the recorded lip features, for measuring only.

A track holds 68 points in pixels, from which no face in millimetres follows. Its z-scored lip features are given to a
talker instead: of all landmarks of the talker's shape model with these features, the most probable ones under the
Gaussian of the talker's speech. Opening and width are those of the track; the remaining shape is the talker's.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.person_tracks import TRACKED
from corpus_tools.training.adapt_talker import separate_lips
from corpus_tools.training.pooling.speech import PooledSpeech, talker_features
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.motion_measures import speech_frames
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import FloatArray

MIN_PART_S = 3.0  # tracks are cut at the first pause after as much: about a sentence
MIN_PAUSE_S = 0.12  # shorter silences may be closures
OPENING = 0  # of `lip_features.FEATURES`
CLOSED_SHARE = 0.02  # of the frames whose lips touch: points of dlib do not tell when they do
NOISE = 0.05  # deviation of a feature, in units of its spread, that the map need not reproduce


@dataclass(frozen=True, slots=True, eq=False)
class FeatureMap:
    """Speech parameters (D,) = offset + matrix (D, 8) @ z-scored lip features."""

    matrix: FloatArray
    offset: FloatArray

    @classmethod
    def of(cls, talker: Talker) -> "FeatureMap":
        """Conditional mean of a talker's parameters given its lip features, both in its recorded speech."""
        n_speech = talker.model.n_speech
        features, parameters = [], []
        for at, utterance in enumerate(talker.utterances):
            here = speech_frames(utterance.phones, len(utterance.shape), talker.fps)
            features.append(talker_features(talker, at)[here])
            parameters.append(utterance.shape[here, :n_speech].astype(np.float64))
        seen, wanted = np.concatenate(features), np.concatenate(parameters)
        # a feature that never changes has no spread to divide by
        scored = (seen - seen.mean(axis=0)) / np.maximum(seen.std(axis=0), 1e-9)
        centred = wanted - wanted.mean(axis=0)
        # Features are nearly linear in the parameters: the slopes of that regression give the features back exactly,
        # where a regression of the parameters on the features would reduce the motion.
        slopes = np.linalg.lstsq(centred, scored, rcond=None)[0]
        covariance = centred.T @ centred / len(centred)
        explained = slopes.T @ covariance @ slopes + NOISE**2 * np.eye(scored.shape[1])
        return cls(covariance @ slopes @ np.linalg.inv(explained), wanted.mean(axis=0))

    def parameters(self, features: FloatArray) -> FloatArray:
        """(T, D) of features (T, 8)."""
        return np.asarray(self.offset + features @ self.matrix.T)


def lip_observations(pooled: Sequence[PooledSpeech], talker: Talker) -> tuple[Observation, ...]:
    """Aligned lip tracks, cut at pauses, as observations on the face of a talker.

    The opening is moved so that the lips touch in a small share of frames; curves that are z-scored do not change.
    """
    feature_map, model = FeatureMap.of(talker), talker.model
    opening = np.concatenate([each_track.features[each_track.is_used, OPENING] for each_track in pooled])
    gap = _touching_opening(feature_map, talker) - np.quantile(opening, CLOSED_SHARE)
    found = []
    for track in pooled:
        raised = track.features.copy()
        raised[:, OPENING] += max(gap, 0.0)
        landmarks = model.shapes(separate_lips(feature_map.parameters(raised), model))
        for number, (start, end) in enumerate(_parts(track.phones, track.fps, len(landmarks)), start=1):
            found.append(_part(track, landmarks, number, start, end))
    return tuple(found)


def _touching_opening(feature_map: FeatureMap, talker: Talker) -> float:
    """z-scored opening at which the talker's lips touch, at the median of its other features."""
    # standard deviations, in steps of .05
    steps = np.linspace(-6.0, 6.0, 241)
    features = np.zeros((len(steps), feature_map.matrix.shape[1]))
    features[:, OPENING] = steps
    landmarks = talker.model.shapes(feature_map.parameters(features))
    gaps = landmarks[:, 13, 1] - landmarks[:, 14, 1]
    return float(np.interp(0.0, gaps, steps))


def _parts(phones: PhoneSequence, fps: float, n_frames: int) -> Iterator[tuple[int, int]]:
    """First frame and end of each part, cut in the middle of pauses; all parts hold speech."""
    first_frame = 0
    for label, start, end in zip(phones.phones, phones.edges, phones.edges[1:], strict=False):
        middle = round((start + end) / 2 * fps)
        if label == SILENCE and end - start >= MIN_PAUSE_S and (middle - first_frame) / fps >= MIN_PART_S:
            yield first_frame, middle
            first_frame = middle
    last = min(n_frames, int(phones.edges[-1] * fps))
    if (last - first_frame) / fps >= MIN_PART_S:
        yield first_frame, last


def _part(track: PooledSpeech, landmarks: NDArray[np.float32], number: int, first_frame: int, end: int) -> Observation:
    start, stop, edges = first_frame / track.fps, end / track.fps, track.phones.edges
    inside = [at for at in range(len(track.phones)) if edges[at + 1] > start and edges[at] < stop]
    times = np.concatenate([[start], edges[[at + 1 for at in inside[:-1]]], [stop]]) - start
    phones = PhoneSequence([track.phones.phones[at] for at in inside], times)
    # lip tracks hold neither the pose nor the loudness
    head = np.zeros((end - first_frame, 6), np.float32)
    name = f"{track.name}-{number:03d}"
    return Observation(
        name, track.fps, landmarks[first_frame:end], head, phones, (), head[:, 0], TRACKED, Path(f"{track.name}.npz")
    )
