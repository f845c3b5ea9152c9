"""Decomposition of a recorded face (Ju and Lee 2008, section 4): F = R (N + sum c_i B_i + P + sum D_j) + T.

N is the face at rest, B_i are basis expressions, c_i their slow weights, P the motion of the lips, D_j the independent
motion of the other regions, R and T the head's pose. Lids and gaze are computed from the residual at the eyes.

A gesture style built from decomposed recordings, and its insertion into a palette.

Derived styles without recordings: the table of changes of a measured style.
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.basis import ExpressionBasis
from corpus_tools.decomposition.blend_weights import Estimator, moving_average
from corpus_tools.decomposition.capture import FaceRecording, resample_to_gesture_rate
from lexicon.errors import DataError, InputError
from tts2face.face.deformation import axis_ratios
from tts2face.gestures.prosody import SILENT_PROSODY, prosody_features, speech_intensity
from tts2face.models.landmarks import EYELID_LANDMARKS, MOUTH_REGION, N_LANDMARKS, eye_aperture
from tts2face.models.palette import (
    FEATURES,
    FIXED_CHANNELS,
    GESTURE_FPS,
    PLAIN,
    REGION_FEATURES,
    Delivery,
    Derivation,
    FaceRegion,
    FeatureChange,
    Palette,
    Style,
)
from tts2face.numeric.arrays import fix_signs, interpolate_columns, principal_axes

TREMOR_SMOOTHING_S = 0.03  # standard deviation of the Gaussian that removes tracking noise from head, brows and cheeks
# Of tracked lids that touch; first percentile of 40 minutes of one person (docs/gestures.md).
CLOSED_LID_APERTURE = 0.055
IRIS_LANDMARKS = {"Left": 473, "Right": 468}
# Motion of a tracked iris in eye widths per radian of gaze, down and to the left; measured on one person who turns the
# head with the gaze on the camera (docs/gestures.md).
IRIS_SHIFT_PER_RAD = (-0.23, 0.33)
# Weight of lip landmarks in the estimation of expressions. At full weight the jaw motion of speech is estimated as
# surprise (mean weight 0.20 in neutral speech), and the error in the rest of the face is three times that of no
# expression; without lips, smiles are hard to detect (docs/gestures.md).
LIP_WEIGHT = 0.1
MAX_GAZE_LID_CLOSURE = 0.35  # beyond this closure the lid hides the iris

Floats = NDArray[np.float32]


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
    """

    name: str
    motion: dict[str, Floats]
    speech: Floats
    intensity: Floats
    pitch: Floats


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
    )


def weight_displacements(displacements: NDArray[np.floating]) -> NDArray[np.float64]:
    """Displacements (N, 478, 3) weighted for the estimation of expressions, with a low weight of the lips."""
    counts = np.ones((N_LANDMARKS, 1))
    counts[list(MOUTH_REGION)] = LIP_WEIGHT
    return np.asarray(displacements, np.float64) * counts


def lid_closure(landmarks: NDArray[np.floating], rest: NDArray[np.floating]) -> Floats:
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


def gaze_angles(turned: NDArray[np.float64], head: NDArray[np.floating], shut: Floats) -> Floats:
    """(T, 2) gaze pitch and yaw relative to the recording's median, from the eyes' angles (T, 2) in the head.

    Frames in which lids hide the irises are interpolated linearly.
    """
    gaze = turned + head[:, :2]
    seen = np.flatnonzero(shut.max(axis=1) < MAX_GAZE_LID_CLOSURE)
    if len(seen):
        frames = np.arange(len(gaze))
        gaze = interpolate_columns(gaze[seen], seen, frames)
    centred: Floats = (gaze - np.median(gaze, axis=0)).astype(np.float32)
    return centred


def _smooth(values: NDArray[np.floating]) -> Floats:
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, TREMOR_SMOOTHING_S * GESTURE_FPS, axis=0), np.float32)


REGION_TABLE = Path(__file__).with_name("regions.tsv")


def feature_landmarks(feature: str) -> NDArray[np.int32]:
    """Landmarks of all regions of a feature, such as both brows."""
    found = [row["landmarks"].split() for row in _read_rows() if row["feature"] == feature]
    return np.array([int(n) for part in found for n in part], np.int32)


def _read_rows() -> list[dict[str, str]]:
    lines = [line for line in REGION_TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines, delimiter="\t"))


KEPT_VARIANCE = 0.95  # of a region's motion that its modes keep: the rest is the tracker's
MAX_MODES = 10


@dataclass(frozen=True, slots=True, eq=False)
class LearnedStyle:
    """A palette with a new style, and the share of each region's motion (variance) that its modes keep."""

    palette: Palette
    kept: Mapping[str, float]


def add_style(
    base: Palette | None,
    name: str,
    parts: Sequence[Decomposition],
    neutral: NDArray[np.floating],
    metadata: Mapping[str, Any],
) -> LearnedStyle:
    """The palette `base` and a style in it, in its modes; a palette of this style alone without a base.

    Parameters
    ----------
    neutral : (478, 3)
        The recorded person's landmarks at rest, mm: the common face, where there is no base.

    Raises
    ------
    InputError
        There is no recording, the style is there already, or a first style lacks a region that others need.
    """
    if not parts:
        raise InputError("no recording could be used; give at least one")
    if base is not None and name in base.names:
        raise InputError(f"the palette has a style {name} already; choose another name with --style")
    missing = [feature for feature in REGION_FEATURES if not all(feature in one.motion for one in parts)]
    if base is None and missing:
        raise InputError(f"the recordings do not show {missing[0]}; a palette begins with recordings that do")
    common = base.neutral if base is not None else np.asarray(neutral, np.float32)
    sizes = axis_ratios(neutral, common)
    moved = {
        feature: np.concatenate([one.motion[feature] for one in parts]) * sizes
        for feature in REGION_FEATURES
        if feature not in missing
    }
    regions = dict(base.regions) if base is not None else {name: _build_region(name, moved[name]) for name in moved}
    motion = {
        feature: np.concatenate([one.motion[feature] for one in parts])
        for feature in FEATURES
        if feature not in REGION_FEATURES and all(feature in one.motion for one in parts)
    }
    kept = {}
    for feature, displaced in moved.items():
        region = regions[feature]
        flat = displaced.reshape(len(displaced), -1)
        motion[feature] = (flat @ region.modes.reshape(len(region.modes), -1).T).astype(np.float32)
        kept[feature] = float(motion[feature].var(axis=0).sum() / max(flat.var(axis=0).sum(), 1e-12))
    style = Style(
        lengths=np.array([len(one.intensity) for one in parts], np.int32),
        intensity=np.concatenate([one.intensity for one in parts]),
        pitch=np.concatenate([one.pitch for one in parts]),
        motion={feature: motion[feature] for feature in FEATURES if feature in motion},
        metadata=dict(metadata),
    )
    if base is None:
        return LearnedStyle(Palette(common, regions, {name: style}, {}, {}), kept)
    return LearnedStyle(replace(base, styles={**base.styles, name: style}), kept)


def _build_region(feature: str, displaced: NDArray[np.floating]) -> FaceRegion:
    """Principal modes of a region's displacements (T, L, 3) about none; each one's largest entry is positive."""
    flat = displaced.reshape(len(displaced), -1).astype(np.float64)
    variances, vectors = principal_axes(np.einsum("ti,tj->ij", flat, flat), flat.shape[1])
    share = np.cumsum(variances) / max(float(variances.sum()), 1e-12)
    n_modes = min(int(np.searchsorted(share, KEPT_VARIANCE)) + 1, MAX_MODES)
    modes = fix_signs(vectors[:n_modes]).reshape(n_modes, -1, 3)
    return FaceRegion(feature_landmarks(feature), modes.astype(np.float32))


VOICE = "voice"  # in place of a feature, on the line of a style's delivery
DERIVED_STYLE_TABLE = Path(__file__).with_name("derived_styles.tsv")


def read_derived_styles(source: str, table: Path = DERIVED_STYLE_TABLE) -> dict[str, Derivation]:
    """Derivations from a measured style, by name.

    Raises
    ------
    DataError
        A line of the table names no feature or channel, or holds no number.
    """
    changes: dict[str, dict[str, FeatureChange]] = {}
    reasons: dict[str, list[str]] = {}
    deliveries: dict[str, Delivery] = {}
    lines = [line for line in table.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    for row in csv.DictReader(lines, delimiter="\t"):
        style, feature = row["style"], row["feature"]
        if feature == VOICE:
            deliveries[style] = _parse_delivery(row["offsets"] or "", table.name, style)
            continue
        if feature not in FIXED_CHANNELS and feature not in REGION_FEATURES:
            raise DataError(f"{table.name}: {style} changes {feature!r}, which is not a feature; correct the table")
        try:
            offset = _parse_offsets(row["offsets"] or "", feature)
            changes.setdefault(style, {})[feature] = FeatureChange(float(row["gain"]), offset, float(row["tempo"]))
        except ValueError as broken:
            raise DataError(f"{table.name}: {feature} of {style} cannot be read ({broken}); correct it") from broken
        reasons.setdefault(style, []).extend([row["why"]] if row["why"] else [])
    return {
        style: Derivation(
            source, changed, f"derived from {source}: {'; '.join(reasons[style])}", deliveries.get(style, PLAIN)
        )
        for style, changed in changes.items()
    }


def _settings(written: str) -> Iterator[tuple[str, str]]:
    """Names and values of a list ``name=value name=value``."""
    for part in written.split():
        name, _, value = part.partition("=")
        yield name, value


def _parse_delivery(written: str, table: str, style: str) -> Delivery:
    try:
        return Delivery(**{name: float(value) for name, value in _settings(written)})
    except (TypeError, ValueError) as broken:
        raise DataError(f"{table}: the voice of {style} cannot be read ({broken}); correct it") from broken


def _parse_offsets(written: str, feature: str) -> Mapping[str, float]:
    found = {}
    for channel, value in _settings(written):
        if channel not in FIXED_CHANNELS.get(feature, ()):
            raise ValueError(f"no channel {channel!r}")
        found[channel] = float(value)
    return found
