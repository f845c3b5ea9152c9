"""Comparison of made gaze with that of people: looks, jumps, and the share of the time on the partner's face."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from corpus_tools.training.gaze_recordings import (
    Fixations,
    Lengths,
    find_looks,
    jump_sizes,
    made_fixations,
    read_people,
)
from tts2face.gestures.gaze import GazeProcess
from tts2face.gestures.presentation import FrameContext
from tts2face.gestures.speech_plan import NO_PLAN
from tts2face.models.gaze import LISTENING, STATES, GazeModel, load_gaze
from tts2face.models.palette import GESTURE_FPS
from tts2face.numeric.arrays import FloatArray

MINUTES = 10  # of each made person in each state
FEWEST = 5  # complete looks or jumps of a person who is compared


@dataclass(frozen=True, slots=True, eq=False)
class Distribution:
    """Shares (n,) that are larger than values (n,), which increase: a survival function."""

    values: FloatArray
    shares: FloatArray

    def at(self, values: FloatArray) -> FloatArray:
        """Shares that are larger than other values."""
        behind = np.searchsorted(self.values, values, side="right") - 1
        return np.where(behind >= 0, self.shares[np.maximum(behind, 0)], 1.0)

    def distance(self, other: "Distribution") -> float:
        """Kolmogorov-Smirnov distance, up to the shorter of the last values."""
        both = np.concatenate([self.values, other.values])
        both = both[both <= min(self.values[-1], other.values[-1])]
        return float(np.abs(self.at(both) - other.at(both)).max(initial=0.0))


def survival(lengths: Lengths) -> Distribution:
    """Shares of lengths that last longer, where some are not complete (Kaplan and Meier 1958)."""
    order = np.argsort(lengths.seconds, kind="stable")
    at_risk = len(order) - np.arange(len(order))
    kept = 1.0 - lengths.is_complete[order] / at_risk
    return Distribution(lengths.seconds[order], np.cumprod(kept, dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class GazeMeasures:
    """Measures of a person in a state; a distribution is None where there are fewer than `FEWEST` values."""

    face: Distribution | None
    away: Distribution | None
    jumps: Distribution | None
    share: float


TRAITS: Mapping[str, Callable[[GazeMeasures, GazeMeasures], float]] = {
    "looks at the face": lambda person, other: _distance(person.face, other.face),
    "looks away": lambda person, other: _distance(person.away, other.away),
    "jumps": lambda person, other: _distance(person.jumps, other.jumps),
    "share on the face": lambda person, other: abs(person.share - other.share),
}


@dataclass(frozen=True, slots=True)
class GazeComparison:
    """A trait in a state: median distances between two people, and between a made person and one of them."""

    state: str
    trait: str
    people: float
    made: float

    @property
    def is_met(self) -> bool:
        """Whether a made person is no further from people than they are from each other."""
        return self.made <= self.people


@dataclass(frozen=True, slots=True, eq=False)
class GazeStudy:
    """Measures of people and of made people by state, and what they give."""

    people: Mapping[str, tuple[GazeMeasures, ...]]
    made: Mapping[str, tuple[GazeMeasures, ...]]
    comparisons: tuple[GazeComparison, ...]


def study_gaze(folder: Path, *, n_made: int = 60, seed: int = 0, model: GazeModel | None = None) -> GazeStudy:
    """Compare the people of a folder with as many made ones; errors as `read_people`."""
    return compare([*read_people(folder).values()], model or load_gaze(), n_made=n_made, seed=seed)


def compare(people: Sequence[Mapping[str, Fixations]], model: GazeModel, *, n_made: int, seed: int) -> GazeStudy:
    """Compare people with made ones, whom the model draws."""
    measured = {state: tuple(measures(person[state]) for person in people) for state in STATES}
    made = {state: tuple(measures(made_person(model, state, seed + at)) for at in range(n_made)) for state in STATES}
    found = []
    for state in STATES:
        for trait, distance in TRAITS.items():
            between = [distance(taken, other) for taken, other in combinations(measured[state], 2)]
            to_made = [distance(item, other) for item in measured[state] for other in made[state]]
            found.append(GazeComparison(state, trait, float(np.nanmedian(between)), float(np.nanmedian(to_made))))
    return GazeStudy(measured, made, tuple(found))


def made_person(model: GazeModel, state: str, seed: int) -> Fixations:
    """Fixations of a drawn person who stays in a state."""
    process = GazeProcess.of_person(model, [seed])
    times = np.arange(MINUTES * 60 * GESTURE_FPS) / GESTURE_FPS
    listens, level = np.full(len(times), state == LISTENING), np.zeros(len(times), np.float32)
    process.extend(FrameContext(times, level, NO_PLAN, np.ones(len(times), bool), listens))
    return made_fixations(process.fixations[1:], float(times[-1]))


def measures(fixations: Fixations) -> GazeMeasures:
    """Measures of a person in a state."""
    looks, jumps = find_looks(fixations), jump_sizes(fixations.merged())
    known = Lengths(jumps, np.ones(len(jumps), bool))
    return GazeMeasures(
        _distribution(looks.face), _distribution(looks.away), _distribution(known), fixations.share_on_face
    )


def _distribution(lengths: Lengths) -> Distribution | None:
    return survival(lengths) if lengths.is_complete.sum() >= FEWEST else None


def _distance(own: Distribution | None, other: Distribution | None) -> float:
    return float("nan") if own is None or other is None else own.distance(other)
