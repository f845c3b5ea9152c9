"""Learns the distribution over people of how they look at a partner in conversation (`tts2face.models.gaze`).

Lengths are log-normal, fitted to complete and incomplete ones by maximum likelihood: on people who were left out the
likelihood was higher than that of exponential, Weibull and log-logistic ones, for looks at the face and away, in
speaking and listening; and that of a distribution over people was higher than that of all people pooled. Factors that
parameters share gained nothing (docs/decisions/188).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_ndtr

from corpus_tools.training.gaze_recordings import Fixations, Lengths, find_looks, read_people
from tts2face.gestures.gaze import LEAST_JUMP_DEG
from tts2face.models.gaze import DIRECTIONS, FACE_DEG, PARAMETERS, STATES, GazeModel
from tts2face.numeric.arrays import FloatArray

SOURCE = {
    "source": "github.com/psyberlab/eye-gaze-during-conversation-dataset at e156145: fixations of 15 people",
    "licence": "Apache-2.0",
    "paper": "Dembinsky, Watanabe, Dengel and Ishimaru, ETRA 2024, doi 10.1145/3649902.3653337",
    "content": "mean and spread over people of the parameters of looks; no recording, no person",
}
MIN_LENGTH_S = 0.05
FEW = 10.0  # observations that the mean of all people counts as in a person's own parameters
PSEUDO_COUNT = 0.5  # of each direction


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Parameters (P,) of a person in a state, and how many observations each rests on."""

    values: FloatArray
    counts: FloatArray


def learn_gaze(folder: Path) -> GazeModel:
    """Distribution over the people of a folder; errors as `read_people`."""
    return fit_people([*read_people(folder).values()])


def fit_people(people: Sequence[Mapping[str, Fixations]]) -> GazeModel:
    """Distribution over people from the fixations of each by state."""
    found = [[estimate(person[state]) for state in STATES] for person in people]
    values, counts = (
        np.array([[getattr(item, name) for item in row] for row in found]) for name in ("values", "counts")
    )
    mean = (values * counts).sum(axis=0) / counts.sum(axis=0)
    apart = counts / (counts + FEW) * (values - mean)
    mean = mean + apart.mean(axis=0)
    mean[:, PARAMETERS.index("left")] = 0.0  # the side that people prefer is that of their screen; both are alike
    return GazeModel(mean, apart.std(axis=0, ddof=1), SOURCE)


def estimate(fixations: Fixations) -> Estimate:
    """Parameters of a person in one state."""
    looks, merged = find_looks(fixations), fixations.merged()
    within = _fixation_lengths(merged)
    on_face = merged.is_on_face
    far = np.maximum(np.linalg.norm(looks.landed, axis=1) - FACE_DEG, 0.1)
    same = np.diff(merged.segment) == 0
    jumps = np.linalg.norm(np.diff(merged.place, axis=0), axis=1)
    roams, shifts = (jumps[same & (on_face[1:] == side) & (on_face[:-1] == side)] for side in (False, True))
    shifts = shifts[shifts >= LEAST_JUMP_DEG]
    # Jumps between places of a circular normal distribution are Rayleigh, without the small ones.
    spot = np.sqrt(max(float((np.square(shifts) - LEAST_JUMP_DEG**2).mean()) / 4, 0.1)) if len(shifts) else 1.0
    lengths = {
        "face": looks.face,
        "away": looks.away,
        "beyond": _known(far),
        "face_fixation": Lengths(within.seconds[on_face], within.is_complete[on_face]),
        "away_fixation": Lengths(within.seconds[~on_face], within.is_complete[~on_face]),
        "roam": _known(roams[roams >= LEAST_JUMP_DEG]),
    }
    named = {"spot": (float(np.log(spot)), float(len(shifts))), **_directions(looks.landed)}
    for name, length in lengths.items():
        median, spread = fit_lognormal(length)
        n = float(length.is_complete.sum())
        named |= {name: (median, n), f"{name}_spread": (spread, n)}
    values, counts = np.array([named[name] for name in PARAMETERS]).T
    return Estimate(values, counts + 1e-3)


def fit_lognormal(lengths: Lengths) -> tuple[float, float]:
    """Logarithms of median and spread, by maximum likelihood; the spread is drawn a little towards 1."""
    if not lengths.is_complete.any():
        return 0.0, 0.0
    logs = np.log(np.maximum(lengths.seconds, MIN_LENGTH_S))

    def cost(at: FloatArray) -> float:
        spread = np.exp(at[1])
        z = (logs - at[0]) / spread
        likelihood = np.where(lengths.is_complete, -0.5 * z * z - at[1], log_ndtr(-z))
        return float(0.5 * at[1] ** 2 - likelihood.sum())

    found = minimize(cost, [float(np.median(logs)), 0.0], method="Nelder-Mead")
    return float(found.x[0]), float(found.x[1])


def _known(values: FloatArray) -> Lengths:
    return Lengths(values, np.ones(len(values), bool))


def _fixation_lengths(merged: Fixations) -> Lengths:
    """Seconds to the onset of the next fixation; the last one of a segment is not complete."""
    is_complete = np.append(np.diff(merged.segment) == 0, [False])
    after = np.append(merged.start[1:], np.inf)
    return Lengths(np.where(is_complete, after - merged.start, merged.duration), is_complete)


def _directions(landed: FloatArray) -> dict[str, tuple[float, float]]:
    """Logarithms of the shares of directions (n, 2) against the sides, and of left against right."""
    down, left = landed.T
    is_side = np.abs(left) >= np.abs(down)
    n = {"side": is_side.sum(), "up": (~is_side & (down < 0)).sum(), "down": (~is_side & (down >= 0)).sum()}
    n |= {"left": (is_side & (left > 0)).sum(), "right": (is_side & (left <= 0)).sum()}

    def share(side: str, against: str) -> float:
        return float(np.log((n[side] + PSEUDO_COUNT) / (n[against] + PSEUDO_COUNT)))

    total = float(len(landed))
    against = {name: share(name, DIRECTIONS[0]) for name in DIRECTIONS[1:]}
    return {name: (value, total) for name, value in (against | {"left": share("left", "right")}).items()}
