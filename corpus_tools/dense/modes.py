"""Dense linear shape model of a talker: principal components of the head's mesh fitted to many frames.

Theobald et al. 2007, section 2.1: the generic mesh is fitted to the sparse shape of every frame (eqs 3 and 4), and the
modes of eq. 1 are those of the dense shapes. The centres of eq. 4 lie where the mesh is in its default position, so a
dense shape is a linear function of the landmarks, ``spread @ displacements``; its principal components are those of the
landmarks under the metric ``spread.T @ spread``, from which they are computed exactly without dense frames in memory.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.adapt_head import EYE_PARTS, RIGID_MOUTH_PARTS
from corpus_tools.dense.mesh_fit import face_landmarks, part_vertices
from corpus_tools.dense.skin_colour import PictureFitter, build_picture_fitter
from corpus_tools.dense.tracked_pictures import TrackedPictures
from lexicon.errors import InputError
from tts2face.face.mouth import CHIN_LANDMARKS
from tts2face.face.shape_transfer import append_shapes
from tts2face.models.face import Face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.numeric.arrays import FloatArray, principal_axes
from tts2face.video.pose import similarity_transforms

OPEN_JAW = 0.6  # weight of jawOpen at which eq. 4 is evaluated; at 0.12 the lower lip is serrated between landmarks
SKIN = "skin"  # the part whose vertices are the dense shape
JAW = ("jawOpen", "jawForward", "jawLeft")  # shapes that move lower teeth and tongue with the chin
LIMIT = 3.0  # standard deviations within which modes are plausible (Theobald et al. 2007, section 3.1)
MEAN, MODE = "denseMean", "dense"  # names of the added shapes: denseMean, dense1, dense2, ...
MOST_MODES = 100  # 30 hold 99.8 % of the variance of GRID s1
HELD_OUT = 5  # one in so many videos is held out for validation


@dataclass(frozen=True, slots=True, eq=False)
class Components:
    """Principal components of displacements of N landmarks.

    Parameters
    ----------
    mean : (N, 3)
        Mean displacement, mm.
    modes : (K, N, 3)
        Displacements of the landmarks, of unit length in the metric.
    duals : (K, N, 3)
        Their inner products with a displacement are its parameters.
    variances : (K,)
        Of the parameters, falling; all of them, so that their sum is the whole variance.
    """

    mean: FloatArray
    modes: FloatArray
    duals: FloatArray
    variances: FloatArray

    def shares(self) -> FloatArray:
        """(K,) compactness: share of the variance in the first 1, 2, ... modes."""
        shares: FloatArray = np.cumsum(self.variances) / self.variances.sum()
        return shares

    def n_modes(self, share: float) -> int:
        """The smallest number of modes with a share of the variance."""
        return int(np.searchsorted(self.shares(), share - 1e-12)) + 1

    def residual(self, displacements: FloatArray, n_modes: int) -> FloatArray:
        """(T, N, 3) residual of displacements (T, N, 3) after projection on the first modes."""
        centred = displacements - self.mean
        parameters = np.tensordot(centred, self.duals[:n_modes], axes=((1, 2), (1, 2)))
        rest: FloatArray = centred - np.tensordot(parameters, self.modes[:n_modes], axes=1)
        return rest


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """Root mean square errors in mm of both models in held-out videos, by number of modes.

    ``dense`` and ``sparse`` are errors of the dense shape: of the dense model, and of the mesh fitted to the sparse
    model's landmarks. Empty for fewer than `HELD_OUT` videos.
    """

    n_modes: tuple[int, ...]
    dense: tuple[float, ...]
    sparse: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class DenseModel:
    """The dense model of a talker, and the sparse one of the same frames.

    Parameters
    ----------
    dense, sparse
        Components of the dense shapes, and of the landmarks alone.
    mean : (V, 3)
        Displacement of the mean shape from the head at rest, mm.
    modes : (K, V, 3)
        Displacement at one standard deviation, mm.
    n_frames, n_landmarks
        Numbers of training frames and of landmarks.
    """

    dense: Components
    sparse: Components
    mean: FloatArray
    modes: FloatArray
    n_frames: int
    n_landmarks: int
    held_out: HeldOut | None

    def summary(self) -> dict[str, Any]:
        """The figures kept in a face file (docs/file-formats.md)."""
        held = self.held_out or HeldOut((), (), ())
        return {
            "frames": self.n_frames,
            "landmarks": self.n_landmarks,
            "modes": len(self.modes),
            "shares": _round_shapes(self.dense.shares()[: len(self.modes)]),
            "sparse_shares": _round_shapes(self.sparse.shares()[: len(self.modes)]),
            "modes_for_95_and_99": [self.dense.n_modes(share) for share in (0.95, 0.99)],
            "sparse_modes_for_95_and_99": [self.sparse.n_modes(share) for share in (0.95, 0.99)],
            "held_out": {
                "modes": list(held.n_modes),
                "dense_mm": _round_shapes(held.dense),
                "sparse_mm": _round_shapes(held.sparse),
            },
        }


def _round_shapes(values: Iterable[float]) -> list[float]:
    return [round(float(value), 6) for value in values]


def mode_fitter(face: Face, used: NDArray[np.int64]) -> PictureFitter:
    """The fitter of an adapted head by the landmarks `used`, evaluated with the jaw open so that lips do not tear."""
    jaw = face.shapes[face.shape_names.index("jawOpen")].astype(np.float64)
    return build_picture_fitter(face, face.vertices + OPEN_JAW * jaw, used)


def dense_model(
    face: Face, fit: PictureFitter, landmarks: Sequence[TrackedPictures], talker: NDArray[np.floating], n_modes: int
) -> DenseModel:
    """Fit the head's mesh to every frame of a talker's videos and find its modes.

    Parameters
    ----------
    face
        The head adapted to the talker.
    fit
        Its fitter (`mode_fitter`): the spread of eqs 3 and 4.
    talker : (478, 3)
        The talker's landmarks at rest, to which the head was adapted.
    n_modes
        Modes to keep.
    """
    videos = [displacements(fit, landmark.landmarks, talker) for landmark in landmarks]
    frames = np.concatenate(videos)
    most = min(len(frames) - 1, MOST_MODES)
    if not 1 <= n_modes <= most:
        raise InputError(f"{n_modes} dense modes cannot be computed from {len(frames)} frames; choose 1 to {most}")
    skin = fit.spread[part_vertices(face, (SKIN,))]
    metric = skin.T @ skin
    dense, sparse = components(frames, metric), components(frames, np.eye(len(metric)))
    scaled = np.sqrt(dense.variances[:n_modes])[:, None, None] * dense.modes[:n_modes]
    shapes = spread_shapes(face, fit, np.concatenate([dense.mean[None], scaled]))
    return DenseModel(
        dense, sparse, shapes[0], shapes[1:], len(frames), len(fit.used), _held_out(videos, metric, len(skin), n_modes)
    )


def displacements(fit: PictureFitter, landmarks: NDArray[np.floating], talker: NDArray[np.floating]) -> FloatArray:
    """(T', N, 3) u of eq. 3 in the head's size: the landmarks of each frame with a face, less the talker's at rest.

    Landmarks (T, 478, 3) are pose-free; frames without a face are NaN and are skipped.
    """
    rest = np.asarray(talker, np.float64)[:N_MESH_LANDMARKS]
    turns, scales = similarity_transforms(rest[None], fit.marks, np.full(N_MESH_LANDMARKS, 1.0 / N_MESH_LANDMARKS))
    known = landmarks[np.isfinite(landmarks[:, 0, 0])].astype(np.float64)
    moved: FloatArray = (known[:, fit.used] - rest[fit.used]) @ (scales[0] * turns[0]).T
    return moved


def components(frames: FloatArray, metric: FloatArray) -> Components:
    """Principal components of displacements (T, N, 3) under a metric (N, N), which is the same for each axis."""
    root = np.linalg.cholesky(metric).T
    mean = frames.mean(axis=0)
    rows = _times(root, frames - mean).reshape(len(frames), -1)
    variances, axes = principal_axes(rows.T @ rows / len(rows), min(len(frames) - 1, rows.shape[1]))
    columns = axes.reshape(-1, *mean.shape)
    modes = _times(np.linalg.inv(root), columns)
    down = -np.sign(modes[..., 1].sum(axis=1))[:, None, None]  # at positive weights a mode moves the face down
    return Components(mean, down * modes, down * _times(root.T, columns), variances)


def _times(matrix: NDArray[np.floating], frames: FloatArray) -> FloatArray:
    """(T, M, 3) a matrix (M, N) times each of the frames (T, N, 3), as one product."""
    product: FloatArray = np.einsum("mn,tnc->tmc", matrix, frames, optimize=True)
    return product


def spread_shapes(face: Face, fit: PictureFitter, moved: FloatArray) -> FloatArray:
    """(K, V, 3) displacement of every vertex for displacements (K, N, 3) of the landmarks.

    Eyeballs do not move; lower teeth and tongue, which are hidden, follow the jaw estimated from the chin.
    """
    shapes: FloatArray = _times(fit.spread, moved)
    shapes[:, part_vertices(face, EYE_PARTS)] = 0.0
    numbers = [face.shape_names.index(name) for name in JAW]
    chin = [row for row, landmark in enumerate(fit.used) if landmark in CHIN_LANDMARKS]
    own = np.stack([face_landmarks(face, face.shapes[number])[fit.used[chin]].ravel() for number in numbers], axis=1)
    opened = np.linalg.lstsq(own, moved[:, chin].reshape(len(moved), -1).T, rcond=None)[0]
    bone = part_vertices(face, RIGID_MOUTH_PARTS)
    shapes[:, bone] = np.einsum("jk,jvc->kvc", opened, face.shapes[numbers][:, bone].astype(np.float64))
    return shapes


def add_modes(face: Face, model: DenseModel) -> Face:
    """The face with the shapes denseMean, dense1, dense2, ...: denseMean at 1 and the modes' parameters give eq. 1."""
    names = (MEAN, *(f"{MODE}{number}" for number in range(1, len(model.modes) + 1)))
    limits = np.array([(0.0, 1.0), *[(-LIMIT, LIMIT)] * len(model.modes)])
    shapes = np.concatenate([model.mean[None], model.modes]).astype(np.float32)
    return append_shapes(face, names, shapes, limits)


def _held_out(videos: Sequence[FloatArray], metric: FloatArray, n_vertices: int, n_modes: int) -> HeldOut | None:
    held = [video for number, video in enumerate(videos) if number % HELD_OUT == HELD_OUT - 1]
    if not held:
        return None
    learnt = np.concatenate([video for number, video in enumerate(videos) if number % HELD_OUT != HELD_OUT - 1])
    frames = np.concatenate(held)
    counts = tuple(k for k in (1, 2, 3, 4, 6, 8, 10, 15, 20, 30, 40, 60, 100) if k <= n_modes)
    errors = []
    for own in (metric, np.eye(len(metric))):
        found = components(learnt, own)
        left = [found.residual(frames, k) for k in counts]
        squares = [(item * _times(metric, item)).sum(axis=(1, 2)).mean() for item in left]
        errors.append(tuple(float(np.sqrt(square / n_vertices)) for square in squares))
    return HeldOut(counts, *errors)
