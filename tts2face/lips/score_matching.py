"""Second half of retargeting: the face tracker reads the same scores on the face as on the person.

Landmarks alone do not tell how a mouth opens: a lifted upper lip and a dropped jaw give the same gap. The tracker's
scores do. Each frame is solved by Gauss-Newton steps of the bounded least squares, with rows for the scores of the face
(`ScoreMap`) and with the shapes of the scores drawn to the weights that give these scores when they act alone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.face.lip_constraints import MIDDLE_PAIR
from tts2face.models.score_map import N_SCORES, SCORE_SHAPES, ScoreMap, logistic
from tts2face.numeric.arrays import FloatArray, ordered_product, smoothstep
from tts2face.numeric.least_squares import bounded_least_squares

N_STEPS = 5  # Gauss-Newton steps; more change hardly any score by .01
STEP_SHARE = 0.5  # of each step: full steps oscillate, because scores are steep functions of the weights
BLOCK = 256  # frames solved together, which bounds the memory
GRID = np.linspace(0.0, 1.0, 51)  # weights at which a shape's own score is tabulated
# Of the squared error of a logit, relative to a landmark of the cheek (1 / mm^2), in the order of `SCORE_SHAPES`.
SCORE_WEIGHTS = np.array([5e6, 1e5, 1e6, 1e5, 3e6, 1e5, 1e5])
# Pull of a score's shapes to the weight that gives the score, as a share of the curvature along the shape.
PRIOR_SHARES = np.array([0.1, 0.3, 0.1, 0.3, 1.0, 0.1, 0.3])
# The prior weight of a score minimises its squared error over this one, plus the squared weight times a cost: a shape
# that hardly changes its score is not used for it.
PRIOR_SCORE_ERROR, PRIOR_WEIGHT_COST = 0.05, 0.3
OTHER_SHARE = 0.1  # pull of all other shapes to 0, as a share of the median curvature
# Pull of the shapes that move the mouth sideways: two opposite ones would act together otherwise.
SIDEWAYS = ("jawLeft", "jawRight", "mouthLeft", "mouthRight")
SIDEWAYS_SHARE = 1.0
FROWN = ("mouthFrownLeft", "mouthFrownRight")  # no score is of them; on faces of unknown shapes they are held as well
JAW = tuple(SCORE_SHAPES).index("jawOpen")
# Of a lip gap where the lips touch, in addition to that of `curvature`; it falls to 0 at `FREE_GAP_MM`.
CLOSED_GAP_WEIGHT, FREE_GAP_MM = 3e6, 3.0
JAW_GAIN = 1.2  # of the jaw's target score, which the rows of landmarks and gaps miss on one side
JAW_GAP_MM = 3.0  # lip gap from which the jaw follows its score in full; on closed lips the tracker sees no jaw
# Scores between which the weight of a logit grows with its precision, s (1 - s): where a score hardly responds to the
# shapes, as that of the jaw behind nearly closed lips, a logit of it would move them without limit.
PRECISION_LIMITS = (0.01, 0.5)
LOW_SCORE = 0.02  # scores below it count as equal
SCORE_LIMITS = (0.01, 0.97)  # of target scores, so that their logits are finite
REST_TOLERANCE = 0.08  # difference of the scores at rest that vanishes during speech; more is a person's build
REST_REACH = 0.5  # distance from rest, in standard deviations of speech, at which it has fallen to 1 / e


@dataclass(frozen=True, slots=True, eq=False)
class ScoreMatching:
    """Score rows and priors of a face; built by `build_score_matching`.

    Parameters
    ----------
    response
        Scores of the face for the k weights.
    curvature : (k, k)
        Normal matrix of landmarks, width, gaps and ridge.
    limits : (k, 2)
        Least and greatest weights.
    opened : (P, k)
        Widening of the lip gaps per weight, mm.
    owner : (k,)
        Index of the score whose shape a weight is; -1 for other shapes.
    own_scores : (S, N)
        Score at `GRID` of the shapes of each score alone.
    prior : (k,)
        Curvature of the pull to the prior weight.
    rest_scores : (S,)
        Scores of the person at rest.
    """

    response: ScoreMap
    curvature: FloatArray
    limits: FloatArray
    opened: FloatArray
    owner: NDArray[np.int64]
    own_scores: FloatArray
    prior: FloatArray
    rest_scores: FloatArray

    def solve(self, linear: FloatArray, scores: FloatArray, gaps: FloatArray, distance: FloatArray) -> FloatArray:
        """Weights (T, k) of frames with linear terms (T, k) of landmarks, width and gaps.

        Parameters
        ----------
        scores : (T, S)
            Scores of the person.
        gaps : (T, P)
            Gaps between facing lip points that the face shall have, mm.
        distance : (T,)
            Distance of the person's mouth from rest in standard deviations of speech.
        """
        targets = self.face_scores(scores, distance)
        # scores above the limit have no finite logit
        targets[:, JAW] = np.minimum(JAW_GAIN * targets[:, JAW], SCORE_LIMITS[1])
        weights: FloatArray = np.zeros(linear.shape)
        for first in range(0, len(linear), BLOCK):
            block = slice(first, first + BLOCK)
            weights[block] = self._solve_block(linear[block], targets[block], gaps[block])
        return weights

    def face_scores(self, scores: FloatArray, distance: FloatArray) -> FloatArray:
        """Scores (T, S) that the face shall have: those of the person, and at rest its own.

        What the scores at rest differ by beyond `REST_TOLERANCE` is due to the build of the two and remains.
        """
        offset = self.response.scores(np.zeros((1, len(self.owner))))[0] - self.rest_scores
        at_rest = np.clip(offset, -REST_TOLERANCE, REST_TOLERANCE)
        share = np.exp(-np.square(distance / REST_REACH))[:, None]
        wanted: FloatArray = np.clip(scores + (offset - at_rest) + share * at_rest, *SCORE_LIMITS)
        return wanted

    def weights_alone(self, scores: FloatArray) -> FloatArray:
        """Weights (k,) at which shapes have their scores (k,) by themselves; 0 for those that no score is of."""
        targets = np.where(np.arange(N_SCORES) == self.owner[:, None], scores[:, None], 0.0)
        return np.where(self.owner < 0, 0.0, np.diag(self._prior_weights(targets)))

    def _solve_block(self, linear: FloatArray, targets: FloatArray, gaps: FloatArray) -> FloatArray:
        open_share = smoothstep(gaps[:, MIDDLE_PAIR] / JAW_GAP_MM)
        hold = CLOSED_GAP_WEIGHT * (1.0 - smoothstep(gaps / FREE_GAP_MM))
        strength = np.where(np.arange(N_SCORES) == JAW, open_share[:, None], 1.0) * SCORE_WEIGHTS
        pull = self.prior * np.where(self.owner == JAW, open_share[:, None], 1.0)
        base = self.curvature + pull[:, :, None] * np.eye(len(self.owner))
        base += np.einsum("tpk,pj->tkj", hold[:, :, None] * self.opened, self.opened)
        linear = linear + pull * self._prior_weights(targets) + ordered_product(hold * gaps, self.opened)
        weights = bounded_least_squares(base, linear, self.limits)
        logits = np.log(targets / (1.0 - targets))
        for _ in range(N_STEPS):
            found, slopes = self.response.logits(weights), self.response.slopes(weights)
            both_low = np.maximum(logistic(found), targets) < LOW_SCORE
            active = np.where(both_low, 0.0, strength)
            read = np.clip(logistic(found), *PRECISION_LIMITS)
            # the precision of a score, s (1 - s): flat at both ends of a logistic (decision 101)
            active *= 4.0 * read * (1.0 - read)
            wanted = active * (logits - found + np.einsum("tsk,tk->ts", slopes, weights))
            solved = bounded_least_squares(
                base + np.einsum("tsk,tsj->tkj", slopes * active[:, :, None], slopes),
                linear + np.einsum("ts,tsk->tk", wanted, slopes),
                self.limits,
            )
            weights = weights + STEP_SHARE * (solved - weights)
        return weights

    def _prior_weights(self, targets: FloatArray) -> FloatArray:
        prior: FloatArray = np.zeros((len(targets), len(self.owner)))
        for score, alone in enumerate(self.own_scores):
            cost = np.square((alone - targets[:, score : score + 1]) / PRIOR_SCORE_ERROR) + PRIOR_WEIGHT_COST * GRID**2
            prior[:, self.owner == score] = GRID[cost.argmin(axis=1)][:, None]
        return prior


def build_score_matching(
    response: ScoreMap,
    matrices: tuple[FloatArray, FloatArray, FloatArray],
    rest_scores: FloatArray,
    held: tuple[str, ...] = SIDEWAYS,
) -> ScoreMatching:
    """Score matching of a face for a person whose scores at rest are `rest_scores` (S,).

    Parameters
    ----------
    matrices
        `curvature`, `limits` and `opened` of the class.
    held
        Shapes that are pulled to 0 by `SIDEWAYS_SHARE`.
    """
    curvature, limits, opened = matrices
    owner = np.full(len(response.inputs), -1, np.int64)
    own_scores = []
    for score, names in enumerate(SCORE_SHAPES.values()):
        shapes = np.isin(response.inputs, names)
        owner[shapes] = score
        own_scores.append(np.clip(response.scores(GRID[:, None] * shapes)[:, score], *SCORE_LIMITS))
    along = np.diag(curvature)
    shares = np.where(np.isin(response.inputs, held), SIDEWAYS_SHARE, OTHER_SHARE)
    prior = np.where(owner < 0, shares * np.median(along), PRIOR_SHARES[owner] * along)
    return ScoreMatching(response, curvature, limits, opened, owner, np.array(own_scores), prior, rest_scores)


def scaled_scores(scores: FloatArray, rest: FloatArray, gain: float) -> FloatArray:
    """Scores (T, S) of motion multiplied by a gain about the scores at rest (S,)."""
    return np.clip(rest + gain * (scores - rest), 0.0, 1.0)
