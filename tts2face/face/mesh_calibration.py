"""Calibration of a face on its mesh: its mouth reads as that of the default head when it moves alike.

The scores of the default head were learnt from its pictures. Each shape of another face is expressed by weights of the
head's shapes that move the landmarks of the mouth alike, in proportion to its width. The face then reads as the head
does, however its shapes are named and however far they go.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.landmarks import landmark_motion, landmark_positions, procrustes_rotation, scatter_landmarks
from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.face.mouth import CHIN_LANDMARKS, CORNERS_LEFT, CORNERS_RIGHT, VISIBLE, landmark_weights, require_lips
from tts2face.face.shape_transfer import default_head
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    MOUTH_REGION,
)
from tts2face.models.score_map import ScoreMap
from tts2face.numeric.arrays import FloatArray, ordered_product
from tts2face.numeric.least_squares import bounded_least_squares

GAP_WEIGHT = 300.0  # of a lip gap, relative to a landmark of the cheek, as in retargeting
WEIGHT_LIMITS = (0.0, 3.0)  # of a shape of the source that one of the face may equal
# Shapes of the source that only one of the same name equals: opposite ones would act together to lift a jaw.
ALONE = ("jawForward", "jawLeft", "jawRight", "mouthLeft", "mouthRight")
TOLERANCE_SHARE = 0.006  # of the mouth's width, .3 mm: overlap or slit of shut lips in a smile, which nobody sees
SPREAD = 0.02  # ridge, over the median curvature: a jaw alone, not ten small shapes together
NAMED_SHARE = 0.1  # pull to the source's shape of the same name, as a share of the curvature along it


def calibrate_on_mesh(face: Face, source: Face | None = None) -> Face:
    """Face with a score map of the shapes that speech moves, carried over from another face, or the default head.

    Raises
    ------
    DataError
        A face lacks landmarks of the lips or shapes that move them, or the source has no score map.
    """
    source = default_head() if source is None else source
    scores = source.scores
    if scores is None:
        raise DataError("the face from which scores are carried over has none; calibrate it first")
    equal = equivalent_weights(face, source)
    carried = ScoreMap(
        tuple(face.shape_names[at] for at in _speech_shapes(face)),
        hidden=ordered_product(scores.hidden, equal).astype(np.float32),
        hidden_bias=scores.hidden_bias,
        output=scores.output,
        direct=ordered_product(scores.direct, equal).astype(np.float32),
        bias=scores.bias,
    )
    width = _width(scatter_landmarks(face, landmark_positions(face)))
    return replace(face, scores=carried, lip_tolerance_mm=TOLERANCE_SHARE * width)


def equivalent_weights(face: Face, source: Face) -> FloatArray:
    """Weights (k, j) of the source's speech shapes that move its mouth as weight 1 of each of the face's does."""
    shapes, theirs = _speech_shapes(face), _speech_shapes(source)
    for model, moving in ((face, shapes), (source, theirs)):
        require_lips(model, moving)
    both = np.intersect1d(face.landmarks, source.landmarks)
    common = [landmark for landmark in MOUTH_REGION if landmark in set(both.tolist())]
    places, source_places = (scatter_landmarks(model, landmark_positions(model)) for model in (face, source))
    turn = procrustes_rotation(places[both], source_places[both])
    scale = _width(source_places) / _width(places)
    moved = scale * np.einsum("cd,ldk->lck", turn, scatter_landmarks(face, landmark_motion(face, shapes)))
    wanted = _measures(moved, common)
    known = _measures(scatter_landmarks(source, landmark_motion(source, theirs)), common)
    names, source_names = (np.array(model.shape_names)[moving] for model, moving in ((face, shapes), (source, theirs)))
    curvature = ordered_product(known.T, known)
    along = np.diag(curvature)
    gains = np.clip(ordered_product(known.T, wanted) / along[:, None], *WEIGHT_LIMITS)
    is_named = (source_names[:, None] == names).astype(np.float64)
    # towards the namesake as far as the shape goes along it, and towards 0 for all others
    pull = SPREAD * np.median(along) + NAMED_SHARE * along[:, None] * is_named
    limits = np.where(np.isin(source_names, ALONE)[:, None], 0.0, np.tile(WEIGHT_LIMITS, (len(theirs), 1)))
    linear = ordered_product(wanted.T, known) + (pull * gains * is_named).T
    equal = bounded_least_squares(curvature + pull.T[:, :, None] * np.eye(len(theirs)), linear, limits).T
    return np.where(np.isin(names, ALONE), gains * is_named, equal)


def strengths(face: Face) -> dict[str, float]:
    """Weight of the default head's shape of the same name that equals weight 1 of each shape that speech moves."""
    head = default_head()
    names, theirs = ([model.shape_names[at] for at in _speech_shapes(model)] for model in (face, head))
    equal = equivalent_weights(face, head)
    return {name: float(equal[theirs.index(name), at]) for at, name in enumerate(names) if name in theirs}


def _speech_shapes(face: Face) -> NDArray[np.int64]:
    return np.array([at for at, name in enumerate(face.shape_names) if name.startswith(SPEECH_SHAPE_PREFIXES)])


def _width(places: FloatArray) -> float:
    return float(np.linalg.norm(places[MOUTH_CORNER_LEFT] - places[MOUTH_CORNER_RIGHT]))


def _measures(moved: FloatArray, common: list[int]) -> FloatArray:
    """Visible changes (M, k) of a mouth for motion (478, 3, k) of its landmarks, weighted as in retargeting."""
    landmarks = moved[common] * np.sqrt(landmark_weights(common))[..., None]
    widened = moved[list(CORNERS_LEFT), 0] - moved[list(CORNERS_RIGHT), 0]
    opened = moved[list(INNER_LIP_UPPER), 1] - moved[list(INNER_LIP_LOWER), 1]
    chin = [landmark for landmark in CHIN_LANDMARKS if landmark in common]
    dropped = moved[chin, 1].mean(axis=0, keepdims=True) if chin else np.zeros((0, moved.shape[2]))
    rows = (landmarks.reshape(-1, moved.shape[2]), np.sqrt(VISIBLE.width) * widened)
    return np.concatenate([*rows, np.sqrt(VISIBLE.chin) * dropped, np.sqrt(GAP_WEIGHT) * opened])
