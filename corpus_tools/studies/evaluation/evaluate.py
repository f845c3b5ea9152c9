"""Held-out evaluation: motion synthesised for held-out utterances is compared with the recorded face."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.methods import SynthesisMethod, build_methods
from corpus_tools.measures.own_durations import VoicedUtterance, compare_own_durations, speak_references
from corpus_tools.measures.reference import LipCurves, ReferenceUtterance, Thresholds
from corpus_tools.measures.scale import CurveScale
from corpus_tools.measures.scores import Scores, UtteranceComparison, compute_scores, score_splits
from corpus_tools.measures.splits import Split, check_disjoint
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.tables import Evaluation, Fold
from corpus_tools.studies.evaluation.tracks import ExternalTrack, map_tracks
from corpus_tools.training.phone_network import add_phone_network
from corpus_tools.training.pooling.lip_tracks import LipTrack
from corpus_tools.training.pooling.speech import align_lip_tracks
from corpus_tools.training.pose_correction import correct_pose, fit_pose_correction
from corpus_tools.training.train_talker import learn_talker
from tts2face.lips.options import SynthesisOptions
from tts2face.models.talker import ShapeModel, Talker
from tts2face.sound.voice import Voice
from tts2face.types import Progress, ignore_progress

EVALUATION_METADATA = {
    "name": "evaluation", "language": "", "sources": "", "licence": "", "attribution": "", "command": "", "created": "",
}  # fmt: skip
TRACKS_METHOD, CEILING_METHOD = "tracks", "real, through the model"


def standardise_reference(real: ReferenceUtterance, scale: CurveScale) -> ReferenceUtterance:
    """A real utterance whose parameters are its z-scored curves."""
    curves = scale.z_score_lips(real.curves)
    return replace(real, curves=curves, parameters=curves.values().astype(np.float32))


def compare_across_talkers(
    real: ReferenceUtterance, synthesised: NDArray[np.float32], model: ShapeModel, scale: CurveScale
) -> UtteranceComparison:
    """Comparison of synthesised parameters (T, S) of one talker with a real utterance of another, both z-scored."""
    curves = scale.z_score_lips(LipCurves.of(model.shapes(synthesised)))
    return UtteranceComparison(real, curves.values(), curves, np.ones(2))


@dataclass(frozen=True, slots=True, eq=False)
class SplitResult:
    """Results of one split: the talker, the real utterances, and the parameters (T, S) of each method, by name.

    ``tracked`` are the real utterances before their landmarks were corrected for the head's pose, none without
    correction. ``own`` are comparisons with a voice's own durations; ``scale`` is the talker's if curves are z-scored.
    """

    talker: Talker
    real: tuple[ReferenceUtterance, ...]
    synthesised: Mapping[str, tuple[NDArray[np.float32], ...]]
    seconds: Mapping[str, float]
    tracked: tuple[ReferenceUtterance, ...] = ()
    own: Mapping[str, tuple[UtteranceComparison, ...]] = field(default_factory=dict)
    scale: CurveScale | None = None

    @property
    def model(self) -> ShapeModel:
        """The talker's shape model."""
        return self.talker.model

    def curves(self, method: str, at: int) -> LipCurves:
        """Lip curves of a method, in the units of the real ones."""
        curves = LipCurves.of(self.model.shapes(self.synthesised[method][at]))
        return curves if self.scale is None else self.scale.z_score_lips(curves)


def evaluate(
    parts: Sequence[Split],
    *,
    options: Mapping[str, SynthesisOptions] | None = None,
    tracks: Mapping[str, ExternalTrack] | None = None,
    voice: Voice | None = None,
    lips: Sequence[LipTrack] = (),
    on_progress: Progress = ignore_progress,
) -> tuple[Evaluation, tuple[SplitResult, ...]]:
    """Scores of every method on held-out utterances with their true phone edges.

    Parameters
    ----------
    parts
        Training and held-out utterances. The held-out parts of several splits are pooled; z-scored measures use each
        split's own model.
    options
        Exemplar methods by name; by default `METHODS`.
    tracks
        External tracks by utterance, evaluated as a further method.
    voice
        Voice that speaks the words of the held-out utterances with its own durations, for a second table.
    lips
        Lip tracks of another speaker with which the networks of each split are trained.

    Raises
    ------
    InputError
        A part is empty, a recording is in both parts, or no words are known for the voice.
    """
    warnings = check_disjoint(parts)
    runs = []
    for number, (train, test) in enumerate(parts):
        on_split_progress = _split_progress(on_progress, number, len(parts))
        runs.append(
            evaluate_split(
                train, test, options=options, tracks=tracks, voice=voice, lips=lips, on_progress=on_split_progress
            )
        )
    limits = Thresholds.of([reference for each in runs for reference in each.real])
    n_train = len(parts[0][0]) if len(parts) == 1 else min(len(train) for train, _ in parts)
    result = Evaluation(
        n_train,
        sum(len(run.real) for run in runs),
        _pooled_scores(runs, limits),
        as_tracked=_tracked_scores(runs, limits),
        own=_pooled_own_scores(runs, limits),
        folds=_score_folds(parts, runs, limits) if len(runs) > 1 else (),
        warnings=warnings,
    )
    return result, tuple(runs)


def evaluate_split(  # noqa: PLR0913 - those of `evaluate`, for one split
    train: Sequence[Observation],
    test: Sequence[Observation],
    *,
    options: Mapping[str, SynthesisOptions] | None = None,
    tracks: Mapping[str, ExternalTrack] | None = None,
    voice: Voice | None = None,
    lips: Sequence[LipTrack] = (),
    on_progress: Progress = ignore_progress,
) -> SplitResult:
    """Learn a talker from `train` and synthesise the motion of `test` by every method."""
    leak = fit_pose_correction(train)
    talker = _train_talker([leak.apply(observation) for observation in train], lips)
    methods = build_methods(talker, options)
    real = tuple(ReferenceUtterance.of(leak.apply(observation), talker.model) for observation in test)
    is_corrected = leak.offsets.any()
    tracked = tuple(ReferenceUtterance.of(observation, talker.model) for observation in test if is_corrected)
    voiced = speak_references(voice, real) if voice is not None else ()
    synthesised, synthesis_s, own = {}, {}, {}
    for number, (name, method) in enumerate(methods.items()):
        synthesised[name], synthesis_s[name] = _synthesise(method, real)
        if voiced:
            own[name] = _synthesise_own_durations(method, real, voiced, talker.model)
        on_progress(number + 1, len(methods))
    if tracks is not None:
        synthesised[TRACKS_METHOD], synthesis_s[TRACKS_METHOD] = map_tracks(tracks, talker, real), 0.0
    synthesised[CEILING_METHOD], synthesis_s[CEILING_METHOD] = tuple(reference.parameters for reference in real), 0.0
    return SplitResult(talker, real, synthesised, synthesis_s, tracked, own)


def evaluate_across_talkers(
    train: Sequence[Observation],
    others: Sequence[Observation],
    *,
    lips: Sequence[LipTrack] = (),
    on_progress: Progress = ignore_progress,
) -> tuple[Evaluation, tuple[SplitResult, ...]]:
    """Scores of every method, learnt from one person, on utterances of another with the latter's phone edges.

    Opening and width are z-scored over each person's speech; all measures use these two curves.

    Raises
    ------
    InputError
        A part is empty, or a recording is in both parts.
    """
    warnings = check_disjoint([(tuple(train), tuple(others))])
    train, others = correct_pose(train), correct_pose(others)
    talker = _train_talker(train, lips)
    own_scale, other_scale = CurveScale.of_observations(train), CurveScale.of_observations(others)
    real = tuple(
        standardise_reference(ReferenceUtterance.of(observation, talker.model), other_scale) for observation in others
    )
    synthesised, synthesis_s = {}, {}
    methods = build_methods(talker)
    for number, (name, method) in enumerate(methods.items()):
        synthesised[name], synthesis_s[name] = _synthesise(method, real)
        on_progress(number + 1, len(methods))
    limits = Thresholds.of(real)
    scores = tuple(
        compute_scores(
            name,
            [
                compare_across_talkers(reference, values, talker.model, own_scale)
                for reference, values in zip(real, synthesised[name], strict=True)
            ],
            limits,
            synthesis_s[name],
        )
        for name in methods
    )
    result = Evaluation(len(train), len(others), scores, is_across=True, warnings=warnings)
    return result, (SplitResult(talker, real, synthesised, synthesis_s, scale=own_scale),)


def _train_talker(train: Sequence[Observation], lips: Sequence[LipTrack]) -> Talker:
    talker = learn_talker(train, metadata=EVALUATION_METADATA)
    return add_phone_network(talker, align_lip_tracks(lips, talker) if lips else ())


def _synthesise(
    method: SynthesisMethod, real: Sequence[ReferenceUtterance]
) -> tuple[tuple[NDArray[np.float32], ...], float]:
    began = time.perf_counter()
    synthesised = tuple(
        method(reference.observation.phones, len(reference.parameters), reference.observation.fps) for reference in real
    )
    return synthesised, time.perf_counter() - began


def _synthesise_own_durations(
    method: SynthesisMethod,
    real: Sequence[ReferenceUtterance],
    voiced: Sequence[VoicedUtterance | None],
    model: ShapeModel,
) -> tuple[UtteranceComparison, ...]:
    pairs = zip(real, voiced, strict=True)
    return tuple(compare_own_durations(method, pair, spoken, model) for pair, spoken in pairs if spoken is not None)


def _pooled_scores(runs: Sequence[SplitResult], limits: Thresholds) -> tuple[Scores, ...]:
    """Scores of each method over runs."""
    return tuple(
        score_splits(
            name,
            [(each.model, each.real, each.synthesised[name]) for each in runs],
            limits,
            sum(r.seconds[name] for r in runs),
        )
        for name in runs[0].synthesised
    )


def _tracked_scores(runs: Sequence[SplitResult], limits: Thresholds) -> tuple[Scores, ...]:
    """Scores of each method against the landmarks as tracked, not corrected for the head's pose, where they differ."""
    if not all(each.tracked for each in runs):
        return ()
    return tuple(
        score_splits(name, [(each.model, each.tracked, each.synthesised[name]) for each in runs], limits)
        for name in runs[0].synthesised
    )


def _pooled_own_scores(runs: Sequence[SplitResult], limits: Thresholds) -> tuple[Scores, ...]:
    return tuple(
        compute_scores(name, [comparison for each in runs for comparison in each.own[name]], limits)
        for name in runs[0].own
    )


def _score_folds(parts: Sequence[Split], runs: Sequence[SplitResult], limits: Thresholds) -> tuple[Fold, ...]:
    """Scores of each run alone, with the thresholds of all runs."""
    return tuple(
        Fold(
            len(train),
            len(test),
            {score.method: score.values() for score in _pooled_scores([each], limits)},
        )
        for (train, test), each in zip(parts, runs, strict=True)
    )


def _split_progress(on_progress: Progress, number: int, of: int) -> Progress:
    return lambda done, n_methods: on_progress(number * n_methods + done, of * n_methods)
