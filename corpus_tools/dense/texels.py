"""Texels of a texture: the pixels that lie on a mesh's surface, and interpolation of vertex values at them.

Texels of the skin that are visible from the front: the face without eyes, inner mouth and hidden parts.

Landmarks of a talker in videos and photographs, in the picture and pose-free.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.mesh_fit import OPEN_JAW_WEIGHT, face_landmarks
from corpus_tools.recordings.folder import VIDEO_SUFFIXES, find_recordings
from corpus_tools.recordings.video import CachedTracker
from lexicon.errors import DataError, InputError
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LID_RINGS,
    N_MESH_LANDMARKS,
    lip_opening,
)
from tts2face.numeric.arrays import smoothstep
from tts2face.numeric.kernels import kernel
from tts2face.types import Progress
from tts2face.video.media import read_frames
from tts2face.video.pose import remove_pose

Floats = NDArray[np.float64]

LEAST_SPREAD = 6.0  # of a blur in pixels of a reduced picture, at which it differs by less than .001 of the values
ISLANDS_TOP = 0.815  # v at which the layout of the shipped heads has mouth, neck and eye sockets, below the head


@dataclass(frozen=True, slots=True, eq=False)
class Texels:
    """Texels on the surface: rows and columns (P,), corners and barycentric weights in their triangles (P, 3)."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    corners: NDArray[np.int64]
    weights: Floats

    def at(self, numbers: NDArray[np.int64]) -> "Texels":
        """The texels of these numbers."""
        return Texels(self.rows[numbers], self.columns[numbers], self.corners[numbers], self.weights[numbers])

    def interpolate(self, values: Floats) -> Floats:
        """(P, D) values at the texels, interpolated from vertex values (N, D)."""
        interpolated = np.zeros((len(self.rows), values.shape[1]))
        _interpolate(self.corners, self.weights, values, interpolated)
        return interpolated

    def block_means(self, side: int, *values: Floats) -> list[Floats]:
        """Means (B, D) of values (P, D) over the squares of `side` texels that hold any."""
        squares = np.column_stack([self.rows // side, self.columns // side])
        _, square, count = np.unique(squares, axis=0, return_inverse=True, return_counts=True)
        sums = [[np.bincount(square.ravel(), column) / count for column in own.T] for own in values]
        return [np.column_stack(columns) for columns in sums]

    def blurred(self, values: Floats, side: int, spread: float) -> Floats:
        """(P, D) values (P, D) in a picture that is 0 elsewhere, blurred by a Gaussian of `spread` texels."""
        found = np.zeros_like(values)
        for channel, own in enumerate(values.T):
            picture = np.zeros((side, side), np.float32)
            picture[self.rows, self.columns] = own
            found[:, channel] = blur(picture, spread)[self.rows, self.columns]
        return found


def blur(picture: NDArray[np.float32], spread: float) -> NDArray[np.float32]:
    """A picture (S, S) blurred by a Gaussian of `spread` pixels; a broad blur is computed in a reduced picture."""
    import cv2

    step = max(int(spread / LEAST_SPREAD), 1)
    small = cv2.resize(picture, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_AREA)
    soft = cv2.GaussianBlur(small, (0, 0), spread / step, borderType=cv2.BORDER_REFLECT)
    return np.asarray(cv2.resize(soft, picture.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def find_texels(uv: Floats, triangles: NDArray[np.int64], side: int) -> Texels:
    """The texels whose centres lie in a triangle; where triangles overlap, in the last one."""
    places = uv * side - 0.5
    owner, weights = np.full((side, side), -1), np.zeros((side, side, 3))
    _find_owners(places[triangles], owner, weights)
    rows, columns = np.nonzero(owner >= 0)
    return Texels(rows, columns, triangles[owner[rows, columns]], weights[rows, columns])


@kernel
def _interpolate(corners, weights, values, interpolated):  # type: ignore[no-untyped-def]
    """Write weighted sums (P, D) of the values (N, D) at corners (P, 3)."""
    for p in range(len(corners)):
        a, b, c = corners[p]
        for d in range(values.shape[1]):
            interpolated[p, d] = (
                weights[p, 0] * values[a, d] + weights[p, 1] * values[b, d] + weights[p, 2] * values[c, d]
            )


@kernel
def _find_owners(corners, owner, weights):  # type: ignore[no-untyped-def]
    """Write into each texel the last triangle (T, 3, 2) in which its centre lies, and its barycentric weights there."""
    for number in range(len(corners)):
        (ax, ay), (bx, by), (cx, cy) = corners[number]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-12:
            area = 1e-12
        last = len(owner) - 1
        low_x, high_x = max(0, np.ceil(min(ax, bx, cx) - 1e-9)), min(last, np.floor(max(ax, bx, cx) + 1e-9))
        low_y, high_y = max(0, np.ceil(min(ay, by, cy) - 1e-9)), min(last, np.floor(max(ay, by, cy) + 1e-9))
        for y in range(int(low_y), int(high_y) + 1):
            for x in range(int(low_x), int(high_x) + 1):
                second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                first = 1 - second - third
                if min(first, second, third) >= -1e-6:
                    owner[y, x] = number
                    weights[y, x, 0], weights[y, x, 1], weights[y, x, 2] = first, second, third


INNER_LIPS = (*INNER_LIP_UPPER, *INNER_LIP_LOWER[-2:0:-1])
CELL_MM = 0.75  # of the grid in which the foremost surface is found
HIDDEN_MM = 5.0  # depth behind the foremost surface from which a texel is hidden; slopes within a cell are less
RIM_MM = (3.0, 16.0)  # inside the face's oval: the share of the talker's colour is 0 up to the first, 1 from the second
LID_MM = (0.8, 2.2)  # from the lids' edge, where lashes and the wet rim mix with the skin
LIP_MM = (0.4, 1.4)  # from the inner lips' edge, where the dark between them does
MASK_BLUR = 2.0  # texels


@dataclass(frozen=True, slots=True, eq=False)
class SkinCanvas:
    """The skin texture of a head, to be painted.

    Parameters
    ----------
    texture : (S, S, 3)
        The head's texture, sRGB.
    texels
        Texels of the textured parts, P of them.
    opened : (V, 3)
        The face with its jaw slightly open.
    share : (P,)
        Share of the talker's colour in each texel, 0 to 1.
    in_mouth : (P,)
        Texels of the inner mouth, which are not changed.
    """

    texture: NDArray[np.uint8]
    texels: Texels
    opened: Floats
    share: Floats
    in_mouth: NDArray[np.bool_]


def build_canvas(face: Face) -> SkinCanvas:
    """The canvas of an adapted head.

    Raises
    ------
    DataError
        The head has no texture.
    """
    if face.uv is None or not face.textures:
        raise DataError("the head has no texture to paint a talker's skin on; build the shipped faces again")
    spans = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.texture == 0]
    triangles = np.concatenate(spans).astype(np.int64)
    skin = face.textures[0].pixels
    side = len(skin)
    texels = find_texels(face.uv.astype(np.float64), triangles, side)
    jaw = face.shapes[face.shape_names.index("jawOpen")]
    opened = face.vertices.astype(np.float64) + OPEN_JAW_WEIGHT * jaw
    island = texels.rows > ISLANDS_TOP * side - 1
    share = _front_share(face, texels, opened)
    share[island] = 0.0
    in_mouth = island & (texels.columns < 0.24 * side)
    return SkinCanvas(skin, texels, opened, soften_edges(share, texels, side), in_mouth)


def _front_share(face: Face, texels: Texels, opened: Floats) -> Floats:
    place = texels.interpolate(opened)
    marks = face_landmarks(face, opened)[:N_MESH_LANDMARKS]
    share = smoothstep(polygon_depth(place[:, :2], marks[list(FACE_OVAL), :2], RIM_MM[1] + 1), *RIM_MM)
    share[place[:, 2] < float(marks[list(FACE_OVAL), 2].min())] = 0.0
    share[_is_hidden(place)] = 0.0
    seen = np.flatnonzero(share)
    for edge, limits in ((INNER_LIPS, LIP_MM), *((lids, LID_MM) for lids in LID_RINGS)):
        depth = polygon_depth(place[seen, :2], marks[list(edge), :2], limits[1] + 1)
        share[seen] *= smoothstep(-depth, *limits)
    return share


def _is_hidden(place: Floats) -> NDArray[np.bool_]:
    """(P,) whether a texel is hidden by another."""
    cells = np.floor(place[:, :2] / CELL_MM).astype(np.int64)
    cells -= cells.min(axis=0)
    foremost = np.full(tuple(cells.max(axis=0) + 1), -np.inf)
    np.maximum.at(foremost, (cells[:, 0], cells[:, 1]), place[:, 2])
    hidden: NDArray[np.bool_] = place[:, 2] < foremost[cells[:, 0], cells[:, 1]] - HIDDEN_MM
    return hidden


def polygon_depth(places: Floats, polygon: Floats, most: float) -> Floats:
    """(P,) signed distance of points (P, 2) from a polygon's edge, positive inside, limited to `most`."""
    low, high = polygon.min(axis=0) - most, polygon.max(axis=0) + most
    near = np.flatnonzero(((places > low) & (places < high)).all(axis=1))
    depth = np.full(len(places), -most)
    found = np.zeros(len(near))
    _polygon_depths(places[near], polygon, found)
    depth[near] = found
    clipped: Floats = np.clip(depth, -most, most)
    return clipped


@kernel
def _polygon_depths(places, polygon, depths):  # type: ignore[no-untyped-def]
    """Write signed distances (P,) of points (P, 2) from a polygon's edge, positive inside (even-odd rule)."""
    for number in range(len(places)):
        x, y = places[number]
        least, is_inside = np.inf, False
        ax, ay = polygon[-1]
        for corner in range(len(polygon)):
            bx, by = polygon[corner]
            along_x, along_y = bx - ax, by - ay
            length = max(along_x * along_x + along_y * along_y, 1e-12)
            t = min(max(((x - ax) * along_x + (y - ay) * along_y) / length, 0.0), 1.0)
            least = min(least, np.hypot(x - ax - t * along_x, y - ay - t * along_y))
            if (ay > y) != (by > y) and x < ax + (y - ay) * along_x / along_y:
                is_inside = not is_inside
            ax, ay = bx, by
        depths[number] = least if is_inside else -least


def soften_edges(share: Floats, texels: Texels, side: int) -> Floats:
    """Blurred shares (P,) that do not exceed the original ones."""
    return np.minimum(share, texels.blurred(share[:, None], side, MASK_BLUR)[:, 0])


MAX_VIDEOS = 40  # evenly selected from more; means of 40 and 201 videos of GRID s1 differ by 0.05 mm
MAX_CLOSED_GAP = 0.02  # lip gap relative to the eye distance up to which lips count as closed
MIN_CLOSED_FRAMES = 10  # frames; with fewer, those with the smallest gaps are used
OPEN_EYES_PERCENTILE = 50  # of the eye openings: frames above it define lids at rest
RIGHT_LIDS, LEFT_LIDS = (159, 145), (386, 374)  # upper and lower, in the middle of each eye


@dataclass(frozen=True, slots=True, eq=False)
class TrackedPictures:
    """One video or photograph: `points` (T, 478, 3) pixels as tracked, `landmarks` (T, 478, 3) mm without pose.

    Both are NaN in frames without a face; frame i is the i-th of the file. A photograph has its picture with it, a
    mirrored one a small weight, and parted lips an opening (N, 2) between them, pixels, in which there is no skin.
    """

    file: Path
    points: NDArray[np.float32]
    landmarks: NDArray[np.float32]
    pictures: tuple[NDArray[np.uint8], ...] = ()
    weight: float = 1.0
    opening: Floats | None = None

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """The frames (H, W, 3) in their order.

        Raises
        ------
        DataError
            The video can no longer be read.
        """
        return iter(self.pictures) if self.pictures else (frame.pixels for frame in read_frames(self.file))


def find_videos(recordings: Path) -> tuple[Path, ...]:
    """The videos of a folder of recordings, or the given video; at most `MAX_VIDEOS`, evenly selected.

    Raises
    ------
    InputError
        There is no such folder or file, or no video in it.
    """
    if recordings.is_file() and recordings.suffix.lower() not in VIDEO_SUFFIXES:
        raise InputError(f"{recordings} is not a video ({', '.join(sorted(VIDEO_SUFFIXES))}); give one, or a folder")
    if recordings.is_file():
        return (recordings,)
    found = [recording.video for recording in find_recordings(recordings)]
    rows = np.unique(np.linspace(0, len(found) - 1, min(MAX_VIDEOS, len(found))).round().astype(int))
    return tuple(found[row] for row in rows)


def track_videos(videos: Sequence[Path], eyes: CachedTracker, on_progress: Progress) -> tuple[TrackedPictures, ...]:
    """Landmarks of the videos that can be read and show a face.

    Raises
    ------
    DataError
        There are none.
    """
    kept, reason = [], ""
    for number, video in enumerate(videos):
        try:
            found = eyes.track(video)
            posed = remove_pose(found.tracking.points, found.fps)
            kept.append(TrackedPictures(video, found.tracking.points, posed.landmarks))
        except DataError as refused:
            reason = f" ({video.name}: {refused})"
        on_progress(number + 1, len(videos))
    if not kept:
        raise DataError(f"no video shows a face{reason}; give videos of one person looking at the camera")
    return tuple(kept)


def resting_landmarks(videos: Sequence[TrackedPictures]) -> Floats:
    """(478, 3) mean landmarks in mm of the frames with closed lips and open eyes."""
    landmarks = np.concatenate([one.landmarks for one in videos])
    landmarks = landmarks[np.isfinite(landmarks[:, 0, 0])].astype(np.float64)
    gaps = lip_opening(landmarks)
    limit = max(MAX_CLOSED_GAP, float(np.sort(gaps)[min(MIN_CLOSED_FRAMES, len(gaps)) - 1]))
    open_eyes = eye_opening(landmarks)
    still = gaps <= limit
    wide = still & (open_eyes >= np.percentile(open_eyes[still], OPEN_EYES_PERCENTILE))
    mean: Floats = landmarks[wide].mean(axis=0)
    return mean


def eye_opening(landmarks: NDArray[np.floating]) -> Floats:
    """(T,) mean height of the two eye openings of (T, 478, 3) landmarks."""
    heights = [np.linalg.norm(landmarks[:, up] - landmarks[:, low], axis=1) for up, low in (RIGHT_LIDS, LEFT_LIDS)]
    return np.asarray(np.mean(heights, axis=0), np.float64)
