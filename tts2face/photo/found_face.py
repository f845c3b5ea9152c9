"""The face in a photograph: its landmarks, pose and size, and what it cannot be used for."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lexicon.errors import DataError, InputError
from tts2face.models.landmarks import (
    EYE_OUTER_LEFT,
    EYE_OUTER_RIGHT,
    FACE_OVAL,
    LIP_LANDMARKS,
    MOUTH_REGION,
    N_MESH_LANDMARKS,
    eye_aperture,
)
from tts2face.numeric.arrays import FloatArray, Pixels
from tts2face.photo.photograph import Photograph, read_photograph, split_number
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.pose import head_angles, rigid_points, similarity_transforms
from tts2face.video.tracking import MIN_CONTRAST, MIN_SCORE, Crop, FaceTracker, crop_around

LIPS = sorted(set(LIP_LANDMARKS))
ABOVE_MOUTH = sorted(set(range(N_MESH_LANDMARKS)) - set(MOUTH_REGION))
CROP_STEP = 0.02  # between the nine crops from which landmarks are read, of the side of the crop
MAX_YAW_DEG, DOUBTFUL_YAW_DEG = 40.0, 25.0
MAX_PITCH_DEG, MAX_ROLL_DEG = 35.0, 60.0
MIN_FACE_PX, BLURRED_FACE_PX = 40.0, 90.0  # width of the oval of the face in pixels of the file
MAX_SPREAD = 0.012  # of landmarks over the crops, of the eye distance; .003 to .006 from the front, .010 at 45 degrees
# Spread of a hidden mouth's lips, of the eye distance and of that of the landmarks above: where the second is above
# 1.35, the first is .0058 at most in 101 pictures, and .0057 to .019 behind hands that were drawn into 13 of them.
HIDDEN_SPREAD, HIDDEN_RATIO = 0.0065, 1.35
# Least probability of a face in the nine crops, and in three of four larger, smaller and turned ones: in 344 pictures
# of people, of which some are drawn, dark, grey, small or noisy, the least are .995 and .74 (in all four); a man who is
# turned by 36 degrees has .03 in one. Of six animals one comes to .34.
SURE_SCORE, SURE_TURNED_SCORE = 0.95, 0.5
TURNED_CROPS = tuple((size, turn) for size in (0.88, 1.14) for turn in (-0.15, 0.15))
CLOSED_EYES = 0.16  # height over width of an eye; open ones have .28 to .50, shut ones .08
MAX_OUTSIDE = 0.3  # of the oval of the face beyond the picture: portraits often end at the forehead
TILE_SHARES = (0.5, 0.3)  # sides of parts of a picture that are searched for small faces, of its shorter side
SAME_FACE = 0.5  # crops whose centres are nearer than this share of the side show one face


@dataclass(frozen=True, slots=True, eq=False)
class FoundFace:
    """A face in a picture.

    Parameters
    ----------
    landmarks : (478, 3)
        Pixels of the picture: x right and y down from the centre of the top left pixel, z away from the camera.
    spread
        Mean standard deviation of the landmarks over the crops, pixels.
    angles_deg
        Pitch (nod down), yaw (to the person's left) and roll of the head.
    eye_distance_px
        Of the outer eye corners, as if the face were seen from the front.
    n_faces
        Faces in the picture.
    mouth_is_hidden
        Whether the lips are read less surely than the rest.
    is_sure
        Whether all crops show a person's face.
    warnings
        Sentences for the user.
    """

    landmarks: FloatArray
    spread: float
    angles_deg: tuple[float, float, float]
    eye_distance_px: float
    n_faces: int
    mouth_is_hidden: bool = False
    is_sure: bool = True
    warnings: tuple[str, ...] = ()

    @property
    def width_px(self) -> float:
        """Width of the oval of the face."""
        return float(np.ptp(self.landmarks[list(FACE_OVAL), 0]))


@dataclass(frozen=True, slots=True, eq=False)
class PhotographedFace:
    """A photograph without transparent parts, the face in it, and the tracker's scores of its expression by shape."""

    picture: Photograph
    found: FoundFace
    scores: Mapping[str, float]

    def mean_score(self, shapes: Sequence[str]) -> float:
        """Mean score of shapes, 0 to 1."""
        return float(np.mean([self.scores[shape] for shape in shapes]))


class PhotoReader:
    """Reads photographs and the faces in them.

    Parameters
    ----------
    model
        Path of face_landmarker.task; found if None.
    on_warning
        Gets sentences about what may look worse.

    Raises
    ------
    BackendError
        The landmark models or a package are not installed.
    """

    def __init__(self, model: Path | None = None, on_warning: Callable[[str], None] = lambda _: None) -> None:
        self.model, self.warn = model, on_warning
        self.tracker, self._expressions = FaceTracker(model), BlendshapeReader(model)

    def read(self, photo: str | Path, *, with_open_eyes: bool = True) -> PhotographedFace:
        """The face in a picture file; ``photo.jpg@2`` is its second largest one; errors as `find_face`."""
        path, number = split_number(photo)
        picture = read_photograph(path).filled()
        found = find_face(
            picture.pixels,
            self.tracker,
            path,
            number=number,
            reduced_by=picture.reduced_by,
            with_open_eyes=with_open_eyes,
        )
        for warning in found.warnings:
            self.warn(warning)
        scores = self._expressions.blendshape_scores(found.landmarks).tolist()
        return PhotographedFace(picture, found, dict(zip(BLENDSHAPES, scores, strict=True)))


def find_face(
    pixels: Pixels,
    tracker: FaceTracker,
    name: str | Path,
    *,
    number: int = 1,
    reduced_by: float = 1.0,
    with_open_eyes: bool = True,
) -> FoundFace:
    """Find a face in a picture (H, W, 3) and check that it can be moved.

    Parameters
    ----------
    name
        The picture's name in messages.
    number
        Which face, from 1, the largest first.
    reduced_by
        Pixels of the file along a side for each of these.
    with_open_eyes
        Whether closed eyes are refused.

    Raises
    ------
    InputError
        There is no such face.
    DataError
        The picture shows no face, or none that can be moved: too small, from the side, cut off or with closed eyes.
    """
    crops = _faces(pixels, tracker, number)
    if not crops:
        raise DataError(
            f"there is no face in {name}; give a picture that shows a face from the front, larger in the picture"
        )
    if not 1 <= number <= len(crops):
        raise InputError(f"{name} has {_count(len(crops))}, and no face {number}; choose 1 to {len(crops)}")
    found = _read(pixels, tracker, crops[number - 1], len(crops))
    _check(found, pixels.shape[:2], str(name), reduced_by)
    if with_open_eyes:
        _check_eyes(found, str(name))
    return replace(found, warnings=tuple(_warnings(found, str(name), number, reduced_by)))


def _count(n: int) -> str:
    return "one face" if n == 1 else f"{n} faces"


def _faces(pixels: Pixels, tracker: FaceTracker, wanted: int) -> list[Crop]:
    """Crops around faces of a picture, the largest first; where the whole shows too few, parts of it are searched.

    The detector reads 128 pixels, in which it sees no face narrower than about 15.
    """
    if float(pixels.std()) < MIN_CONTRAST:
        return []
    kept: list[Crop] = []
    for part, left, top in _parts(pixels):
        for crop in tracker.detect_faces(part):
            placed = replace(crop, x=crop.x + left, y=crop.y + top)
            points, score = tracker.read_crop(pixels, placed)
            if score >= MIN_SCORE:
                around = crop_around(points)
                if all(np.hypot(around.x - other.x, around.y - other.y) > SAME_FACE * other.side for other in kept):
                    kept.append(around)
        if len(kept) >= wanted and part is pixels:
            break
    return sorted(kept, key=lambda crop: -crop.side)


def _parts(pixels: Pixels) -> Iterator[tuple[Pixels, int, int]]:
    """The picture, then overlapping squares of it, with their left and top edges."""
    yield pixels, 0, 0
    height, width = pixels.shape[:2]
    for share in TILE_SHARES:
        side = round(share * min(height, width))
        for top in _starts(height, side):
            for left in _starts(width, side):
                yield pixels[top : top + side, left : left + side], left, top


def _starts(length: int, side: int) -> Sequence[int]:
    n = -(-2 * (length - side) // side) + 1  # neighbours overlap by half or more
    return [round(start) for start in np.linspace(0, length - side, n).tolist()]


def _read(pixels: Pixels, tracker: FaceTracker, crop: Crop, n_faces: int) -> FoundFace:
    steps = [(across, down) for across in (-1, 0, 1) for down in (-1, 0, 1)]
    step = CROP_STEP * crop.side
    readings = [tracker.read_crop(pixels, replace(crop, x=crop.x + a * step, y=crop.y + d * step)) for a, d in steps]
    every = np.array([points for points, _ in readings], np.float64)
    landmarks = every.mean(axis=0)
    spread = every[..., :2].std(axis=0).mean(axis=1)
    lips = spread[LIPS].mean()
    indices, canonical, weights = rigid_points()
    turns, scales = similarity_transforms((landmarks * (1, -1, -1))[None, indices], canonical, weights)
    angles = np.degrees(head_angles(np.swapaxes(turns, 1, 2)))[0]
    between = np.linalg.norm(canonical[indices == EYE_OUTER_LEFT] - canonical[indices == EYE_OUTER_RIGHT])
    eye_distance = float(between / scales[0])
    return FoundFace(
        landmarks,
        float(spread.mean()),
        (float(angles[0]), float(angles[1]), float(angles[2])),
        eye_distance,
        n_faces,
        bool(lips > max(HIDDEN_SPREAD * eye_distance, HIDDEN_RATIO * spread[ABOVE_MOUTH].mean())),
        min(score for _, score in readings) >= SURE_SCORE and _is_sure_turned(pixels, tracker, crop),
    )


def _is_sure_turned(pixels: Pixels, tracker: FaceTracker, crop: Crop) -> bool:
    """Whether crops of other sizes and angles, rad, show a face, but for one of them; no more are read than decide."""
    turned = (replace(crop, side=size * crop.side, angle=crop.angle + turn) for size, turn in TURNED_CROPS)
    unsure = sure = 0
    while sure < len(TURNED_CROPS) - 1 and unsure < 2:
        if tracker.read_crop(pixels, next(turned))[1] >= SURE_TURNED_SCORE:
            sure += 1
        else:
            unsure += 1
    return unsure < 2


def _check(found: FoundFace, shape: tuple[int, ...], name: str, reduced_by: float) -> None:
    pitch, yaw, roll = found.angles_deg
    if abs(roll) > MAX_ROLL_DEG:
        raise DataError(f"the face in {name} lies {abs(roll):.0f} degrees on its side; turn the picture upright")
    if abs(yaw) > MAX_YAW_DEG:
        raise DataError(
            f"the face in {name} is turned {abs(yaw):.0f} degrees to the side; give a picture that is turned less than "
            f"{MAX_YAW_DEG:.0f}"
        )
    if abs(pitch) > MAX_PITCH_DEG:
        raise DataError(
            f"the face in {name} is bent {abs(pitch):.0f} degrees {'down' if pitch > 0 else 'up'}; give a picture that "
            f"is bent less than {MAX_PITCH_DEG:.0f}"
        )
    oval = found.landmarks[list(FACE_OVAL), :2]
    width = found.width_px * reduced_by
    if width < MIN_FACE_PX:
        raise DataError(
            f"the face in {name} is {width:.0f} pixels wide; it needs {MIN_FACE_PX:.0f}: give a larger picture"
        )
    outside = ((oval < -0.5) | (oval > np.array(shape[::-1]) - 0.5)).any(axis=1).mean()
    if outside > MAX_OUTSIDE:
        raise DataError(f"the face in {name} is cut off by the edge of the picture; give one that shows the whole face")
    if not found.is_sure:
        raise DataError(
            f"what is seen in {name} is not surely a person's face; animals are not moved: give a picture that shows "
            "the face of a person, photographed or drawn, with nothing before it"
        )
    if found.spread > MAX_SPREAD * found.eye_distance_px:
        raise DataError(
            f"the face in {name} cannot be read: something may lie before it, or it is blurred or too dark; give "
            "a clearer picture"
        )


def _check_eyes(found: FoundFace, name: str) -> None:
    heights = [float(eye_aperture(found.landmarks[None], side)[0]) for side in ("Left", "Right")]
    if max(heights) < CLOSED_EYES:
        raise DataError(f"the eyes of the face in {name} are closed; give a picture with open eyes")


def _warnings(found: FoundFace, name: str, number: int, reduced_by: float) -> Iterator[str]:
    if found.n_faces > 1 and number == 1:
        yield (
            f"{name} has {found.n_faces} faces, and the largest is used; another one is chosen by its number, as in "
            "photo.jpg@2"
        )
    if abs(found.angles_deg[1]) > DOUBTFUL_YAW_DEG:
        yield f"the face in {name} is turned {abs(found.angles_deg[1]):.0f} degrees; from the front it moves better"
    if found.mouth_is_hidden:
        yield f"something may lie before the mouth of the face in {name}; give a picture that shows the lips"
    width = found.width_px * reduced_by
    if width < BLURRED_FACE_PX:
        yield (
            f"the face in {name} is {width:.0f} pixels wide and looks blurred; {BLURRED_FACE_PX:.0f} or more look sharp"
        )
