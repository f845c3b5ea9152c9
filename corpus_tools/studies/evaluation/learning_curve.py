"""Learning curves: accuracy on the same held-out utterances against the amount of a person's own material.

For each amount, several random choices of the training utterances are learnt as `corpus build` learns them. Curves are
z-scored: real ones over the held-out speech, synthesised ones over the chosen material (those of the base over its own
recordings), so that ten seconds that misjudge the person's range are measured with it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.intervals import draw_weights
from corpus_tools.measures.methods import build_methods, exemplar_method
from corpus_tools.measures.scale import CurveScale
from corpus_tools.measures.splits import check_disjoint, check_unknown
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.curve import ChoiceFigures, CurvePoint, LearningCurve, compare_points
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.studies.evaluation.people import TestUtterance, pair_curves, synthesise_people, z_score_people
from corpus_tools.training.adapt_talker import Base, adapted_talker
from corpus_tools.training.choose_adaptation import choose_adaptation
from corpus_tools.training.phone_network import add_phone_network
from corpus_tools.training.pose_correction import correct_pose, fit_pose_correction
from corpus_tools.training.short_talker import needs_base
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import InputError
from tts2face.lips.exemplar import DEFAULT_OPTIONS
from tts2face.types import Progress, ignore_progress

DEFAULT_AMOUNTS_S = (10.0, 20.0, 40.0, 80.0, 160.0, 320.0, 640.0, 1280.0, 2400.0)
N_CHOICES = 3  # random choices of the material for each amount
SAME_AMOUNT = 0.9  # an amount above this share of all material is measured as all material
WITH_BASE, OWN_ALONE, BASE_ALONE, MEAN_POSE, MEAN_FACE = (
    "as built with base", "own alone", "base alone", "mean pose", "mean face",
)  # fmt: skip
OWN_METHODS = {"exemplar": OWN_ALONE, "mean phone pose": MEAN_POSE, "mean face": MEAN_FACE}
MethodCurves = Mapping[str, Sequence[NDArray[np.float64]]]  # z-scored (T, 2) of each utterance, by method


@dataclass(frozen=True, slots=True, eq=False)
class CurveTask:
    """Training material, test utterances, and the base (None: own material alone) of a learning curve."""

    train: tuple[Observation, ...]
    tests: tuple[TestUtterance, ...]
    base: Base | None


def measure_learning_curve(
    train: Sequence[Observation],
    test: Sequence[Observation],
    base: Base | None,
    *,
    amounts_s: Sequence[float] = DEFAULT_AMOUNTS_S,
    seed: int = 0,
    on_progress: Progress = ignore_progress,
) -> LearningCurve:
    """Figures of talkers learnt from growing parts of the training utterances, on the held-out ones.

    Parameters
    ----------
    base
        Talker that completes material of less than ten minutes, as in `corpus build`.
    amounts_s
        Seconds of material; those above the whole are replaced by the whole, which is always measured.
    seed
        Of the random choices of the material.

    Raises
    ------
    InputError
        An amount is not positive, a part is empty, an utterance is in both parts, or the base holds a test utterance.
    """
    check_disjoint([(tuple(train), tuple(test))])
    if base is not None:
        check_unknown(base.talker, test)
    leak = fit_pose_correction(train)
    task = CurveTask(tuple(train), z_score_people([[leak.apply(observation) for observation in test]]), base)
    weights = draw_weights(len(task.tests))
    choices = choose_material(train, amounts_s, seed)
    constant = () if base is None else (_base_alone(task, base),)
    points: list[CurvePoint] = []
    done = 0
    for chosen in choices:
        figures: dict[str, list[ChoiceFigures]] = {}
        for part in chosen:
            for name, curves in {**_method_curves(task, part), **dict(constant)}.items():
                figures.setdefault(name, []).append(pair_curves(task.tests, curves).figures(weights))
            done += 1
            on_progress(done, sum(map(len, choices)))
        seconds = float(np.mean([_duration_s(part) for part in chosen]))
        points.append(CurvePoint.of(seconds, len(points), figures))
    test_seconds = sum(len(each_test.observation.landmarks) / each_test.observation.fps for each_test in task.tests)
    base_name = None if base is None else str(base.talker.metadata.get("name", ""))
    return compare_points(points, n_test=len(task.tests), test_seconds=test_seconds, base=base_name)


def choose_material(
    train: Sequence[Observation], amounts_s: Sequence[float], seed: int
) -> tuple[tuple[tuple[Observation, ...], ...], ...]:
    """For each amount in ascending order, `N_CHOICES` random choices of utterances, nested in each other.

    A choice holds the number of utterances whose duration is nearest to the amount, in their given order; the last
    amount is all material, once.
    """
    if not amounts_s or not all(0 < amount < np.inf for amount in amounts_s):
        raise InputError("the amounts of a learning curve must be seconds above 0, such as 10,20,40")
    total = _duration_s(train)
    orders = [np.random.default_rng([seed, number]).permutation(len(train)) for number in range(N_CHOICES)]
    found = [
        tuple(_nearest_choice(train, order, amount) for order in orders)
        for amount in sorted(set(amounts_s))
        if amount < SAME_AMOUNT * total
    ]
    # all material leaves nothing to choose, so it is measured once
    return (*found, (tuple(train),))


def _nearest_choice(
    train: Sequence[Observation], order: NDArray[np.integer], amount_s: float
) -> tuple[Observation, ...]:
    ends = np.cumsum([len(train[at].landmarks) / train[at].fps for at in order])
    n_chosen = int(np.argmin(np.abs(ends - amount_s))) + 1
    # in the order of the recordings, as all material is
    return tuple(train[at] for at in np.sort(order[:n_chosen]))


def _duration_s(observations: Sequence[Observation]) -> float:
    return sum(len(observation.landmarks) / observation.fps for observation in observations)


def _base_alone(task: CurveTask, base: Base) -> tuple[str, Sequence[NDArray[np.float64]]]:
    methods = {BASE_ALONE: exemplar_method(base.exemplars, DEFAULT_OPTIONS)}
    return BASE_ALONE, synthesise_people(base.talker, methods, task.tests)[BASE_ALONE]


def _method_curves(task: CurveTask, part: Sequence[Observation]) -> MethodCurves:
    """Curves of what is learnt from a part of the material, with the base and without."""
    steady = correct_pose(part)
    own = add_phone_network(learn_talker(steady, metadata=EVALUATION_METADATA))
    scale = CurveScale.of_talker(own)
    methods = build_methods(own)
    made = synthesise_people(own, {name: methods[name] for name in OWN_METHODS}, task.tests, scale)
    curves = {OWN_METHODS[name]: values for name, values in made.items()}
    if task.base is None:
        return curves
    if not needs_base(steady):
        return {WITH_BASE: curves[OWN_ALONE], **curves}
    adaptation = choose_adaptation(task.base, steady).adaptation
    talker = adapted_talker(task.base, steady, adaptation, EVALUATION_METADATA)
    built = synthesise_people(talker, {WITH_BASE: build_methods(talker)["exemplar"]}, task.tests, scale)
    return {**built, **curves}
