"""Weights of a character's own shapes, by their names in its file, from the motion of its face."""

import numpy as np
from numpy.typing import NDArray

from tts2face.face.combinations import PREFIX
from tts2face.face.landmarks import landmark_motion
from tts2face.face.lip_constraints import CORNER_CARRIERS, CORNER_SHAPE, SPEECH_SHAPE_PREFIXES
from tts2face.face.stand_in import stand_in
from tts2face.interchange.characters.shapes import ShapeMapping
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.types import Trajectory

BOTH_SIDES_SHARE = 0.5  # of each of two shapes that one shape of the character for both sides gets
RIDGE = 0.02  # of the mean curvature: keeps replaced shapes from adding large opposite weights


def own_names(mapping: ShapeMapping) -> tuple[str, ...]:
    """Names of the morph targets and expressions that a mapping drives, in its order."""
    return tuple(dict.fromkeys(source.name for sources in mapping.values() for source in sources))


def own_weights(motion: Trajectory, face: Face, mapping: ShapeMapping) -> dict[str, FloatArray]:
    """Weights (T,) of each of the character's own shapes that a motion moves, by name.

    Parameters
    ----------
    motion
        In the first shapes of the face.
    mapping
        Morph targets and expressions of each shape.
    """
    combined = [name for name in motion.channels if name in mapping and name.startswith(PREFIX)]
    own = [name for name in motion.channels if name in mapping and name not in combined]
    values = np.hstack([_own_values(motion, face, own), motion.columns(combined).astype(np.float64)])
    found: dict[str, FloatArray] = {}
    for name, track in zip((*own, *combined), values.T, strict=True):
        for source in mapping[name]:
            share = BOTH_SIDES_SHARE if source.side else 1.0
            found[source.name] = found.get(source.name, np.zeros(len(track))) + share * source.gain * track
    return found


def _own_values(motion: Trajectory, face: Face, own: list[str]) -> FloatArray:
    """Weights (T, k) of the shapes `own`, which also carry the motion of the shapes that the character lacks."""
    channels = motion.channels
    values = motion.values.astype(np.float64)
    kept = motion.columns(own).astype(np.float64)
    turned = {name for eye in face.eyes for name in eye.turns}
    carried = [k for k, name in enumerate(channels) if name not in own and not name.startswith(PREFIX)]
    others = [k for k in carried if channels[k] not in turned and values[:, k].any()]
    spoken = [k for k in others if channels[k].startswith(SPEECH_SHAPE_PREFIXES)]
    bent = [k for k in spoken if channels[k] == CORNER_SHAPE]
    of_mouth = [n for n, name in enumerate(own) if name.startswith(SPEECH_SHAPE_PREFIXES)]
    groups = (
        ([k for k in spoken if k not in bent], of_mouth),
        (bent, [n for n in of_mouth if own[n].startswith(CORNER_CARRIERS)]),
        ([k for k in others if k not in spoken], [n for n in range(len(own)) if n not in of_mouth]),
    )
    for group, carriers in groups:
        columns = [n for n in carriers if "eyeLook" not in own[n]]
        if group and columns:
            shapes = np.array([channels.index(own[n]) for n in columns])
            missing = (np.array(group), values[:, group])
            kept[:, columns] = _with_replacement(stand_in(face), shapes, kept[:, columns], missing)
    return kept


def _with_replacement(
    face: Face, shapes: NDArray[np.int64], weights: FloatArray, missing: tuple[NDArray[np.int64], FloatArray]
) -> FloatArray:
    """Weights (T, k) of `shapes` (k,) that move the landmarks most like their `weights` and missing shapes do.

    `missing` holds the indices (m,) of the missing shapes and their weights (T, m). The result is within the limits.
    """
    here = landmark_motion(face, shapes).reshape(-1, len(shapes))
    there = landmark_motion(face, missing[0]).reshape(-1, len(missing[0]))
    curvature = here.T @ here
    curvature += (RIDGE * float(np.trace(curvature)) / len(shapes) + 1e-9) * np.eye(len(shapes))
    limits = face.limits[shapes].astype(np.float64)
    solved = bounded_least_squares(curvature, weights @ curvature + missing[1] @ (there.T @ here), limits)
    is_moved = np.asarray(missing[1].any(axis=1))
    return np.where(is_moved.reshape(-1, 1), solved, weights)
