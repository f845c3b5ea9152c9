"""Choice of how far own material changes a base talker, by cross-validation on the person's own sentences."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.methods import build_methods
from corpus_tools.measures.reference import LipCurves
from corpus_tools.measures.scale import CurveScale
from corpus_tools.recordings.observation import Observation
from corpus_tools.training.adapt_talker import (
    NO_CHANGE,
    Adaptation,
    Base,
    base_lips,
    combined_shapes,
    learn_base_map,
)
from corpus_tools.training.base_map import frame_terms
from corpus_tools.training.train_talker import learn_talker
from tts2face.lips.motion_measures import DTW_BAND_S, correlation, range_ratio, speech_frames, warping_cost
from tts2face.models.talker import ShapeModel, Talker
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Progress, ignore_progress

MAX_FOLDS = 5
# Wanted deviation of opening and width over the real ones, about that of the shipped talker for other people, and the
# power of the gain, whose estimate from few sentences errs; by warping cost (docs/decisions/191-few-sentences.md).
RANGE_RATIO, GAIN_POWER = 0.77, 0.75
GAIN_LIMITS = (0.5, 2.0)
BASE_ONLY = Adaptation(trust=1.0, penalty=NO_CHANGE)
# The usual one is better than the base in nearly all choices of three sentences and more; held-out sentences of so
# few have to show that another one is better (docs/decisions/191-few-sentences.md).
USUAL = Adaptation(trust=0.6, penalty=60.0)
ADAPTATIONS = (
    BASE_ONLY,
    Adaptation(trust=1.0, penalty=100.0),
    USUAL,
    Adaptation(trust=0.3, penalty=60.0),
    Adaptation(trust=0.3, penalty=30.0),
)
OWN_METHODS = {"mean face": "mean face", "mean pose": "mean phone pose", "own examples": "exemplar"}
Landmarks = NDArray[np.floating]
Synthesis = Callable[[Observation], Landmarks]  # landmarks (T, 478, 3) for the phones of an utterance
Learner = Callable[[Sequence[Observation]], Synthesis]


@dataclass(frozen=True, slots=True)
class HeldOutScore:
    """Correlations of opening and width with held-out sentences, and their warping cost; all of z-scored curves.

    ``ranges`` are the deviations of the synthesised opening and width over those of the real ones, ``costs`` those of
    the single sentences.
    """

    opening: float
    width: float
    cost: float
    ranges: tuple[float, float]
    costs: tuple[float, ...]

    def is_surely_better(self, other: "HeldOutScore") -> bool:
        """Whether the costs are lower by more than the standard error of the differences, sentence by sentence."""
        gains = np.subtract(other.costs, self.costs)
        return bool(gains.mean() > gains.std(ddof=1) / np.sqrt(len(gains)))

    def gain(self) -> tuple[float, float]:
        """By which opening and width are multiplied towards `RANGE_RATIO`."""
        return _limited_gain(RANGE_RATIO / np.maximum(self.ranges, 1e-9))


@dataclass(frozen=True, slots=True, eq=False)
class ChosenAdaptation:
    """The best adaptation, its scores, and those of the alternatives by name; without scores if it was not tested."""

    adaptation: Adaptation
    score: HeldOutScore | None
    alternatives: Mapping[str, HeldOutScore]

    @property
    def message(self) -> str:
        """Quality to expect of the talker, for the user."""
        if self.score is None:
            return "one recording cannot be held out: the base's articulation is kept; record two sentences or more"
        base = self.alternatives["base alone"]
        return (
            f"held-out r opening {self.score.opening:.2f}, width {self.score.width:.2f}; "
            f"base alone {base.opening:.2f}, {base.width:.2f}"
        )


def choose_adaptation(
    base: Base, observations: Sequence[Observation], *, on_progress: Progress = ignore_progress
) -> ChosenAdaptation:
    """`USUAL`, unless another adaptation has surely less warping cost on held-out sentences of the person.

    The base alone for one sentence, with the range of motion of the person.

    The cost of exemplars is not included: the map alone is applied to what the base synthesises.
    """
    if len(observations) < 2:
        return ChosenAdaptation(_base_in_range(base, observations), None, {})
    lips = {observation.name: base_lips(base, observation) for observation in observations}
    models: dict[tuple[str, ...], ShapeModel] = {}  # of each fold
    learners: dict[str, Learner] = {
        _name(adaptation): _adapted_learner(base, adaptation, lips, models) for adaptation in ADAPTATIONS
    }
    talkers: dict[tuple[str, ...], Talker] = {}  # of each fold
    learners |= {name: _own_learner(method, talkers) for name, method in OWN_METHODS.items()}
    scores = {}
    for done, (name, learner) in enumerate(learners.items(), start=1):
        scores[name] = cross_validate(learner, observations)
        on_progress(done, len(learners))
    best = min(ADAPTATIONS, key=lambda adaptation: scores[_name(adaptation)].cost)
    if not scores[_name(best)].is_surely_better(scores[_name(USUAL)]):
        best = USUAL
    score = scores[_name(best)]
    chosen = _base_in_range(base, observations) if best == BASE_ONLY else replace(best, gain=score.gain())
    return ChosenAdaptation(chosen, score, scores)


def _base_in_range(base: Base, observations: Sequence[Observation]) -> Adaptation:
    """The base alone; opening and width are multiplied by the person's deviations over those of its recordings."""
    ratios = CurveScale.of_observations(observations).spread / CurveScale.of_talker(base.talker).spread
    return replace(BASE_ONLY, gain=_limited_gain(ratios))


def _limited_gain(ratios: FloatArray) -> tuple[float, float]:
    opening, width = np.clip(ratios, *GAIN_LIMITS) ** GAIN_POWER
    return float(opening), float(width)


def cross_validate(learner: Learner, observations: Sequence[Observation]) -> HeldOutScore:
    """Scores over folds of whole utterances, every `MAX_FOLDS`-th together; each is left out once."""
    n_folds = min(MAX_FOLDS, len(observations))
    person = CurveScale.of_observations(observations)
    real, made, costs = [], [], []
    for fold in range(n_folds):
        known = [observation for at, observation in enumerate(observations) if at % n_folds != fold]
        synthesis, scale = learner(known), CurveScale.of_observations(known)
        for observation in observations[fold::n_folds]:
            here = speech_frames(observation.phones, len(observation.landmarks), observation.fps)
            real.append(person.z_score(LipCurves.of(observation.landmarks[here]).values()))
            made.append(scale.z_score(LipCurves.of(synthesis(observation)[here]).values()))
            costs.append(warping_cost(real[-1], made[-1], np.ones(2), round(DTW_BAND_S * observation.fps)))
    pooled, predicted = np.concatenate(real), np.concatenate(made)
    opening, width = (correlation(pooled[:, at], predicted[:, at]) for at in range(2))
    ranges = range_ratio(pooled[:, 0], predicted[:, 0]), range_ratio(pooled[:, 1], predicted[:, 1])
    return HeldOutScore(opening, width, float(np.mean(costs)), ranges, tuple(costs))


def _name(adaptation: Adaptation) -> str:
    if adaptation == BASE_ONLY:
        return "base alone"
    return f"base, trust {adaptation.trust:g}, penalty {adaptation.penalty:g}"


def _adapted_learner(
    base: Base,
    adaptation: Adaptation,
    lips: Mapping[str, NDArray[np.float32]],
    models: dict[tuple[str, ...], ShapeModel],
) -> Learner:
    def learn(known: Sequence[Observation]) -> Synthesis:
        names = tuple(recording.name for recording in known)
        model = models[names] = models.get(names) or combined_shapes(base.talker.model, known)
        mapped = learn_base_map(base, known, model, adaptation, lips)

        def synthesise(observation: Observation) -> Landmarks:
            times = np.arange(len(observation.landmarks)) / observation.fps
            terms = frame_terms(observation.phones, times, mapped.inventory, lips[observation.name])
            return model.shapes(mapped.parameters(terms))

        return synthesise

    return learn


def _own_learner(method: str, talkers: dict[tuple[str, ...], Talker]) -> Learner:
    def learn(known: Sequence[Observation]) -> Synthesis:
        names = tuple(recording.name for recording in known)
        talker = talkers[names] = talkers.get(names) or learn_talker(known, metadata={"name": "held out"})
        motion = build_methods(talker)[method]
        model: ShapeModel = talker.model
        return lambda observation: model.shapes(motion(observation.phones, len(observation.landmarks), observation.fps))

    return learn
