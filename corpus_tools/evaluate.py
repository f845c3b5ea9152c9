"""Held-out comparison: a talker learnt from some utterances speaks others, and is measured against the real face."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools import measures
from corpus_tools.leak import pose_leak
from corpus_tools.learn import learn_talker
from corpus_tools.observation import Observation
from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence
from tts2face.exemplar.animate import VisualVoice, speech_trajectory, visual_voice
from tts2face.exemplar.options import METHODS, SynthesisOptions
from tts2face.exemplar.targets import targets_of
from tts2face.talker import ShapeModel, Talker

LEARNT_FOR_EVALUATION = {
    "name": "evaluation", "language": "", "sources": "", "licence": "", "attribution": "", "command": "", "created": "",
}  # fmt: skip

# Speech parameters (T, D) for phones at T frames, from what the training part taught.
Method = Callable[[PhoneSequence, int, float], NDArray[np.float32]]


@dataclass(frozen=True, slots=True)
class UtteranceScore:
    """One held-out utterance: RMSE and warping cost in units of spread, r and range of opening and width."""

    name: str
    r_opening: float
    r_width: float
    rmse_z: float
    dtw_cost: float
    range_ratio: float
    n_frames: int


@dataclass(frozen=True, slots=True)
class Scores:
    """One method over all held-out utterances (frames pooled for r and range, utterances averaged for RMSE and DTW).

    ``real_time_factor`` is the time spent over the duration of the utterances.
    """

    method: str
    r_opening: float
    r_width: float
    rmse_z: float
    dtw_cost: float
    range_ratio: float
    closure: float
    false_closure: float
    real_time_factor: float
    utterances: tuple[UtteranceScore, ...]


@dataclass(frozen=True, slots=True)
class Evaluation:
    """All methods on one split."""

    n_train: int
    n_test: int
    n_closures: int
    n_open_vowels: int
    scores: tuple[Scores, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain dictionary, utterances included."""
        return asdict(self)

    def table(self) -> str:
        """Markdown table, one method a line."""
        head = "| method | r opening | r width | RMSE z | DTW cost | range ratio | closure | false closure |"
        lines = [head, "| --- |" + " --- |" * 7]
        lines += [
            f"| {one.method} | {one.r_opening:.3f} | {one.r_width:.3f} | {one.rmse_z:.3f} | {one.dtw_cost:.3f} "
            f"| {one.range_ratio:.2f} | {one.closure:.2f} | {one.false_closure:.2f} |"
            for one in self.scores
        ]
        return "\n".join(lines)


def split(
    observations: Sequence[Observation], *, hold_out: int, seed: int
) -> tuple[tuple[Observation, ...], tuple[Observation, ...]]:
    """Training and held-out utterances, drawn by a seed from the sorted names.

    Raises
    ------
    InputError
        `hold_out` leaves nothing to learn from or nothing to test.
    """
    if not 0 < hold_out < len(observations):
        raise InputError(
            f"of {len(observations)} utterances, 1 to {len(observations) - 1} can be held out, not {hold_out}"
        )
    ordered = sorted(observations, key=lambda one: one.name)
    held = set(np.random.default_rng(seed).permutation(len(ordered))[:hold_out].tolist())
    train = tuple(one for at, one in enumerate(ordered) if at not in held)
    return train, tuple(one for at, one in enumerate(ordered) if at in held)


def evaluate(
    train: Sequence[Observation],
    test: Sequence[Observation],
    *,
    options: Mapping[str, SynthesisOptions] | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Every method on the held-out utterances, with their true phone edges; all is learnt from the training part.

    Parameters
    ----------
    options
        Exemplar methods by name; by default `METHODS`.

    Raises
    ------
    InputError
        There is nothing to learn from or nothing to test.
    """
    if not test:
        raise InputError("there is no utterance to test")
    leak = pose_leak(train)
    train, test = ([leak.removed(seen) for seen in part] for part in (train, test))
    talker = learn_talker(train, metadata=LEARNT_FOR_EVALUATION)
    voice = visual_voice(talker)
    methods: dict[str, Method] = {
        "mean face": lambda _, n_frames, __: np.zeros((n_frames, talker.model.n_speech), np.float32),
        "mean phone pose": mean_phone_pose(talker, voice),
        **{name: exemplar_method(voice, chosen) for name, chosen in (options or METHODS).items()},
    }
    real = [_Real.of(one, talker.model) for one in test]
    threshold = measures.closure_threshold(np.concatenate([one.least for one in real]))
    scores = []
    for name, method in methods.items():
        began = time.perf_counter()
        made = [method(one.observation.phones, len(one.parameters), one.observation.fps) for one in real]
        spent = time.perf_counter() - began
        scores.append(_scores(name, made, real, talker.model, threshold, spent))
        if on_progress:
            on_progress(len(scores), len(methods) + 1)
    scores.append(
        _scores("real, through the model", [one.parameters for one in real], real, talker.model, threshold, 0)
    )
    n_closures, n_open = (
        sum(len(part) for part in parts) for parts in ([r.least for r in real], [r.open for r in real])
    )
    return Evaluation(len(train), len(test), n_closures, n_open, tuple(scores))


def exemplar_method(voice: VisualVoice, options: SynthesisOptions) -> Method:
    """Synthesis from exemplars."""

    def made(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.float32]:
        return speech_trajectory(phones, voice, fps=fps, n_frames=n_frames, options=options).values

    return made


def mean_phone_pose(talker: Talker, voice: VisualVoice) -> Method:
    """The simplest synthesis that knows phones: their mean poses, joined by straight lines from middle to middle."""
    n_speech, inventory = talker.model.n_speech, voice.tokens.inventory
    poses: dict[str, list[NDArray[np.float64]]] = {label: [] for label in inventory}
    for spoken in talker.utterances:
        frame_times = np.arange(len(spoken.shape)) / talker.fps
        middles = (spoken.phones.edges[:-1] + spoken.phones.edges[1:]) / 2
        read = np.stack([np.interp(middles, frame_times, spoken.shape[:, d]) for d in range(n_speech)], axis=1)
        for label, pose in zip(spoken.phones.phones, read, strict=True):
            poses[label].append(pose)
    mean = {label: np.mean(seen, axis=0) for label, seen in poses.items() if seen}

    def made(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.float32]:
        targets = targets_of(phones, inventory)
        middles = targets.spans[:, 1:3].mean(axis=1)
        keys = np.stack([mean[label] for label in targets.labels])
        times = np.arange(n_frames) / fps
        return np.stack([np.interp(times, middles, keys[:, d]) for d in range(n_speech)], axis=1).astype(np.float32)

    return made


@dataclass(frozen=True, slots=True, eq=False)
class _Real:
    """What the camera saw of a held-out utterance."""

    observation: Observation
    judged: slice
    parameters: NDArray[np.float32]
    opening: NDArray[np.float64]
    width: NDArray[np.float64]
    least: NDArray[np.float64]
    open: NDArray[np.float64]

    @classmethod
    def of(cls, observation: Observation, model: ShapeModel) -> "_Real":
        opening = measures.lip_opening(observation.landmarks)
        phones, fps = observation.phones, observation.fps
        return cls(
            observation,
            measures.judged_frames(phones, len(opening), fps),
            model.parameters(observation.landmarks)[:, : model.n_speech],
            opening,
            measures.lip_width(observation.landmarks),
            measures.least_openings(opening, phones, fps),
            measures.midpoint_openings(opening, phones, fps),
        )


def _scores(
    name: str,
    made: Sequence[NDArray[np.float32]],
    real: Sequence[_Real],
    model: ShapeModel,
    threshold: float,
    spent: float,
) -> Scores:
    utterances, openings, widths, least, opened = [], [], [], [], []
    for values, one in zip(made, real, strict=True):
        landmarks = model.shapes(values)
        opening, width = measures.lip_opening(landmarks), measures.lip_width(landmarks)
        phones, fps = one.observation.phones, one.observation.fps
        least.append(measures.least_openings(opening, phones, fps))
        opened.append(measures.midpoint_openings(opening, phones, fps))
        utterances.append(_utterance_score(one, values, opening, width, model))
        openings.append(np.stack([one.opening[one.judged], opening[one.judged]]))
        widths.append(np.stack([one.width[one.judged], width[one.judged]]))
    (real_opening, made_opening), (real_width, made_width) = np.hstack(openings), np.hstack(widths)
    seconds = sum(len(one.parameters) / one.observation.fps for one in real)
    return Scores(
        name,
        measures.correlation(real_opening, made_opening),
        measures.correlation(real_width, made_width),
        float(np.mean([score.rmse_z for score in utterances])),
        float(np.mean([score.dtw_cost for score in utterances])),
        measures.range_ratio(real_opening, made_opening),
        measures.share_below(np.concatenate(least), threshold),
        measures.share_below(np.concatenate(opened), threshold),
        spent / seconds,
        tuple(utterances),
    )


def _utterance_score(
    one: _Real, values: NDArray[np.float32], opening: NDArray[np.float64], width: NDArray[np.float64], model: ShapeModel
) -> UtteranceScore:
    n = min(measures.DTW_PARAMETERS, model.n_speech)
    spread, here = model.spread[:n], one.judged
    real, made = one.parameters[here, :n], values[here, :n]
    return UtteranceScore(
        one.observation.name,
        measures.correlation(one.opening[here], opening[here]),
        measures.correlation(one.width[here], width[here]),
        measures.rmse_z(real, made, spread),
        measures.warping_cost(real, made, spread, one.observation.fps),
        measures.range_ratio(one.opening[here], opening[here]),
        real.shape[0],
    )
