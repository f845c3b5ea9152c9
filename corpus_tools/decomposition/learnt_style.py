"""A gesture style built from decomposed recordings, and its insertion into a palette."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.decompose import Decomposition
from corpus_tools.decomposition.regions import feature_landmarks
from lexicon.errors import InputError
from tts2face.face.landmarks import axis_ratios
from tts2face.models.palette import (
    FEATURES,
    REGION_FEATURES,
    FaceRegion,
    Palette,
    Style,
)
from tts2face.numeric.arrays import fix_signs, principal_axes

KEPT_VARIANCE = 0.95  # of a region's motion that its modes keep: the rest is the tracker's
# of a region
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
    missing = [feature for feature in REGION_FEATURES if not all(feature in part.motion for part in parts)]
    if base is None and missing:
        raise InputError(f"the recordings do not show {missing[0]}; a palette begins with recordings that do")
    common = base.neutral if base is not None else np.asarray(neutral, np.float32)
    sizes = axis_ratios(neutral, common)
    moved = {
        feature: np.concatenate([part.motion[feature] for part in parts]) * sizes
        for feature in REGION_FEATURES
        if feature not in missing
    }
    regions = dict(base.regions) if base is not None else {name: _build_region(name, moved[name]) for name in moved}
    motion = {
        feature: np.concatenate([part.motion[feature] for part in parts])
        for feature in FEATURES
        if feature not in REGION_FEATURES and all(feature in part.motion for part in parts)
    }
    kept = {}
    for feature, displaced in moved.items():
        region = regions[feature]
        flat = displaced.reshape(len(displaced), -1)
        motion[feature] = (flat @ region.modes.reshape(len(region.modes), -1).T).astype(np.float32)
        kept[feature] = float(motion[feature].var(axis=0).sum() / max(flat.var(axis=0).sum(), 1e-12))
    style = Style(
        lengths=np.array([len(part.intensity) for part in parts], np.int32),
        intensity=np.concatenate([part.intensity for part in parts]),
        pitch=np.concatenate([part.pitch for part in parts]),
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
    # LAPACK chooses signs of vectors by the machine
    modes = fix_signs(vectors[:n_modes]).reshape(n_modes, -1, 3)
    return FaceRegion(feature_landmarks(feature), modes.astype(np.float32))
