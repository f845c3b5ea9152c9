"""Learning curves: accuracy on the same held-out utterances against the amount of a person's own material.

For each amount, several random choices of the training utterances are learnt as `corpus build` learns them. Curves are
z-scored: real ones over the held-out speech, synthesised ones over the chosen material (those of the base over its own
recordings), so that ten seconds that misjudge the person's range are measured with it.

Recordings of one person for a learning curve: videos, or folders of landmark tracks.

Lip tracks as observations: landmarks of another face that show the recorded lip features, for measuring only.

A track holds 68 points in pixels, from which no face in millimetres follows. Its z-scored lip features are given to a
talker instead: of all landmarks of the talker's shape model with these features, the most probable ones under the
Gaussian of the talker's speech. Opening and width are those of the track; the remaining shape is the talker's.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import check_any_kept, observe
from corpus_tools.run_options import RunOptions, StageCallback, ignore_stage
from corpus_tools.studies.evaluation.curve_tables import ChoiceFigures, CurvePoint, LearningCurve, compare_points
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.studies.evaluation.methods import build_methods, exemplar_method
from corpus_tools.studies.evaluation.people import (
    CurveScale,
    TestUtterance,
    pair_curves,
    synthesise_people,
    z_score_people,
)
from corpus_tools.studies.evaluation.scores import draw_weights
from corpus_tools.studies.evaluation.splits import check_disjoint, check_unknown
from corpus_tools.studies.evaluation.tracks import TRACK_SUFFIX, TRACKED, read_person
from corpus_tools.training.adapt_talker import Base, adapted_talker, separate_lips
from corpus_tools.training.choose_adaptation import choose_adaptation, needs_base
from corpus_tools.training.phone_network import add_phone_network
from corpus_tools.training.pooling.lip_tracks import read_lip_tracks
from corpus_tools.training.pooling.speech import PooledSpeech, align_lip_tracks, talker_features
from corpus_tools.training.train_talker import correct_pose, fit_pose_correction, learn_talker
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.exemplar import DEFAULT_OPTIONS
from tts2face.lips.explanation import speech_frames
from tts2face.models.talker import Talker
from tts2face.types import Progress

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
    on_progress: Progress | None = None,
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
    task = CurveTask(tuple(train), z_score_people([[leak.apply(one) for one in test]]), base)
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
            if on_progress:
                on_progress(done, sum(map(len, choices)))
        seconds = float(np.mean([_duration_s(part) for part in chosen]))
        points.append(CurvePoint.of(seconds, len(points), figures))
    test_seconds = sum(len(one.observation.landmarks) / one.observation.fps for one in task.tests)
    base_name = None if base is None else str(base.talker.metadata.get("name", ""))
    return compare_points(points, n_test=len(task.tests), test_seconds=test_seconds, base=base_name)


def choose_material(
    train: Sequence[Observation], amounts_s: Sequence[float], seed: int
) -> tuple[tuple[tuple[Observation, ...], ...], ...]:
    """For each amount in ascending order, `N_CHOICES` random choices of utterances, nested in each other.

    A choice holds the number of utterances whose duration is nearest to the amount, in their given order; the last
    amount is all material, once.

    Raises
    ------
    InputError
        An amount is not positive, or there is none.
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
    return (*found, (tuple(train),))


def _nearest_choice(
    train: Sequence[Observation], order: NDArray[np.integer], amount_s: float
) -> tuple[Observation, ...]:
    ends = np.cumsum([len(train[at].landmarks) / train[at].fps for at in order])
    n_chosen = int(np.argmin(np.abs(ends - amount_s))) + 1
    return tuple(train[at] for at in np.sort(order[:n_chosen]))


def _duration_s(observations: Sequence[Observation]) -> float:
    return sum(len(one.landmarks) / one.fps for one in observations)


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


MIN_PART_S = 3.0  # tracks are cut at the first pause after as much: about a sentence
MIN_PAUSE_S = 0.12  # shorter silences may be closures
OPENING = 0  # of `lip_features.FEATURES`
CLOSED_SHARE = 0.02  # of the frames whose lips touch: points of dlib do not tell when they do
NOISE = 0.05  # deviation of a feature, in units of its spread, that the map need not reproduce
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FeatureMap:
    """Speech parameters (D,) = offset + matrix (D, 8) @ z-scored lip features."""

    matrix: Floats
    offset: Floats

    @classmethod
    def of(cls, talker: Talker) -> "FeatureMap":
        """Conditional mean of a talker's parameters given its lip features, both in its recorded speech."""
        n_speech = talker.model.n_speech
        features, parameters = [], []
        for at, one in enumerate(talker.utterances):
            here = speech_frames(one.phones, len(one.shape), talker.fps)
            features.append(talker_features(talker, at)[here])
            parameters.append(one.shape[here, :n_speech].astype(np.float64))
        seen, wanted = np.concatenate(features), np.concatenate(parameters)
        scored = (seen - seen.mean(axis=0)) / np.maximum(seen.std(axis=0), 1e-9)
        centred = wanted - wanted.mean(axis=0)
        # Features are nearly linear in the parameters: the slopes of that regression give the features back exactly,
        # where a regression of the parameters on the features would reduce the motion.
        slopes = np.linalg.lstsq(centred, scored, rcond=None)[0]
        covariance = centred.T @ centred / len(centred)
        explained = slopes.T @ covariance @ slopes + NOISE**2 * np.eye(scored.shape[1])
        return cls(covariance @ slopes @ np.linalg.inv(explained), wanted.mean(axis=0))

    def parameters(self, features: Floats) -> Floats:
        """(T, D) of features (T, 8)."""
        return np.asarray(self.offset + features @ self.matrix.T)


def lip_observations(pooled: Sequence[PooledSpeech], talker: Talker) -> tuple[Observation, ...]:
    """Aligned lip tracks, cut at pauses, as observations on the face of a talker.

    The opening is moved so that the lips touch in a small share of frames; curves that are z-scored do not change.
    """
    feature_map, model = FeatureMap.of(talker), talker.model
    opening = np.concatenate([one.features[one.is_used, OPENING] for one in pooled])
    gap = _touching_opening(feature_map, talker) - np.quantile(opening, CLOSED_SHARE)
    found = []
    for track in pooled:
        raised = track.features.copy()
        raised[:, OPENING] += max(gap, 0.0)
        landmarks = model.shapes(separate_lips(feature_map.parameters(raised), model))
        for number, (begin, end) in enumerate(_parts(track.phones, track.fps, len(landmarks)), start=1):
            found.append(_part(track, landmarks, number, begin, end))
    return tuple(found)


def _touching_opening(feature_map: FeatureMap, talker: Talker) -> float:
    """z-scored opening at which the talker's lips touch, at the median of its other features."""
    steps = np.linspace(-6.0, 6.0, 241)
    features = np.zeros((len(steps), feature_map.matrix.shape[1]))
    features[:, OPENING] = steps
    landmarks = talker.model.shapes(feature_map.parameters(features))
    gaps = landmarks[:, 13, 1] - landmarks[:, 14, 1]
    return float(np.interp(0.0, gaps, steps))


def _parts(phones: PhoneSequence, fps: float, n_frames: int) -> Iterator[tuple[int, int]]:
    """First frame and end of each part, cut in the middle of pauses; all parts hold speech."""
    begin = 0
    for label, start, end in zip(phones.phones, phones.edges, phones.edges[1:], strict=False):
        middle = round((start + end) / 2 * fps)
        if label == SILENCE and end - start >= MIN_PAUSE_S and (middle - begin) / fps >= MIN_PART_S:
            yield begin, middle
            begin = middle
    last = min(n_frames, int(phones.edges[-1] * fps))
    if (last - begin) / fps >= MIN_PART_S:
        yield begin, last


def _part(track: PooledSpeech, landmarks: NDArray[np.float32], number: int, begin: int, end: int) -> Observation:
    start, stop, edges = begin / track.fps, end / track.fps, track.phones.edges
    inside = [at for at in range(len(track.phones)) if edges[at + 1] > start and edges[at] < stop]
    times = np.concatenate([[start], edges[[at + 1 for at in inside[:-1]]], [stop]]) - start
    phones = PhoneSequence([track.phones.phones[at] for at in inside], times)
    head = np.zeros((end - begin, 6), np.float32)
    name = f"{track.name}-{number:03d}"
    return Observation(
        name, track.fps, landmarks[begin:end], head, phones, (), head[:, 0], TRACKED, Path(f"{track.name}.npz")
    )


LIP_POINTS = "points"  # array that lip tracks hold and tracks of people do not


def read_material(
    folder: Path, base: Talker | None, *, run_options: RunOptions | None = None, stages: StageCallback = ignore_stage
) -> tuple[Observation, ...]:
    """Observations of a folder of videos, of a person's tracks (`read_person`), or of lip tracks (`read_lip_tracks`).

    Phones of lip tracks are aligned with the help of the base's recordings, and shown on its face
    (`corpus_tools.studies.evaluation.learning_curve`).

    Raises
    ------
    InputError
        The folder is missing or empty, or lip tracks have no base, or one that was pooled with lip tracks.
    DataError
        A file is damaged.
    """
    tracks = sorted(folder.glob(f"*{TRACK_SUFFIX}")) if folder.is_dir() else []
    if not tracks:
        return check_any_kept(observe(folder, run_options=run_options, on_progress=stages(f"reading {folder.name}")))
    if not _holds_points(tracks[0]):
        return read_person(folder)
    if base is None:
        raise InputError(f"{folder} holds lip tracks, which a base talker's recordings align; give --base")
    if "pooled" in base.metadata:
        raise InputError(
            f"the networks of the base {base.metadata.get('name', '')} were pooled with lip tracks, perhaps these; "
            "give a base as `tts2face corpus build` writes it"
        )
    return lip_observations(align_lip_tracks(read_lip_tracks(folder), base, stages("aligning lip tracks")), base)


def _holds_points(path: Path) -> bool:
    try:
        with np.load(path, allow_pickle=False) as stored:
            return LIP_POINTS in stored.files
    except (OSError, ValueError, EOFError) as damaged:
        raise DataError(f"{path} is not a readable {TRACK_SUFFIX} file: {damaged}") from damaged
