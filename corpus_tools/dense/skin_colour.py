"""The talker's skin colour, averaged over many frames: the dense mesh is fitted to each (eqs 3 and 4)."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.mesh_fit import face_landmarks, face_width
from corpus_tools.dense.skin_canvas import SkinCanvas
from corpus_tools.dense.tracked_pictures import TrackedPictures, eye_opening
from lexicon.errors import DataError
from tts2face.models.face import Face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.numeric.arrays import (
    FloatArray,
    points_in_polygon,
    smoothstep,
    unit_vectors,
    vertex_normals,
)
from tts2face.numeric.splines import DECAY_LENGTH, FACE_WIDTH, rbf_values
from tts2face.types import Progress
from tts2face.video.pose import similarity_transforms

OnFrame = Callable[[NDArray[np.uint8], NDArray[np.float32]], None]
N_FRAMES = 160  # averaged; a few dozen remove the noise of the pictures
FACING_COSINES = (0.15, 0.75)  # cosine between normal and camera at which the weight of a texel starts and is full
MIN_EYE_OPENING = 0.8  # of the median eye opening; frames with less are skipped
REMAP_COLUMNS = 1024  # OpenCV maps pictures, not lists


@dataclass(frozen=True, slots=True, eq=False)
class SkinColours:
    """Numbers (R,) of texels of a canvas that show the talker, their colours (R, 3), sRGB 0..255, and weights (R,)."""

    rows: NDArray[np.int64]
    colour: FloatArray
    weight: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PictureFitter:
    """Fit of a head's vertices to pictures: a similarity on the landmarks, then eqs 3 and 4 on the residual.

    ``rows`` (V,) are the numbers of these vertices in the face, rising.
    """

    rows: NDArray[np.int64]
    vertices: FloatArray
    marks: FloatArray
    used: NDArray[np.int64]
    spread: FloatArray

    def fit(self, points: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
        """(V, 3) vertices, x right, y up, z towards the camera in pixels, and the (3, 3) rotation, for (478, 3)."""
        linear, shift, turn = self.pose(points)
        left = self._wanted(points) - (self.marks[self.used] @ linear.T + shift)
        placed: FloatArray = self.vertices @ linear.T + shift + self.spread @ left
        return placed, turn

    def pose(self, points: NDArray[np.floating]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Scaled rotation (3, 3) and shift (3,) from the head to such pixels, and the rotation, for (478, 3)."""
        wanted, own = self._wanted(points), self.marks[self.used]
        turns, scales = similarity_transforms(own[None], wanted, np.full(len(own), 1.0 / len(own)))
        linear = scales[0] * turns[0]
        return linear, wanted.mean(axis=0) - linear @ own.mean(axis=0), turns[0]

    def _wanted(self, points: NDArray[np.floating]) -> FloatArray:
        return np.asarray(points[self.used], np.float64) * (1.0, -1.0, -1.0)


def build_picture_fitter(
    face: Face, opened: FloatArray, used: NDArray[np.int64], rows: NDArray[np.int64] | None = None
) -> PictureFitter:
    """The fitter of all vertices of a face, or of `rows`; at `opened` (V, 3), the lips apart, is interpolated."""
    from scipy.linalg import solve

    centres = face_landmarks(face, opened)[used]
    marks = face_landmarks(face, face.vertices.astype(np.float64))[:N_MESH_LANDMARKS]
    reach = DECAY_LENGTH / FACE_WIDTH * face_width(marks)
    matrix = rbf_values(centres, centres, reach)
    rows = np.arange(len(opened)) if rows is None else rows
    spread = solve(matrix, rbf_values(opened[rows], centres, reach).T, assume_a="pos").T
    return PictureFitter(rows, face.vertices[rows].astype(np.float64), marks, used, spread)


def average_skin_colours(
    face: Face,
    canvas: SkinCanvas,
    fit: PictureFitter,
    seen: Sequence[TrackedPictures],
    *,
    on_frame: OnFrame,
    on_progress: Progress,
) -> SkinColours:
    """Colours from the frames of all videos that show open eyes; `on_frame` gets each picture and its landmarks."""
    rows = np.flatnonzero(canvas.share > 0)
    texels = canvas.texels.at(rows)
    own_normals = unit_vectors(texels.interpolate(welded_normals(face)))
    texels = replace(texels, corners=np.searchsorted(fit.rows, texels.corners))
    total, weight = np.zeros((len(rows), 3)), np.zeros(len(rows))
    for sampled, picture, points in select_frames(seen, on_progress):
        placed, turn = fit.fit(points)
        places = texels.interpolate(placed[:, :2] * (1.0, -1.0))
        colour, inside = sample_picture(picture, places)
        if sampled.opening is not None:
            inside = inside & ~points_in_polygon(places, sampled.opening)
        facing = sampled.weight * smoothstep(own_normals @ turn[2], *FACING_COSINES) * inside
        total += facing[:, None] * colour
        weight += facing
        # mirrored pictures fill what a turned head hides, and show nothing else
        if sampled.weight == 1:
            on_frame(picture, points)
    if not weight.any():
        raise DataError("no frame shows the face with open eyes; give a video of the person looking at the camera")
    return SkinColours(rows, total / np.maximum(weight, 1e-9)[:, None], weight)


def select_frames(
    videos: Sequence[TrackedPictures], on_progress: Progress
) -> Iterator[tuple[TrackedPictures, NDArray[np.uint8], NDArray[np.float32]]]:
    """Yield video, picture (H, W, 3) and landmarks (478, 3) of `N_FRAMES` frames over the videos, eyes open."""
    per_video = int(np.ceil(N_FRAMES / len(videos)))
    usual = float(np.nanmedian(np.concatenate([eye_opening(video.landmarks) for video in videos])))
    for number, video in enumerate(videos):
        awake = np.flatnonzero(np.nan_to_num(eye_opening(video.landmarks)) > MIN_EYE_OPENING * usual)
        if len(awake):
            wanted = set(awake[np.linspace(0, len(awake) - 1, per_video).round().astype(int)].tolist())
            for at, pixels in enumerate(video.frames()):
                if at in wanted:
                    yield video, pixels, video.points[at]
        on_progress(number + 1, len(videos))


def sample_picture(picture: NDArray[np.uint8], places: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Colours (P, 3) of a picture (H, W, 3) at positions (P, 2), and a mask of those inside it; cubic interpolation."""
    import cv2

    height, width = picture.shape[:2]
    n = len(places)
    grid = np.zeros((-(-n // REMAP_COLUMNS), REMAP_COLUMNS, 2), np.float32)
    grid.reshape(-1, 2)[:n] = places
    found = cv2.remap(picture, grid[..., 0], grid[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    inside = np.all((places >= 0) & (places <= (width - 1, height - 1)), axis=1)
    return found.reshape(-1, 3)[:n].astype(np.float64), inside


def welded_normals(face: Face) -> FloatArray:
    """(V, 3) outward unit normals of the face at rest; vertices at one position share one normal."""
    places, shared = np.unique(face.vertices, axis=0, return_inverse=True)
    shared = shared.reshape(-1)
    return vertex_normals(places.astype(np.float64), shared[face.triangles])[shared]
