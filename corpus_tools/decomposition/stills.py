"""Captured stills of basis expressions: pictures, instants of videos, or static marker captures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.markers import MarkerFace, read_marker_still
from corpus_tools.recordings.folder import VIDEO_SUFFIXES
from lexicon.errors import DataError, InputError
from tts2face.models.palette import EXPRESSIONS
from tts2face.numeric.arrays import FloatArray
from tts2face.storage.pictures import open_picture
from tts2face.video.media import TimedFrame, read_frames
from tts2face.video.pose import remove_pose
from tts2face.video.tracking import FaceTracker

NEUTRAL = "neutral"
PICTURE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"})
MARKER_SUFFIXES = frozenset({".c3d", ".csv", ".trc"})
LAST_FRAME_S = 0.1  # how long a video's last frame is shown at most


@dataclass(frozen=True, slots=True)
class Still:
    """A picture or static capture, or the instant `at` (seconds) of a video."""

    path: Path
    at: float | None = None

    def __str__(self) -> str:
        """As it was named."""
        return str(self.path) if self.at is None else f"{self.path}@{self.at:g}"

    @property
    def is_markers(self) -> bool:
        """Whether it is a file of markers."""
        return self.path.suffix.lower() in MARKER_SUFFIXES


def find_stills(folder: Path) -> dict[str, Still]:
    """Stills of a folder whose files are named as their expressions: sad.png, happy.png, ..., neutral.png.

    Raises
    ------
    InputError
        There is no such folder, or two files for one expression.
    """
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; give the folder of stills, or sad=FILE happy=FILE ...")
    known = PICTURE_SUFFIXES | MARKER_SUFFIXES
    files = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in known]
    named = [f"{path.stem.lower()}={path}" for path in files if path.stem.lower() in (*EXPRESSIONS, NEUTRAL)]
    return parse_stills(named)


def parse_stills(named: Sequence[str]) -> dict[str, Still]:
    """Stills from ``sad=FILE``; an instant of a video is ``sad=VIDEO@SECONDS``.

    Raises
    ------
    InputError
        A name is no expression or comes twice, a file is missing or of no known kind, or a video has no instant.
    """
    stills: dict[str, Still] = {}
    for entry in named:
        name, equals, place = entry.partition("=")
        if not equals or name not in (*EXPRESSIONS, NEUTRAL):
            raise InputError(
                f"{entry!r} names no still; write one of {', '.join((*EXPRESSIONS, NEUTRAL))}, = and a file"
            )
        if name in stills:
            raise InputError(f"there are two stills for {name}, {stills[name]} and {place}; give one")
        stills[name] = _parse_still(place)
    return stills


def required_stills(stills: Mapping[str, Still], *, is_rest_known: bool) -> tuple[str, ...]:
    """Names of the stills that a basis takes."""
    needed = EXPRESSIONS if is_rest_known else (NEUTRAL, *EXPRESSIONS)
    missing = [name for name in needed if name not in stills]
    if missing:
        raise InputError(f"there is no still for {', '.join(missing)}; a basis takes {', '.join(needed)}")
    return needed


class PictureReader:
    """Reads landmarks of stills, in mm of the canonical face, by the tracker that reads recordings."""

    def __init__(self, model: Path | None = None) -> None:
        self._tracker = FaceTracker(model)

    def __call__(self, still: Still) -> FloatArray:
        """(478, 3) landmarks without head pose.

        Raises
        ------
        DataError
            It cannot be read, or shows no face.
        """
        pixels = _read_pixels(still)
        tracking = self._tracker.track(lambda: [pixels], 1.0)
        if tracking.is_missing[0]:
            raise DataError(f"{still} shows no face; take another picture, lit well and facing the camera")
        return np.asarray(remove_pose(tracking.points, 1.0).landmarks[0], np.float64)


def build_marker_reader(rest: MarkerFace) -> Callable[[Still], FloatArray]:
    """Reader of static marker captures of a person, in the person's own size."""
    return lambda still: read_marker_still(still.path, rest)


def _parse_still(place: str) -> Still:
    path, _, at = place.rpartition("@")
    if path and Path(path).suffix.lower() in VIDEO_SUFFIXES:
        try:
            still = Still(Path(path), float(at))
        except ValueError as broken:
            raise InputError(f"{place!r} has no seconds behind the @; write VIDEO@12.5") from broken
    else:
        still = Still(Path(place))
    suffix = still.path.suffix.lower()
    if not still.path.is_file():
        raise InputError(f"there is no still {still.path}; check the path")
    if still.at is None and suffix in VIDEO_SUFFIXES:
        raise InputError(f"{still.path} is a video; give an instant, as {still.path}@12.5")
    if suffix not in PICTURE_SUFFIXES | MARKER_SUFFIXES | VIDEO_SUFFIXES:
        raise InputError(f"{still.path} is no picture, video or capture of markers; give one")
    return still


def _read_pixels(still: Still) -> NDArray[np.uint8]:
    if still.at is not None:
        return _read_frame(still, still.at)
    from PIL import ImageOps

    with open_picture(still.path, "the still") as image:
        return np.array(ImageOps.exif_transpose(image).convert("RGB"))


def _read_frame(still: Still, at: float) -> NDArray[np.uint8]:
    """The frame of a video that is shown at an instant."""
    shown: TimedFrame | None = None
    for picture in read_frames(still.path):
        # the frame that a player shows at this time began before it
        if shown is not None and picture.time > at:
            return shown.pixels
        shown = picture
    if shown is None or not 0.0 <= at <= shown.time + LAST_FRAME_S:
        ends = "holds no picture" if shown is None else f"ends at {shown.time:.2f} s"
        raise InputError(f"{still.path} {ends}; {at:g} s is beyond it")
    return shown.pixels
