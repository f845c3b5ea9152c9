"""Face tracking: 478 landmarks and a score for each picture, without temporal filtering.

BlazeFace detects the face once; the face mesh network (Kartynnik et al. 2019) reads each picture from a square crop
around the landmarks of the previous one. Temporal filtering would attenuate lip closures and add delay
(docs/decisions/010-landmarks-two-passes.md).
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, import_of_extra
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import true_runs
from tts2face.video.networks import find_bundle, load_network

MIN_SCORE = 0.5  # face probability of the mesh network; below it the landmarks are noise
MIN_CONTRAST = 2.0  # standard deviation of pixel values; a blank frame has 0, a dark face about 20
DETECTOR_SIZE = 128  # pixels of the detector's square input
MESH_SIZE = 256  # pixels of the mesh network's square input
CROP_SCALE = 1.5  # side of the square over the longer side of the landmarks' box, as the mesh network was trained
CROP_SMOOTHING_S = 0.16  # standard deviation; slower than speech, faster than a turn of the head
CROP_STEP = 0.015  # offset of the two crops of the second pass, relative to the side of the square
MIN_FACE_LOGIT = 0.0  # detector logit from which the best detection is a face
MIN_FURTHER_FACE_LOGIT = 1.0  # detector logit from which further detections count
SAME_FACE_DISTANCE = 0.5  # detections whose centres are nearer, relative to the size of the face, are the same face
DETECTOR_GRIDS = ((16, 2), (8, 6))  # cells per side and anchors per cell of BlazeFace's two feature maps


@dataclass(frozen=True, slots=True)
class Crop:
    """A square of the picture, rotated so that the eyes are level: centre and side in pixels, angle in radians."""

    x: float
    y: float
    side: float
    angle: float


@dataclass(frozen=True, slots=True, eq=False)
class Tracking:
    """Landmarks of T frames.

    Parameters
    ----------
    points : (T, 478, 3)
        Pixels: x right and y down from the centre of the top left pixel, z away from the camera on the scale of x; NaN
        for frames without a face.
    scores : (T,)
        Probability that the landmarks lie on a face; 0 for a blank frame.
    """

    points: NDArray[np.float32]
    scores: NDArray[np.float32]

    @property
    def is_missing(self) -> NDArray[np.bool_]:
        """(T,) frames without a face."""
        return np.isnan(self.points[:, 0, 0])


class FaceTracker:
    """Tracker of one face; not thread-safe.

    Parameters
    ----------
    model
        Path of the model bundle; if None, see `tts2face.video.networks.find_bundle`.

    Raises
    ------
    BackendError
        LiteRT, OpenCV or the bundle is missing.
    """

    def __init__(self, model: Path | None = None) -> None:
        bundle = find_bundle(model)
        self._cv = _opencv()
        self._detector = load_network(bundle, "face_detector")
        self._mesh = load_network(bundle, "face_landmarks_detector")
        self._anchors = _anchors()

    def track(self, pictures: Callable[[], Iterable[NDArray[np.uint8]]], fps: float) -> Tracking:
        """Track the face in a sequence of (H, W, 3) RGB pictures.

        Parameters
        ----------
        pictures
            Returns an iterator over all pictures; it is called twice, so that pictures need not be stored.
        fps
            Pictures per second.

        Raises
        ------
        DataError
            There is no picture.

        Notes
        -----
        The first pass follows the face. The second pass reads each picture from two crops whose positions are smoothed
        with zero phase, and averages the landmarks, since jitter of the crop adds noise to them, mainly to z. The
        landmarks themselves are not smoothed over time.
        """
        followed = [crop for _, crop in self.follow(pictures())]
        if not followed:
            raise DataError("there is no picture to track a face in; check the recording")
        points = np.full((len(followed), N_LANDMARKS, 3), np.nan, np.float32)
        scores = np.zeros(len(followed), np.float32)
        for at, (pixels, crop) in enumerate(zip(pictures(), smooth_crops(followed, fps), strict=False)):
            if crop is not None:
                readings = [self.read_crop(pixels, near) for near in jittered_crops(crop)]
                scores[at] = np.mean([score for _, score in readings])
                if scores[at] >= MIN_SCORE:
                    points[at] = np.mean([found for found, _ in readings], axis=0)
        return Tracking(points, scores)

    def read(self, pixels: NDArray[np.uint8]) -> tuple[NDArray[np.float32], float]:
        """(478, 3) landmarks of one picture and their score; NaN and 0 without a face."""
        return next((found, score) for (found, score), _ in self.follow([pixels]))

    def detect_face(self, pixels: NDArray[np.uint8]) -> Crop | None:
        """Crop around the most prominent face of an (H, W, 3) picture, or None."""
        boxes, scores, shift, scale = self._detections(pixels)
        best = int(scores.argmax())
        return None if scores[best] < MIN_FACE_LOGIT else self._detected(boxes, best, shift, scale)

    def detect_faces(self, pixels: NDArray[np.uint8]) -> list[Crop]:
        """Crops around the faces of a picture, the most certain first; overlaps are merged by `SAME_FACE_DISTANCE`."""
        boxes, scores, shift, scale = self._detections(pixels)
        # BlazeFace: centre, size, and six points of the face
        rows = boxes.reshape(len(boxes), 8, 2)
        centres, sizes = rows[:, 0] + self._anchors * DETECTOR_SIZE, rows[:, 1].max(axis=1)
        kept: list[int] = []
        for number in np.argsort(scores)[::-1].tolist():
            if scores[number] < MIN_FURTHER_FACE_LOGIT:
                break
            distances = [float(np.linalg.norm(centres[number] - centres[other])) / sizes[other] for other in kept]
            if all(distance > SAME_FACE_DISTANCE for distance in distances):
                kept.append(number)
        return [self._detected(boxes, number, shift, scale) for number in kept]

    def _detected(self, boxes: NDArray[np.float32], number: int, shift: NDArray[np.float64], scale: float) -> Crop:
        row = boxes[number].reshape(8, 2)  # centre, size, then right eye, left eye, nose, mouth, ears
        centre, right_eye, left_eye = (row[[0, 2, 3]] + self._anchors[number] * DETECTOR_SIZE - shift) / scale
        side = CROP_SCALE * float(row[1].max()) / scale
        level = left_eye - right_eye
        return Crop(float(centre[0]), float(centre[1]), side, float(np.arctan2(level[1], level[0])))

    def _detections(
        self, pixels: NDArray[np.uint8]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64], float]:
        """Boxes (896, 16) and logits (896,) of the anchors, and shift and scale from the picture to the input."""
        height, width = pixels.shape[:2]
        scale = DETECTOR_SIZE / max(height, width)
        shift = np.array([DETECTOR_SIZE - scale * width, DETECTOR_SIZE - scale * height]) / 2
        affine = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]])
        small = self._cv.warpAffine(pixels, affine, (DETECTOR_SIZE, DETECTOR_SIZE), flags=self._cv.INTER_AREA)
        # BlazeFace reads pixels from -1 to 1, the mesh network from 0 to 1
        boxes, logits = self._detector((small.astype(np.float32) / 127.5 - 1.0)[None])
        return boxes[0], logits[0, :, 0], shift, scale

    def read_crop(self, pixels: NDArray[np.uint8], crop: Crop) -> tuple[NDArray[np.float32], float]:
        """(478, 3) landmarks in pixels of the picture, and their score, read from one crop."""
        scale = MESH_SIZE / crop.side
        cos, sin = np.cos(crop.angle) * scale, np.sin(crop.angle) * scale
        turn = np.array([[cos, sin], [-sin, cos]])
        shift = MESH_SIZE / 2 - turn @ (crop.x, crop.y)
        small = self._cv.warpAffine(
            pixels,
            np.column_stack([turn, shift]),
            (MESH_SIZE, MESH_SIZE),
            flags=self._cv.INTER_LINEAR if scale > 0.5 else self._cv.INTER_AREA,
            borderMode=self._cv.BORDER_REPLICATE,
        )
        raw = self._mesh((small.astype(np.float32) / 255.0)[None])
        local = raw[0].reshape(N_LANDMARKS, 3).astype(np.float64)
        flat = (
            (local[:, :2] - shift) @ turn / scale**2
        )  # the inverse of a scaled rotation is its transpose over scale^2
        score = 1.0 / (1.0 + np.exp(-float(raw[1].ravel()[0])))
        return np.column_stack([flat, local[:, 2] / scale]).astype(np.float32), score

    def follow(
        self, pictures: Iterable[NDArray[np.uint8]]
    ) -> Iterator[tuple[tuple[NDArray[np.float32], float], Crop | None]]:
        """Yield landmarks and score of each picture as it arrives, and the crop for the next one."""
        crop: Crop | None = None
        for pixels in pictures:
            points, score = np.full((N_LANDMARKS, 3), np.nan, np.float32), 0.0
            if float(pixels.std()) >= MIN_CONTRAST:
                crop = crop or self._initial_crop(pixels)
                if crop is not None:
                    points, score = self.read_crop(pixels, crop)
            crop = crop_around(points) if score >= MIN_SCORE else None
            yield (points, score), crop

    def _initial_crop(self, pixels: NDArray[np.uint8]) -> Crop | None:
        coarse = self.detect_face(pixels)
        return crop_around(self.read_crop(pixels, coarse)[0]) if coarse else None


def crop_around(points: NDArray[np.floating]) -> Crop:
    """Crop around (478, 3) landmarks in pixels, from which the next picture is read."""
    level = points[EYE_OUTER_LEFT, :2] - points[EYE_OUTER_RIGHT, :2]
    angle = float(np.arctan2(level[1], level[0]))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    turned = points[:N_MESH_LANDMARKS, :2].astype(np.float64) @ turn.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    centre = turn.T @ ((low + high) / 2)
    return Crop(float(centre[0]), float(centre[1]), CROP_SCALE * float((high - low).max()), angle)


def smooth_crops(crops: Sequence[Crop | None], fps: float) -> list[Crop | None]:
    """Smooth crops over time with zero phase; runs of pictures with a face are smoothed separately."""
    from scipy.ndimage import gaussian_filter1d

    smooth = list(crops)
    present = np.array([crop is not None for crop in crops])
    for first, last in true_runs(present):
        rows = np.array([astuple(crop) for crop in crops[first:last] if crop is not None])
        # an angle near 180 degrees would be smoothed to 0
        rows[:, 3] = np.unwrap(rows[:, 3])
        rows = gaussian_filter1d(rows, CROP_SMOOTHING_S * fps, axis=0, mode="nearest")
        smooth[first:last] = [Crop(*(float(value) for value in row)) for row in rows]
    return smooth


def jittered_crops(crop: Crop) -> Iterator[Crop]:
    """Yield the two crops, offset by `CROP_STEP` in opposite directions, from which a picture is read."""
    for sign in (1.0, -1.0):
        step = sign * CROP_STEP * crop.side
        yield Crop(crop.x + step, crop.y + step, crop.side * (1.0 + 2.0 * sign * CROP_STEP), crop.angle)


def _anchors() -> NDArray[np.float64]:
    """(896, 2) centres of the detector's anchors as fractions of its input."""
    rows = []
    for cells, per_cell in DETECTOR_GRIDS:
        y, x = np.divmod(np.arange(cells * cells), cells)
        rows.append(np.repeat(np.column_stack([x + 0.5, y + 0.5]) / cells, per_cell, axis=0))
    return np.concatenate(rows)


def _opencv() -> Any:
    with import_of_extra(
        "face tracking needs the package opencv-python-headless: run `pip install 'tts2face[capture]'`"
    ):
        import cv2
    cv2.setNumThreads(1)  # recordings are tracked in parallel, one process each
    return cv2
