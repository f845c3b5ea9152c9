"""Corrections by a person of what was found in a photograph: lips, lids, teeth and pivot, in a file of JSON.

Places are pixels of the upright picture as the file has it, x right and y down from its left top corner; lines go from
the left of the picture to its right. The format is described in docs/photo.md.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, make_dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from lexicon.errors import DataError, InputError
from lexicon.values.json_text import read_json
from lexicon.values.records import checked, errors_at
from tts2face.numeric.arrays import FloatArray
from tts2face.photo.lines import InnerLips, LidLines
from tts2face.storage.files import write_atomically

LINES = {"lips": ("upper", "lower", "seam"), "right_eye": ("upper", "lower"), "left_eye": ("upper", "lower")}
POINTS = ("teeth", "pivot")
LEAST_POINTS, MOST_POINTS = 3, 200  # of a line
LIP_STEP, LID_STEP = 4, 3  # of the points of a line, one of so many is written
SAME_PX = 0.15  # between ends of lines that are the same point
DIGITS = 1  # of pixels that are written
BACKWARDS = 0.5  # of a step of a line, against its direction: at their corners lids may begin so
CROSSING = 0.01  # of the eye distance, by which lines may cross at the corners, as the tracker's do
MOST_OFF = 0.8  # of the eye distance, between the middles of a line that is given and of the one that was found
N_FINE = 400  # places along a line by which its length is measured
_Point = Annotated[tuple[float, float], "[x, y] in pixels"]
_Parts: dict[str, Any] = {
    part: make_dataclass(part, [(edge, tuple[_Point, ...] | None, None) for edge in LINES[part]]) for part in LINES
}


@dataclass(frozen=True, slots=True, eq=False)
class PhotoFit:
    """Places that replace what was found in a photograph: lines (N, 2) by the names of `LINES`, points by `POINTS`.

    ``seam`` is the line between lips that touch; the edges of parted ones, and those of the lids of the person's right
    and left eye, are ``upper`` and ``lower``. ``teeth`` is the middle of the edge of the upper teeth, ``pivot`` the
    point about which the head turns.
    """

    lines: Mapping[tuple[str, str], FloatArray]
    points: Mapping[str, FloatArray]
    name: str = "the fit"

    def __post_init__(self) -> None:
        """Check the lines."""
        for (part, edge), line in self.lines.items():
            if not LEAST_POINTS <= len(line) <= MOST_POINTS:
                raise InputError(f"{part}.{edge} has {len(line)} points; give {LEAST_POINTS} to {MOST_POINTS}")
            along = line[-1] - line[0]
            if along[0] <= 0 or not all(_goes_on(step, along) for step in np.diff(line, axis=0)):
                raise InputError(f"{part}.{edge} must go from the left of the picture to its right, point by point")
        for part, edges in LINES.items():
            given = [edge for edge in edges if (part, edge) in self.lines]
            if "seam" in given and len(given) > 1:
                raise InputError(f"{part} has a seam and parted edges; give the seam of lips that touch, or the edges")
            if len(given) > 1:
                upper, lower = (self.lines[part, edge] for edge in given)
                if np.abs(upper[[0, -1]] - lower[[0, -1]]).max() > SAME_PX:
                    raise InputError(f"{part}.upper and {part}.lower must begin and end at the same points")

    def as_json(self) -> dict[str, Any]:
        """The fit as an object of JSON."""
        content: dict[str, Any] = {}
        for (part, edge), line in self.lines.items():
            content.setdefault(part, {})[edge] = _rounded(line)
        return content | {name: _rounded(point) for name, point in self.points.items()}


NOTHING_GIVEN = PhotoFit({}, {})
_Written: Any = make_dataclass(
    "_Written", [(part, _Parts.get(part, _Point) | None, None) for part in (*LINES, *POINTS)]
)


def _rounded(places: FloatArray) -> Any:
    return np.round(places, DIGITS).tolist()


def parse_fit(content: Any, name: str = "the fit") -> PhotoFit:
    """A fit from its object of JSON.

    Raises
    ------
    DataError
        It is none; the message begins with `name`.
    """
    given = {part: value for part, value in vars(checked(_Written, content, name)).items() if value is not None}
    lines = {
        (part, edge): np.array(line).reshape(-1, 2)
        for part in LINES
        for edge, line in (vars(given[part]) if part in given else {}).items()
        if line is not None
    }
    with errors_at(name):
        return PhotoFit(lines, {point: np.array(given[point]) for point in POINTS if point in given}, name)


def read_fit(path: Path) -> PhotoFit:
    """A fit from a file."""
    try:
        return parse_fit(read_json(path), str(path))
    except OSError as refused:
        raise InputError(f"cannot read the fit {path}: {refused.strerror}; check the path") from refused


def write_fit(path: Path, fit: Mapping[str, Any]) -> None:
    """Write a fit, an object of JSON, with one line of the file for each of its parts."""
    parts = (f" {json.dumps(name)}: {json.dumps(part)}" for name, part in fit.items())
    write_atomically(path, ("{\n" + ",\n".join(parts) + "\n}\n").encode())


@dataclass(frozen=True, slots=True, eq=False)
class PhotoPlaces:
    """Places of a fit in a picture of a size (width, height), of which `reduced_by` pixels of the file make one.

    ``scale`` is the eye distance in pixels of the picture.
    """

    fit: PhotoFit
    size: tuple[int, int]
    reduced_by: float
    scale: float

    def point(self, name: str, found: FloatArray) -> FloatArray:
        """A point (3,), pixels and depth, with the place that is given for it.

        Raises
        ------
        DataError
            It lies farther outside the picture than that is large.
        """
        if name not in self.fit.points:
            return found
        given = self._placed(name, self.fit.points[name][None], margin=1.0)[0]
        return np.array([*given, found[2]])

    def lips(self, found: InnerLips) -> InnerLips:
        """Edges of the lips with the lines that are given; errors as `lids`."""
        if ("lips", "seam") in self.fit.lines:
            seam = self._line("lips", "seam", (found.upper + found.lower) / 2)
            return InnerLips(seam, seam.copy(), 0.0)
        if not any(part == "lips" for part, _ in self.fit.lines):
            return found
        upper, lower = self._opening("lips", found.upper, found.lower)
        gap = float(np.linalg.norm((upper - lower)[:, :2], axis=1).max() / self.scale)
        lips = InnerLips(upper, lower, gap)
        return InnerLips((upper + lower) / 2, (upper + lower) / 2, gap) if lips.is_closed else lips

    def lids(self, found: LidLines) -> LidLines:
        """Margins of the lids with the lines that are given.

        Raises
        ------
        DataError
            A point lies outside the picture, a line far from what was found, or lines cross.
        """
        eyes = []
        for part, upper, lower, step in zip(("right_eye", "left_eye"), found.upper, found.lower, (1, -1), strict=True):
            given = self._opening(part, upper[::step], lower[::step])
            is_given = any((part, edge) in self.fit.lines for edge in LINES[part])
            if is_given and _gaps(*given)[len(given[0]) // 2] < CROSSING * self.scale:
                raise DataError(f"{self.fit.name}: the lids of {part} are shut; give those of an open eye")
            eyes.append([line[::step] for line in given])
        (right, left) = eyes
        return LidLines((right[0], left[0]), (right[1], left[1]), found.fold)

    def used(self, lips: InnerLips, lids: LidLines, points: Mapping[str, FloatArray]) -> PhotoFit:
        """The fit that gives these lines and points (3,), pixels and depths."""
        lines = {("lips", "seam"): lips.upper} if lips.is_closed else {}
        if not lips.is_closed:
            lines = {("lips", "upper"): lips.upper, ("lips", "lower"): lips.lower}
        lines = {key: line[::LIP_STEP] for key, line in lines.items()}
        for part, upper, lower, step in zip(("right_eye", "left_eye"), lids.upper, lids.lower, (1, -1), strict=True):
            lines |= {(part, "upper"): upper[::LID_STEP][::step], (part, "lower"): lower[::LID_STEP][::step]}
        corner, size = np.zeros(2), np.array(self.size) * self.reduced_by
        return PhotoFit(
            {key: _forward(np.clip(self._of_file(line), corner, size)) for key, line in lines.items()},
            {name: self._of_file(point) for name, point in points.items()},
        )

    def _of_file(self, places: FloatArray) -> FloatArray:
        found: FloatArray = (places[..., :2] + 0.5) * self.reduced_by
        return found

    def _placed(self, name: str, places: FloatArray, margin: float = 0.0) -> FloatArray:
        """Pixels (N, 2) of the picture of places of the file, which may lie outside it by a share of its size."""
        size = np.array(self.size) * self.reduced_by
        outside = ((places < -margin * size) | (places > (1 + margin) * size)).any(axis=1)
        if outside.any():
            x, y = places[outside][0]
            raise DataError(
                f"{self.fit.name}: the point [{x:g}, {y:g}] of {name} lies outside the picture, which has "
                f"{size[0]:.0f} x {size[1]:.0f} pixels; give a place in it"
            )
        return places / self.reduced_by - 0.5

    def _line(self, part: str, edge: str, found: FloatArray) -> FloatArray:
        """The line (N, 3) that is given in place of one that was found, with its depths."""
        given = self._placed(f"{part}.{edge}", self.fit.lines[part, edge])
        off = float(np.linalg.norm(given.mean(axis=0) - found[:, :2].mean(axis=0)))
        if off > MOST_OFF * self.scale:
            raise DataError(
                f"{self.fit.name}: {part}.{edge} lies {off * self.reduced_by:.0f} pixels from the face that was found; "
                "give the fit of this picture and face"
            )
        shares = _shares(found[:, :2])
        ways = PchipInterpolator(_shares(given), given)
        fine = ways(np.linspace(0, 1, N_FINE))
        at = _shares(fine)
        return np.column_stack([*(np.interp(shares, at, fine[:, axis]) for axis in (0, 1)), found[:, 2]])

    def _opening(self, part: str, upper: FloatArray, lower: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Upper and lower line (N, 3) of an opening; one that is not given moves with the corners of the other."""
        lines = [upper, lower]
        given = [(part, edge) in self.fit.lines for edge in ("upper", "lower")]
        if not any(given):
            return upper, lower
        for number, edge in enumerate(("upper", "lower")):
            if given[number]:
                lines[number] = self._line(part, edge, lines[number])
        if not all(given):
            known = given.index(True)
            lines[1 - known] = _with_corners(lines[1 - known], lines[known])
        first, second = lines
        gaps = _gaps(first, second)
        if gaps.min() < -CROSSING * self.scale:
            x, y = self._of_file(first[int(gaps.argmin())])
            raise DataError(f"{self.fit.name}: the upper and the lower line of {part} cross near [{x:.0f}, {y:.0f}]")
        crossed = gaps <= 0
        crossed[[0, -1]] = True
        first[crossed] = second[crossed] = ((first + second) / 2)[crossed]
        return first, second


def _gaps(upper: FloatArray, lower: FloatArray) -> FloatArray:
    """(N,) distance of lines, pixels, down from the line between the corners."""
    along = upper[-1, :2] - upper[0, :2]
    down = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    found: FloatArray = (lower - upper)[:, :2] @ down
    return found


def _with_corners(line: FloatArray, other: FloatArray) -> FloatArray:
    """A line (N, 3) whose ends are those of another one."""
    share = _shares(line[:, :2])[:, None]
    moved: FloatArray = line + (1 - share) * (other[0] - line[0]) + share * (other[-1] - line[-1])
    return moved


def _shares(line: FloatArray) -> FloatArray:
    """(N,) share of the length of a line at each of its points."""
    ways = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
    found: FloatArray = ways / ways[-1]
    return found


def _goes_on(step: FloatArray, along: FloatArray) -> bool:
    """Whether a step (2,) of a line goes on, not more than a little back from its end, which lies `along` (2,)."""
    length = float(np.linalg.norm(step))
    return length > 0 and float(step @ along) >= -BACKWARDS * length * float(np.linalg.norm(along))


def _forward(line: FloatArray) -> FloatArray:
    """The points (M, 2) of a line that go on."""
    along = line[-1] - line[0]
    kept = [line[0]]
    for place in line[1:-1]:
        if _goes_on(place - kept[-1], along) and _goes_on(line[-1] - place, along):
            kept.append(place)
    return np.array([*kept, line[-1]])
