"""Fixations of people in remote conversations, and the looks at the partner's face and away that they form.

Read are tables of fixations and passages as ``../shared/recordings/gaze_dialogue`` has them; its README says how they
came about, what is missing and how places were inferred. The same measures apply to made fixations.
"""

import csv
import gzip
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.gestures.gaze import LEAST_JUMP_DEG, Fixation
from tts2face.models.gaze import FACE_DEG, LISTENING, SPEAKING
from tts2face.numeric.arrays import FloatArray

PX_PER_DEG = np.array([40.3, 41.6])  # down and across, at the middle of the screen
CONDITIONS: Mapping[str, str] = {SPEAKING: "SPEAK", LISTENING: "LISTEN"}
LONGEST_GAP_S = 1.0  # of a chain of fixations; longer gaps may hide a look


@dataclass(frozen=True, slots=True, eq=False)
class Fixations:
    """Fixations of a person in one state, in order.

    Parameters
    ----------
    start, duration : (n,)
        Seconds.
    place : (n, 2)
        Degrees down and to the person's left of the partner's face.
    segment, passage : (n,)
        Numbers that change where tracking was lost, and where the labelled stretch of talk ended.
    """

    start: FloatArray
    duration: FloatArray
    place: FloatArray
    segment: NDArray[np.int64]
    passage: NDArray[np.int64]

    @property
    def is_on_face(self) -> NDArray[np.bool_]:
        """(n,) whether each is on the partner's face."""
        return np.asarray(np.linalg.norm(self.place, axis=1) < FACE_DEG)

    @property
    def share_on_face(self) -> float:
        """Share of the time of fixations."""
        return float(self.duration[self.is_on_face].sum() / self.duration.sum())

    def merged(self) -> "Fixations":
        """The fixations, with those of one segment that are less than `LEAST_JUMP_DEG` apart joined."""
        first = [0]
        place, weight = self.place[0], self.duration[0]
        places = [place]
        for at in range(1, len(self.start)):
            gap = np.linalg.norm(self.place[at] - place)
            # smaller shifts are those of microsaccades, or noise
            if self.segment[at] == self.segment[at - 1] and gap < LEAST_JUMP_DEG:
                weight += self.duration[at]
                place = place + (self.place[at] - place) * self.duration[at] / weight
                places[-1] = place
            else:
                place, weight = self.place[at], self.duration[at]
                first.append(at)
                places.append(place)
        ends = self.start + self.duration
        last = np.append(first[1:], len(self.start)) - 1
        start = self.start[first]
        return Fixations(start, ends[last] - start, np.array(places), self.segment[first], self.passage[first])


@dataclass(frozen=True, slots=True, eq=False)
class Lengths:
    """Seconds (n,) of looks or fixations, and whether the end of each was seen."""

    seconds: FloatArray
    is_complete: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """Looks of a person in one state: lengths of those at the face and away, and where the latter land, (n, 2)."""

    face: Lengths
    away: Lengths
    landed: FloatArray


def read_people(folder: Path) -> Mapping[str, Mapping[str, Fixations]]:
    """Fixations by person and state.

    Raises
    ------
    InputError
        The folder has no such recordings.
    DataError
        A table lacks a column, or a value is no number.
    """
    tables = sorted(folder.glob("person*.tsv.gz"))
    if not tables or not (folder / "passages.tsv").is_file():
        raise InputError(f"there are no recordings of gaze in {folder}; give the folder of passages.tsv")
    try:
        with (folder / "passages.tsv").open(encoding="utf-8") as file:
            faces = {
                (int(row["person"]), int(row["passage"])): np.array([float(row["face_y"]), float(row["face_x"])])
                for row in csv.DictReader(file, delimiter="\t")
            }
        return {path.name[:8]: _read_person(path, faces) for path in tables}
    except (KeyError, ValueError) as wrong:
        raise DataError(f"{folder}: a table of fixations cannot be read: {wrong!r}; see its README") from wrong


def _read_person(path: Path, faces: Mapping[tuple[int, int], FloatArray]) -> Mapping[str, Fixations]:
    with gzip.open(path, "rt", encoding="utf-8") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    number = int(path.name[6:8])
    found = {}
    for state, condition in CONDITIONS.items():
        chosen = [row for row in rows if row["condition"] == condition]
        passage = np.array([int(row["passage"]) for row in chosen])
        face = np.array([faces[number, int(at)] for at in passage])
        # The screen's x grows to the person's right.
        apart = (np.array([[float(row["y"]), float(row["x"])] for row in chosen]) - face) / PX_PER_DEG * [1.0, -1.0]
        start, duration = (np.array([float(row[name]) for row in chosen]) for name in ("start", "duration"))
        segment = 1000 * passage + np.array([int(row["segment"]) for row in chosen])
        found[state] = Fixations(start, duration, apart, segment, passage)
    return found


def made_fixations(made: Sequence[Fixation], end_s: float) -> Fixations:
    """Fixations of a process up to a time, as if they had been recorded without a gap."""
    start = np.array([curve.time for curve in made])
    duration = np.diff(start, append=end_s)
    whole = np.zeros(len(made), np.int64)
    return Fixations(start, duration, np.array([curve.place for curve in made]), whole, whole)


def find_looks(fixations: Fixations) -> Looks:
    """Looks from the onset of their first fixation to the onset on the other side.

    A look whose beginning was not seen does not count; one that a gap ends is not complete.
    """
    ends = fixations.start + fixations.duration
    gap = fixations.start[1:] - ends[:-1] > LONGEST_GAP_S
    broken = np.concatenate([[True], gap | (np.diff(fixations.passage) != 0), [True]])
    on_face = fixations.is_on_face
    changed = np.concatenate([[True], on_face[1:] != on_face[:-1], [True]])
    first = np.flatnonzero((broken | changed)[:-1])
    behind = np.append(first[1:], len(on_face))
    is_seen = ~broken[first]
    is_complete = ~broken[behind]
    until = np.where(is_complete, fixations.start[np.minimum(behind, len(on_face) - 1)], ends[behind - 1])
    seconds = until - fixations.start[first]

    def lengths(side: bool) -> Lengths:
        chosen = is_seen & (on_face[first] == side)
        return Lengths(seconds[chosen], is_complete[chosen])

    return Looks(lengths(True), lengths(False), fixations.place[first[is_seen & ~on_face[first]]])


def jump_sizes(merged: Fixations) -> FloatArray:
    """(n,) degrees of the jumps of at least `LEAST_JUMP_DEG` between merged fixations of one segment."""
    jumps = np.linalg.norm(np.diff(merged.place, axis=0), axis=1)
    return np.asarray(jumps[(np.diff(merged.segment) == 0) & (jumps >= LEAST_JUMP_DEG)])
