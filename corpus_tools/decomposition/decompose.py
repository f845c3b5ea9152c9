"""Decomposition of a recorded face (Ju and Lee 2008, section 4): F = R (N + sum c_i B_i + P + sum D_j) + T.

N is the face at rest, B_i are basis expressions, c_i their slow weights, P the motion of the lips, D_j the independent
motion of the other regions, R and T the head's pose. Lids and gaze are computed from the residual at the eyes.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.basis import ExpressionBasis
from corpus_tools.decomposition.blend_weights import Estimator, moving_average
from corpus_tools.decomposition.capture import FaceRecording, resample_to_gesture_rate
from corpus_tools.decomposition.regions import feature_landmarks
from tts2face.gestures.prosody import SILENT_PROSODY, prosody_features, speech_intensity
from tts2face.models.landmarks import EYELID_LANDMARKS, MOUTH_REGION, N_LANDMARKS, eye_aperture
from tts2face.models.palette import (
    FEATURES,
    GESTURE_FPS,
    REGION_FEATURES,
)
from tts2face.numeric.arrays import Float32Array, Mask, interpolate_columns, true_runs

LEAST_PIECE_S = 1.0  # between gaps: fields compare 10 frames before and 6 after, .53 s together
TREMOR_SMOOTHING_S = 0.03  # standard deviation of the Gaussian that removes tracking noise from head, brows and cheeks
# Of tracked lids that touch; first percentile of 40 minutes of one person (docs/gestures.md).
CLOSED_LID_APERTURE = 0.055
# centres of the irises in MediaPipe's mesh
IRIS_LANDMARKS = {"Left": 473, "Right": 468}
# Motion of a tracked iris in eye widths per radian of gaze, down and to the left; measured on one person who turns the
# head with the gaze on the camera (docs/gestures.md).
IRIS_SHIFT_PER_RAD = (-0.23, 0.33)
# Weight of lip landmarks in the estimation of expressions. At full weight the jaw motion of speech is estimated as
# surprise (mean weight 0.20 in neutral speech), and the error in the rest of the face is three times that of no
# expression; without lips, smiles are hard to detect (docs/gestures.md).
LIP_WEIGHT = 0.1
MAX_GAZE_LID_CLOSURE = 0.35  # beyond this closure the lid hides the iris


@dataclass(frozen=True, slots=True, eq=False)
class Decomposition:
    """Decomposition of one recording, at `GESTURE_FPS`.

    Parameters
    ----------
    motion
        (T, ...) of each observed feature: as `tts2face.models.palette.Style`, but "brows" and "cheeks" as
        displacements (T, L, 3) of their landmarks, mm.
    speech : (T, M, 3)
        P: displacement of `MOUTH_REGION`, mm.
    intensity, pitch : (T,)
    left_out : (T,)
        Frames from which nothing is learnt, as in `FaceRecording`.
    """

    name: str
    motion: dict[str, Float32Array]
    speech: Float32Array
    intensity: Float32Array
    pitch: Float32Array
    left_out: Mask | None = None

    def measured_pieces(self) -> list["Decomposition"]:
        """Pieces of at least `LEAST_PIECE_S` without frames that are left out."""
        if self.left_out is None or not self.left_out.any():
            return [self]
        return [
            replace(
                self,
                motion={name: values[start:end] for name, values in self.motion.items()},
                speech=self.speech[start:end],
                intensity=self.intensity[start:end],
                pitch=self.pitch[start:end],
                left_out=None,
            )
            for start, end in true_runs(~self.left_out).tolist()
            if end - start >= LEAST_PIECE_S * GESTURE_FPS
        ]


def decompose(captured: FaceRecording, basis: ExpressionBasis, estimator: Estimator) -> Decomposition:
    """Head pose, expression, independent motion, lids, gaze, speech and sound of a recording.

    Parameters
    ----------
    basis
        Of the person, in the size of the landmarks.
    estimator
        Of weights in displacements `weight_displacements`.
    """
    recorded = resample_to_gesture_rate(captured)
    moved = recorded.landmarks - basis.rest
    weights = estimator.weights(weight_displacements(moving_average(moved)))
    left = moved - np.tensordot(weights, basis.expressions, axes=1)
    if recorded.eyes is None:
        shut = lid_closure(basis.rest + left, basis.rest)
        turned = eye_angles(recorded.landmarks)
    else:
        shut, turned = recorded.eyes[:, :2], recorded.eyes[:, 2:].astype(np.float64)
    head = _smooth(recorded.head - np.median(recorded.head, axis=0))
    motion = {
        "expression": weights.astype(np.float32),
        **{name: _smooth(left[:, feature_landmarks(name)]) for name in REGION_FEATURES},
        "blink": shut,
        "gaze": gaze_angles(turned, recorded.head, shut),
        "head": head,
    }
    times = np.arange(len(moved)) / GESTURE_FPS
    prosody = np.tile(SILENT_PROSODY, (len(times), 1))
    if recorded.sound is not None:
        prosody = prosody_features(recorded.sound, times, speech_intensity(recorded.sound), with_pitch=True)
    return Decomposition(
        recorded.name,
        {name: motion[name] for name in FEATURES if name not in recorded.missing_features},
        left[:, list(MOUTH_REGION)].astype(np.float32),
        prosody[:, 0],
        prosody[:, 1],
        recorded.left_out,
    )


def weight_displacements(displacements: NDArray[np.floating]) -> NDArray[np.float64]:
    """Displacements (N, 478, 3) weighted for the estimation of expressions, with a low weight of the lips."""
    counts = np.ones((N_LANDMARKS, 1))
    counts[list(MOUTH_REGION)] = LIP_WEIGHT
    return np.asarray(displacements, np.float64) * counts


def lid_closure(landmarks: NDArray[np.floating], rest: NDArray[np.floating]) -> Float32Array:
    """(T, 2) closure of the left and the right lids in landmarks (T, 478, 3): 0 as at rest (478, 3), 1 fully closed."""
    columns = []
    for side in ("Left", "Right"):
        opened = float(eye_aperture(rest[None], side)[0])
        columns.append((opened - eye_aperture(landmarks, side)) / (opened - CLOSED_LID_APERTURE))
    return np.stack(columns, axis=1).astype(np.float32)


def eye_angles(landmarks: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T, 2) pitch and yaw of the eyes in the head, from the irises of tracked landmarks (T, 478, 3)."""
    turned = []
    for side, iris in IRIS_LANDMARKS.items():
        _, _, outer, inner = EYELID_LANDMARKS[side]
        corners = landmarks[:, [outer, inner]]
        width = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)
        offset = landmarks[:, iris] - corners.mean(axis=1)
        turned.append(np.stack([offset[:, 1], offset[:, 0]], axis=1) / width[:, None] / IRIS_SHIFT_PER_RAD)
    return np.asarray(np.mean(turned, axis=0), np.float64)


def gaze_angles(turned: NDArray[np.float64], head: NDArray[np.floating], shut: Float32Array) -> Float32Array:
    """(T, 2) gaze pitch and yaw relative to the recording's median, from the eyes' angles (T, 2) in the head.

    Frames in which lids hide the irises are interpolated linearly.
    """
    gaze = turned + head[:, :2]
    seen = np.flatnonzero(shut.max(axis=1) < MAX_GAZE_LID_CLOSURE)
    if len(seen):
        frames = np.arange(len(gaze))
        gaze = interpolate_columns(gaze[seen], seen, frames)
    centred: Float32Array = (gaze - np.median(gaze, axis=0)).astype(np.float32)
    return centred


def _smooth(values: NDArray[np.floating]) -> Float32Array:
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, TREMOR_SMOOTHING_S * GESTURE_FPS, axis=0), np.float32)
