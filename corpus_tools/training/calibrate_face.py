"""Calibration of a face: the face tracker's reading of its mouth for weights of the shapes that speech moves.

A score map is trained on scores of the face's landmarks in thousands of poses, and corrected by scores that the tracker
reads in rendered pictures of some hundred poses.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from corpus_tools.training.score_map import clipped_logits, fit_score_map, read_mouth_scores
from lexicon.errors import DataError
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.lips.retargeting import build_retargeter
from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.score_map import SCORE_SHAPES, ScoreMap, mouth_scores
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.types import Progress, Trajectory, ignore_progress
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.tracking import FaceTracker

N_UTTERANCES = 40  # of the talker whose poses the face takes
N_POSES = 4000  # whose scores are computed from landmarks
# Poses of speech, and variations of them, that are rendered in each round; each round changes the poses of speech, and
# Gauss-Newton steps lead to where the map is wrong, so that rounds must follow each other.
N_DRAWN = ((150, 350), (300, 150), (300, 150))
DRAWN_COPIES = 3  # of a rendered pose in the training data, of which those of landmarks are the rest
SIZE_PX = 256
RIDGE = 30.0  # of the correction, for weights and logits of unit size
LEAST_PRECISION = 0.01  # of a logit in the correction; that of a score of s is s (1 - s)
# Shapes added to poses of speech, the share of poses, and the greatest weight.
ADDED = (
    ("mouthPucker", 0.35, 0.7), ("mouthFunnel", 0.25, 0.6), ("mouthUpperUp", 0.25, 0.6), ("mouthLowerDown", 0.3, 0.6),
    ("mouthSmile", 0.2, 0.7), ("mouthStretch", 0.2, 0.7), ("mouthPress", 0.1, 0.5),
)  # fmt: skip
JAW_SHARE, MAX_JAW = 0.6, 0.5  # share of poses with the jaw dropped further, by up to this weight
GAINS, GAIN_SPREAD = (0.0, 1.4), 0.4  # of a pose, and of each shape in it (standard deviation of its logarithm)


def calibrate_face(
    face: Face, talker: Talker, *, model: Path | None = None, on_progress: Progress = ignore_progress
) -> Face:
    """The face with a score map.

    Parameters
    ----------
    talker
        Talker with a score map, whose speech gives the poses.
    model
        Bundle of landmark models; found if None.
    """
    names = _speech_shapes(face)
    tracker, reader = FaceTracker(model), BlendshapeReader(model)
    rng = np.random.default_rng(0)
    columns = [face.shape_names.index(name) for name in names]
    mirror = [names.index(mirrored_name(name)) if mirrored_name(name) in names else at for at, name in enumerate(names)]
    spoken = _speech_poses(replace(face, scores=None), talker)[:, columns]
    poses = vary_poses(spoken, names, N_POSES, rng)
    read = read_mouth_scores(_landmarks(face, poses, columns), reader)
    drawn, drawn_read = np.zeros((0, len(names))), np.zeros((0, len(SCORE_SHAPES)))
    found: ScoreMap | None = None
    for number, (n_spoken, n_varied) in enumerate(N_DRAWN):
        spoken = _speech_poses(replace(face, scores=found), talker)[:, columns]
        chosen = spoken[rng.choice(len(spoken), n_spoken, replace=False)]
        shown = np.concatenate([np.zeros((1, len(names))), chosen, vary_poses(spoken, names, n_varied, rng)])
        seen, scores = _read_drawn(face, shown, columns, (tracker, reader))
        drawn, drawn_read = np.concatenate([drawn, seen]), np.concatenate([drawn_read, scores])
        known = np.concatenate([poses, *[drawn] * DRAWN_COPIES])
        known_scores = np.concatenate([read, *[drawn_read] * DRAWN_COPIES])
        fitted = fit_score_map(names, np.concatenate([known, known[:, mirror]]), np.tile(known_scores, (2, 1)))
        found = symmetrise_score_map(correct_score_map(fitted, drawn, drawn_read), mirror)
        on_progress(1 + number, len(N_DRAWN))
    return replace(face, scores=found)


def vary_poses(poses: FloatArray, names: tuple[str, ...], n_poses: int, rng: np.random.Generator) -> FloatArray:
    """Poses (n_poses, K) around given ones (N, K), with other sizes of all shapes and with shapes added."""
    varied = poses[rng.integers(0, len(poses), n_poses)] * rng.uniform(*GAINS, (n_poses, 1))
    varied *= np.exp(rng.normal(0.0, GAIN_SPREAD, varied.shape))
    jaw = np.where(rng.uniform(size=n_poses) < JAW_SHARE, rng.uniform(0.0, MAX_JAW, n_poses), 0.0)
    varied[:, names.index("jawOpen")] += jaw
    if "mouthClose" in names:
        varied[:, names.index("mouthClose")] += jaw * rng.uniform(size=n_poses)
    for prefix, share, most in ADDED:
        size = np.where(rng.uniform(size=n_poses) < share, rng.uniform(0.0, most, n_poses), 0.0)
        for name in (prefix, f"{prefix}Left", f"{prefix}Right"):
            if name in names:
                varied[:, names.index(name)] += size * np.exp(rng.normal(0.0, GAIN_SPREAD / 2, n_poses))
    limited: FloatArray = np.clip(varied, 0.0, 1.0)
    return limited


def correct_score_map(score_map: ScoreMap, poses: FloatArray, scores: FloatArray) -> ScoreMap:
    """The score map plus a linear map of inputs and logits that fits the scores (N, S) read at poses (N, K)."""
    logits = score_map.logits(poses)
    terms = np.concatenate([np.ones((len(poses), 1)), poses, logits], axis=1)
    ridge = RIDGE * np.eye(terms.shape[1])
    ridge[0, 0] = 1e-6  # the constant is free
    missing = clipped_logits(scores) - logits
    found = []
    for score in range(scores.shape[1]):
        precision = np.maximum(scores[:, score] * (1.0 - scores[:, score]), LEAST_PRECISION)
        weighted = terms * (precision / precision.mean())[:, None]
        found.append(np.linalg.solve(weighted.T @ terms + ridge, weighted.T @ missing[:, score]))
    n_inputs = poses.shape[1]
    constant, by_pose, by_logits = np.split(np.array(found), [1, 1 + n_inputs], axis=1)
    mixing = np.eye(len(by_logits)) + by_logits
    return replace(
        score_map,
        output=(mixing @ score_map.output).astype(np.float32),
        direct=(mixing @ score_map.direct + by_pose).astype(np.float32),
        bias=(mixing @ score_map.bias + constant[:, 0]).astype(np.float32),
    )


def symmetrise_score_map(score_map: ScoreMap, mirror: list[int]) -> ScoreMap:
    """Mean of the map and of the map for mirrored inputs, whose order is `mirror`.

    The scores average left and right; a map that treats them differently would turn the mouth to one side.
    """
    half = (score_map.output / 2).astype(np.float32)
    return replace(
        score_map,
        hidden=np.concatenate([score_map.hidden, score_map.hidden[:, mirror]]),
        hidden_bias=np.tile(score_map.hidden_bias, 2),
        output=np.concatenate([half, half], axis=1),
        direct=((score_map.direct + score_map.direct[:, mirror]) / 2).astype(np.float32),
    )


def mirrored_name(name: str) -> str:
    """Name of a shape on the other half of the face; the same for shapes of both halves."""
    # the face is made symmetric: each pose is learnt with its mirror image
    if "Left" in name:
        return name.replace("Left", "Right")
    return name.replace("Right", "Left")


def _speech_shapes(face: Face) -> tuple[str, ...]:
    missing = [name for names in SCORE_SHAPES.values() for name in names if name not in face.shape_names]
    if missing:
        raise DataError(f"the face lacks the shape {missing[0]}, so its scores cannot be calibrated; add the shape")
    if len(face.landmarks) < N_LANDMARKS:
        raise DataError(
            f"the face has {len(face.landmarks)} of {N_LANDMARKS} landmarks, so its scores cannot be calibrated"
        )
    return tuple(name for name in face.shape_names if name.startswith(SPEECH_SHAPE_PREFIXES))


def _speech_poses(face: Face, talker: Talker) -> FloatArray:
    """Weights (N, K) of the talker's speech on the face."""
    retargeter = build_retargeter(talker, face)
    chosen = talker.utterances[:: len(talker.utterances) // N_UTTERANCES + 1]
    parts = [retargeter.retarget(talker.speech_trajectory(utterance)).values for utterance in chosen]
    return np.concatenate(parts).astype(np.float64)


def _landmarks(face: Face, poses: FloatArray, columns: list[int]) -> FloatArray:
    rest = scatter_landmarks(face, landmark_positions(face))
    motion = scatter_landmarks(face, landmark_motion(face, np.array(columns)))
    moved: FloatArray = rest + np.tensordot(poses, motion, axes=(1, 2))
    return moved


def _read_drawn(
    face: Face, poses: FloatArray, columns: list[int], networks: tuple[FaceTracker, BlendshapeReader]
) -> tuple[FloatArray, FloatArray]:
    """Poses (M, K) in whose pictures the tracker finds the face, and the scores (M, S) that it reads there."""
    tracker, reader = networks
    renderer = mesh_renderer(face, Picture(size=f"{SIZE_PX}x{SIZE_PX}"))
    weights = np.zeros((len(poses), len(face.shape_names)), np.float32)
    weights[:, columns] = poses
    pictures = [renderer.draw(pose) for pose in weights]
    tracking = tracker.track(lambda: pictures, 25.0)
    seen = ~tracking.is_missing
    if not seen.any():
        raise DataError("the tracker finds no face in pictures of the face, so its scores cannot be calibrated")
    scores = np.array([reader.blendshape_scores(points) for points in tracking.points[seen]])
    return poses[seen], mouth_scores(Trajectory(BLENDSHAPES, scores, 25.0))
