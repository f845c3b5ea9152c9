"""Lip features that two landmark schemes share: 478 landmarks in mm, and the 68 of dlib in pixels.

Distances are divided by that of the outer eye corners; y points down.
"""

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.ridge import fit_ridge
from tts2face.models.landmarks import CHIN, EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.models.talker import ShapeModel
from tts2face.numeric.arrays import FloatArray

FEATURES = (
    "opening", "width", "lip height", "chin", "upper lip", "lower lip", "inner width", "corner height",
)  # fmt: skip
LANDMARKS = (0, 13, 14, 17, 61, 78, 82, 87, 291, 308, 312, 317, CHIN)  # that `landmark_features` reads
DRIFT_S = 8.0  # slower changes are posture and camera, not speech
DRIFT_SIGMA = 0.4  # standard deviation of the Gaussian of the drift, of `DRIFT_S`
EYE_SIGMA_S = 0.4  # smoothing of the eye distance: dlib's landmarks jitter by 1.3 px
ROLL_SIGMA_S = 0.04  # of the roll of the head
POSE_SIGMA_S = 0.12  # of the terms of the head pose
JITTER_SIGMA_S = 0.024  # of the features, against the same jitter; lips move below 8 Hz in these recordings


def landmark_features(landmarks: NDArray[np.floating], neutral: NDArray[np.floating]) -> FloatArray:
    """(T, 8) `FEATURES` of pose-free landmarks (T, 478, 3); heights are relative to the head, not to the nose.

    ``neutral`` (478, 3) gives the distance of the eyes.
    """
    eyes = float(np.sqrt(np.square(neutral[EYE_OUTER_RIGHT] - neutral[EYE_OUTER_LEFT], dtype=np.float64).sum()))
    y = -landmarks[..., 1].astype(np.float64) / eyes

    def distance(first: int, other: int) -> FloatArray:
        return np.asarray(np.linalg.norm(landmarks[:, first] - landmarks[:, other], axis=1) / eyes, np.float64)

    opening = (y[:, 14] - y[:, 13] + y[:, 87] - y[:, 82] + y[:, 317] - y[:, 312]) / 3
    corners = (y[:, 61] + y[:, 291]) / 2
    columns = (
        opening, distance(61, 291), y[:, 17] - y[:, 0], y[:, CHIN], y[:, 0], y[:, 17], distance(78, 308), corners,
    )  # fmt: skip
    return np.stack(columns, axis=1)


def parameter_features(parameters: NDArray[np.floating], model: ShapeModel) -> FloatArray:
    """(T, 8) `FEATURES` of shape parameters (T, m) of the first m modes of a model.

    Summed mode by mode instead of with BLAS, so that networks learnt from them have the same bytes with any number of
    threads.
    """
    seen = list(LANDMARKS)
    points = np.zeros((len(parameters), *model.mean.shape))
    points[:, seen] = model.mean[seen]
    for values, mode in zip(parameters.T.astype(np.float64), model.basis, strict=False):
        points[:, seen] += values[:, None, None] * mode[seen]
    return landmark_features(points, model.mean)


def track_features(points: NDArray[np.floating], fps: float) -> FloatArray:
    """(T, 8) `FEATURES` of dlib's points (T, 68, 2) without roll, head pose, jitter and slow drift; means are about 0.

    Head pose is removed by a regression on the positions of nose, cheeks and eyes, which speech hardly moves.
    """
    placed, eyes = _upright_points(points.astype(np.float64), fps)
    nose, chin = placed[:, 33], placed[:, 7:10].mean(axis=1)
    opening = sum((placed[:, low] - placed[:, up])[:, 1] for up, low in ((61, 67), (62, 66), (63, 65))) / 3
    upper, lower = (placed[:, 51] - nose)[:, 1], (placed[:, 57] - nose)[:, 1]
    corners = ((placed[:, 48] + placed[:, 54]) / 2 - nose)[:, 1]
    width, inner = (np.hypot(*(placed[:, item] - placed[:, other]).T) for item, other in ((54, 48), (64, 60)))
    chin_height = chin[:, 1] - placed[:, 27:31, 1].mean(axis=1)
    features = np.stack([opening, width, lower - upper, chin_height, upper, lower, inner, corners], axis=1)
    terms = _pose_terms(placed, eyes, fps)
    fit = fit_ridge(terms, features - features.mean(axis=0))
    steady = features - features.mean(axis=0) - (terms - fit.mean) @ fit.weights
    steady = _smooth(steady, JITTER_SIGMA_S * fps)
    return steady - _smooth(steady, DRIFT_SIGMA * DRIFT_S * fps)


def _upright_points(points: FloatArray, fps: float) -> tuple[FloatArray, FloatArray]:
    """(T, 68, 2) points about the eyes in units of their distance, eyes level; (T,) distances in pixels."""
    from scipy.ndimage import median_filter

    between = points[:, 45] - points[:, 36]
    eyes = _smooth(median_filter(np.hypot(*between.T), 5), EYE_SIGMA_S * fps)
    roll = _smooth(np.unwrap(np.arctan2(between[:, 1], between[:, 0])), ROLL_SIGMA_S * fps)
    cos, sin = np.cos(roll)[:, None], np.sin(roll)[:, None]
    x, y = np.moveaxis(points - ((points[:, 45] + points[:, 36]) / 2)[:, None], 2, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=2) / eyes[:, None, None], eyes


def _pose_terms(placed: FloatArray, eyes: FloatArray, fps: float) -> FloatArray:
    bridge = placed[:, 30] - placed[:, 27]
    cheeks = placed[:, 16, 0] + placed[:, 0, 0]
    terms = np.stack([*placed[:, 33].T, *bridge.T, cheeks, np.log(eyes)], axis=1)
    terms = _smooth(terms, POSE_SIGMA_S * fps)
    terms = (terms - terms.mean(axis=0)) / np.maximum(terms.std(axis=0), 1e-9)
    return np.concatenate([terms, terms**2, terms[:, :1] * terms[:, 1:2]], axis=1)


def _smooth(values: FloatArray, sigma: float) -> FloatArray:
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, sigma, axis=0))
