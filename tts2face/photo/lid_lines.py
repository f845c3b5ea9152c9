"""Margins of the lids of a photograph, and the folds above them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import LEFT_LIDS, RIGHT_LIDS
from tts2face.photo.colours import lab_at
from tts2face.photo.lip_line import spline_weights

Floats = NDArray[np.float64]

LID_MARGINS = (RIGHT_LIDS, LEFT_LIDS)  # of the person, which the picture shows on its left and right
N_LID = 25  # points along the margin of a lid, from the outer corner to the inner one
BELOW = ((230, 231, 229, 118, 119, 117), (450, 451, 449, 347, 348, 346))  # landmarks of skin below the eyes
ABOVE = ((225, 224, 223, 222), (445, 444, 443, 442))  # and between folds and brows
LID_BLUR = 0.004  # of the eye distance, as all lengths below
HUE_SPREAD, BRIGHT_SPREAD = 8.0, 30.0  # of the colours of skin in Lab
LOWER_STEPS = np.arange(-0.012, 0.17, 0.006)  # of lower lids that are tried; drawn eyes are larger than the tracker's
INSIDE, OUTSIDE = 0.012, 0.016  # of a lower lid, where the eye and skin are compared
COST = 1.2  # of a step, over its length
GAIN, LEAST_STEP = 0.15, 0.012  # of a step that is taken
LARGE_EYES, LARGE_EYES_TRUST = 0.165, 0.4  # opening of drawn eyes, and the share of cost and gain that they need
LARGE_EYES_MORE = 0.025  # so that no rim of the eye is left when its lids are shut
CORNER_STEPS, CORNER_SKIN = np.arange(0.006, 0.05, 0.006), 0.25  # of corners, up to where there is skin
MIDDLE = slice(4, -4)
FOLD_STEPS = np.arange(0.04, 0.13, 0.006)  # of the fold above an upper lid: where skin begins
FOLD_ROOM = 0.75  # of the way to the skin below the brow, at most
FOLD_COLUMNS = slice(6, -6)
FOLD_SKIN = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class LidLines:
    """Margins of the lids: the upper and lower one (25, 3) of each eye, pixels and depths; equal in the corners.

    The folds lie `fold` pixels above the upper margins.
    """

    upper: tuple[Floats, Floats]
    lower: tuple[Floats, Floats]
    fold: float


def find_lid_lines(pixels: NDArray[np.uint8], landmarks: Floats, scale: float) -> LidLines:
    """Margins of the lids in a picture (H, W, 3) from landmarks (478, 3); `scale` is the eye distance, pixels."""
    weights = spline_weights(len(RIGHT_LIDS[0]), N_LID)
    lines = [[weights @ landmarks[list(numbers)] for numbers in lids] for lids in LID_MARGINS]
    eyes = [_Eye(pixels, landmarks, upper, lower, scale, eye) for eye, (upper, lower) in enumerate(lines)]
    step = _lower_step(eyes)
    if step > 0:
        lines = [eye.enlarged(step * scale) for eye in eyes]
    (first, second) = lines
    return LidLines((first[0], second[0]), (first[1], second[1]), _fold(eyes) * scale)


def _lower_step(eyes: "list[_Eye]") -> float:
    """How far the lower lids of a picture lie below the landmarks, of the eye distance; 0 where they fit.

    Both eyes are tried together: the picture of one may mislead.
    """
    scores = np.mean([eye.edge_scores() for eye in eyes], axis=0)
    trust = LARGE_EYES_TRUST if min(eye.opening for eye in eyes) > LARGE_EYES else 1.0
    gains = scores[:-1] - trust * COST * np.abs(LOWER_STEPS)
    best = int(gains.argmax())
    is_better = gains[best] > scores[-1] + trust * GAIN and LOWER_STEPS[best] > LEAST_STEP
    more = LARGE_EYES_MORE if trust < 1 else 0.0
    return float(LOWER_STEPS[best]) + more if is_better else 0.0


class _Eye:
    """An eye whose margins the landmarks give."""

    def __init__(
        self, pixels: NDArray[np.uint8], landmarks: Floats, upper: Floats, lower: Floats, scale: float, eye: int
    ) -> None:
        self._pixels, self._landmarks, self._eye = pixels, landmarks, eye
        self._upper, self._lower, self._scale = upper, lower, scale
        self._bow = np.sin(np.linspace(0, np.pi, N_LID))[:, None] ** 0.6
        down = (lower - upper)[N_LID // 2, :2]
        along = upper[-1, :2] - upper[0, :2]
        self._along = along / np.linalg.norm(along)
        across = np.array([-self._along[1], self._along[0]])
        self._down = down / np.linalg.norm(down) if np.linalg.norm(down) > 1e-6 else across * np.sign(across[1])
        self._skin = self._lab(landmarks[list(BELOW[eye]), :2]).mean(axis=0)

    def _lab(self, places: Floats) -> Floats:
        return lab_at(self._pixels, places, max(0.6, LID_BLUR * self._scale))

    def _is_skin(self, places: Floats) -> Floats:
        """(...) likeness of the hue at places (..., 2) to that of the skin below the eye."""
        off = (self._lab(places) - self._skin)[..., 1:] / HUE_SPREAD
        found: Floats = np.exp(-(off**2).sum(axis=-1) / 2)
        return found

    @property
    def opening(self) -> float:
        """Height of the opening by the landmarks, of the eye distance."""
        return float(np.linalg.norm((self._lower - self._upper)[N_LID // 2, :2])) / self._scale

    def edge_scores(self) -> Floats:
        """(K + 1,) how well the lower lid fits there by which `LOWER_STEPS` it may lie lower, and at the landmarks."""
        steps = np.append(LOWER_STEPS, 0.0) * self._scale
        lines = self._lower[None, MIDDLE, :2] + steps[:, None, None] * self._bow[MIDDLE] * self._down
        inside, outside = (self._is_skin(lines + way * self._scale * self._down) for way in (-INSIDE, OUTSIDE))
        scores: Floats = (outside - inside).mean(axis=1)
        return scores

    def enlarged(self, step: float) -> list[Floats]:
        """Margins of an eye whose lower lid lies lower, with corners where skin begins."""
        upper, lower = self._upper.copy(), self._lower.copy()
        lower[:, :2] += step * self._bow * self._down
        share = np.linspace(0, 1, N_LID)[:, None]
        for corner, sign, weight in ((0, -1, (1 - share) ** 3), (-1, 1, share**3)):
            places = self._upper[corner, :2] + sign * CORNER_STEPS[:, None] * self._scale * self._along
            open_steps = np.flatnonzero(self._is_skin(places) > CORNER_SKIN)
            n = int(open_steps[0]) if len(open_steps) else len(CORNER_STEPS)
            shift = sign * (CORNER_STEPS[n - 1] if n else 0.0) * self._scale * weight * self._along
            upper[:, :2] += shift
            lower[:, :2] += shift
        return [upper, lower]

    def skin_above(self) -> Floats:
        """(K,) likeness to skin below the brow, at `FOLD_STEPS` above the upper margin; 1 too near to that skin."""
        brow = self._landmarks[list(ABOVE[self._eye]), :2]
        skin = np.median(self._lab(brow), axis=0)
        room = FOLD_ROOM * float(np.linalg.norm(brow.mean(axis=0) - self._upper[N_LID // 2, :2])) / self._scale
        ways = (FOLD_STEPS * self._scale)[:, None, None] * self._bow[FOLD_COLUMNS] * self._down
        off = (self._lab(self._upper[None, FOLD_COLUMNS, :2] - ways) - skin) / (BRIGHT_SPREAD, HUE_SPREAD, HUE_SPREAD)
        return np.where(room < FOLD_STEPS, 1.0, np.exp(-(off**2).sum(axis=2) / 2).mean(axis=1))


def _fold(eyes: "list[_Eye]") -> float:
    """Height of the folds above the upper margins, of the eye distance: a little, or above the liner of drawn eyes."""
    is_skin = np.flatnonzero(np.mean([eye.skin_above() for eye in eyes], axis=0) > FOLD_SKIN)
    return float(FOLD_STEPS[is_skin[0]]) if len(is_skin) else float(FOLD_STEPS[0])
