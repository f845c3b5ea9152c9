"""Choice of how far own material changes a base talker, by cross-validation on the person's own sentences."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.evaluation.evaluate import SpeakerScale
from corpus_tools.evaluation.methods import build_methods
from corpus_tools.evaluation.reference import LipCurves
from corpus_tools.recordings.observation import Observation
from corpus_tools.training.adapt_talker import NO_CHANGE, Adaptation, Base, base_lips, combined_shapes, learn_base_map
from corpus_tools.training.base_map import frame_terms
from corpus_tools.training.train_talker import learn_talker
from tts2face.exemplar.motion_measures import DTW_BAND_S, correlation, range_ratio, speech_frames, warping_cost
from tts2face.models.talker import ShapeModel, Talker
from tts2face.types import Progress

MAX_FOLDS = 5
# Wanted deviation of the opening over the real one: larger motion costs little up to here (docs/decisions/131-base.md).
RANGE_RATIO = 0.85
MAX_GAIN = 1.5
# Power of the gain: maps of the folds are learnt from fewer sentences than the final one and move less; with the whole
# gain, talkers of 10 to 25 s cost more than the base alone (docs/decisions/131-base.md).
GAIN_POWER = 0.5
BASE_ONLY = Adaptation(trust=1.0, penalty=NO_CHANGE)
# Trust and penalty that were best from 10 s on in another speaker's learning curve, and more careful ones
# (docs/decisions/131-base.md).
ADAPTATIONS = (
    BASE_ONLY,
    Adaptation(trust=1.0, penalty=300.0),
    Adaptation(trust=0.6, penalty=60.0),
    Adaptation(trust=0.3, penalty=60.0),
    Adaptation(trust=0.3, penalty=30.0),
)
OWN_METHODS = {"mean face": "mean face", "mean pose": "mean phone pose", "own examples": "exemplar"}

Floats = NDArray[np.float64]
Landmarks = NDArray[np.floating]
Synthesis = Callable[[Observation], Landmarks]  # landmarks (T, 478, 3) for the phones of an utterance
Learner = Callable[[Sequence[Observation]], Synthesis]


@dataclass(frozen=True, slots=True)
class HeldOutScore:
    """Correlations of opening and width with held-out sentences, and their warping cost; all of z-scored curves.

    ``range_ratio`` is the deviation of the synthesised opening over that of the real one, ``costs`` are those of the
    single sentences.
    """

    opening: float
    width: float
    cost: float
    range_ratio: float
    costs: tuple[float, ...]

    def is_surely_better(self, other: "HeldOutScore") -> bool:
        """Whether the costs are lower by more than the standard error of the differences, sentence by sentence."""
        gains = np.subtract(other.costs, self.costs)
        return bool(gains.mean() > gains.std(ddof=1) / np.sqrt(len(gains)))


@dataclass(frozen=True, slots=True, eq=False)
class ChosenAdaptation:
    """The best adaptation, its scores, and those of the alternatives by name; without scores if it was not tested."""

    adaptation: Adaptation
    score: HeldOutScore | None
    alternatives: Mapping[str, HeldOutScore]

    @property
    def message(self) -> str:
        """What to expect of the talker, for the user."""
        if self.score is None:
            return "one recording cannot be held out: the base's articulation is kept; record two sentences or more"
        base = self.alternatives["base alone"]
        return (
            f"held-out r opening {self.score.opening:.2f}, width {self.score.width:.2f}; "
            f"base alone {base.opening:.2f}, {base.width:.2f}"
        )


def choose_adaptation(
    base: Base, observations: Sequence[Observation], *, on_progress: Progress | None = None
) -> ChosenAdaptation:
    """The adaptation with the least warping cost on held-out sentences of the person.

    The base alone for one sentence, or if no adaptation is better by more than the standard error.

    The cost of exemplars is not included: the map alone is applied to what the base synthesises.
    """
    if len(observations) < 2:
        return ChosenAdaptation(BASE_ONLY, None, {})
    lips = {one.name: base_lips(base, one) for one in observations}
    models: dict[tuple[str, ...], ShapeModel] = {}  # of each fold
    learners: dict[str, Learner] = {
        _name(adaptation): _adapted_learner(base, adaptation, lips, models) for adaptation in ADAPTATIONS
    }
    talkers: dict[tuple[str, ...], Talker] = {}  # of each fold
    learners |= {name: _own_learner(method, talkers) for name, method in OWN_METHODS.items()}
    scores = {}
    for done, (name, learner) in enumerate(learners.items(), start=1):
        scores[name] = cross_validate(learner, observations)
        if on_progress:
            on_progress(done, len(learners))
    best = min(ADAPTATIONS, key=lambda adaptation: scores[_name(adaptation)].cost)
    if not scores[_name(best)].is_surely_better(scores[_name(BASE_ONLY)]):
        return ChosenAdaptation(BASE_ONLY, scores[_name(BASE_ONLY)], scores)
    score = scores[_name(best)]
    gain = float(np.clip(RANGE_RATIO / max(score.range_ratio, 1e-9), 1.0, MAX_GAIN)) ** GAIN_POWER
    return ChosenAdaptation(replace(best, gain=gain), score, scores)


def cross_validate(learner: Learner, observations: Sequence[Observation]) -> HeldOutScore:
    """Scores over folds of whole utterances, every `MAX_FOLDS`-th together; each is left out once."""
    n_folds = min(MAX_FOLDS, len(observations))
    person = SpeakerScale.of(observations)
    real, made, costs = [], [], []
    for fold in range(n_folds):
        known = [one for at, one in enumerate(observations) if at % n_folds != fold]
        synthesis, scale = learner(known), SpeakerScale.of(known)
        for one in observations[fold::n_folds]:
            here = speech_frames(one.phones, len(one.landmarks), one.fps)
            real.append(person.z_score(LipCurves.of(one.landmarks[here])).values())
            made.append(scale.z_score(LipCurves.of(synthesis(one)[here])).values())
            costs.append(warping_cost(real[-1], made[-1], np.ones(2), round(DTW_BAND_S * one.fps)))
    pooled, predicted = np.concatenate(real), np.concatenate(made)
    opening, width = (correlation(pooled[:, at], predicted[:, at]) for at in range(2))
    ratio = range_ratio(pooled[:, 0], predicted[:, 0])
    return HeldOutScore(opening, width, float(np.mean(costs)), ratio, tuple(costs))


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
        names = tuple(one.name for one in known)
        model = models[names] = models.get(names) or combined_shapes(base.talker.model, known)
        mapped = learn_base_map(base, known, model, adaptation, lips)

        def synthesise(one: Observation) -> Landmarks:
            times = np.arange(len(one.landmarks)) / one.fps
            terms = frame_terms(one.phones, times, mapped.inventory, lips[one.name])
            return model.shapes(mapped.parameters(terms))

        return synthesise

    return learn


def _own_learner(method: str, talkers: dict[tuple[str, ...], Talker]) -> Learner:
    def learn(known: Sequence[Observation]) -> Synthesis:
        names = tuple(one.name for one in known)
        talker = talkers[names] = talkers.get(names) or learn_talker(known, metadata={"name": "held out"})
        motion = build_methods(talker)[method]
        model: ShapeModel = talker.model
        return lambda one: model.shapes(motion(one.phones, len(one.landmarks), one.fps))

    return learn
