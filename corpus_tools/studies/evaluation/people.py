"""Evaluation of a finished talker on other people: their phones and edges, curves z-scored per person.

A talker is synthesised from the phones of each test person. Faces differ in size and range of motion, so the opening
and the width of the lips are z-scored: real curves by that person's speech, synthesised ones by the talker's own
recordings.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.intervals import IntervalEstimate, PairedCurves, estimate, estimate_difference
from corpus_tools.measures.methods import SynthesisMethod, build_methods
from corpus_tools.measures.reference import LipCurves, ReferenceUtterance
from corpus_tools.measures.scale import CurveScale
from corpus_tools.measures.splits import check_unknown
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.heard import heard_phones, mapped_motion
from corpus_tools.studies.evaluation.tracks import ExternalTrack, map_tracks
from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.motion_measures import DTW_BAND_S, speech_frames, warping_cost
from tts2face.models.phone_network import PhoneNetwork
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import FloatArray

DEFAULT_METHOD, NETWORKS_METHOD, TRACKS_METHOD = "exemplar", "networks alone", "tracks"


@dataclass(frozen=True, slots=True, eq=False)
class TestUtterance:
    """One utterance of a test person: its observation, evaluated frames, and their z-scored curves (T, 2)."""

    __test__ = False  # no test class

    observation: Observation
    evaluated: slice
    real: FloatArray


@dataclass(frozen=True, slots=True)
class PhoneFigures:
    """Figures of one phone: number of tokens, whether the talker's recordings hold it, mean opening and width in z.

    ``made`` are the means of each method, by name.
    """

    phone: str
    n_tokens: int
    is_heard: bool
    real: tuple[float, float]
    made: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class PeopleEvaluation:
    """Figures of methods on test people: by method, between methods, and by phone.

    ``heard`` holds r of the opening for each method, in the frames of phones that the talker's recordings hold, and in
    those of other phones (NaN if there are none). ``warnings`` are about names that the talker's recordings share.
    """

    n_people: int
    n_utterances: int
    figures: Mapping[str, Mapping[str, IntervalEstimate]]
    differences: Mapping[tuple[str, str], Mapping[str, IntervalEstimate]]
    phones: tuple[PhoneFigures, ...]
    heard: Mapping[str, tuple[float, float]]
    warnings: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Dictionary for JSON."""
        return {
            "n_people": self.n_people,
            "n_utterances": self.n_utterances,
            "figures": {name: _plain(values) for name, values in self.figures.items()},
            "differences": [
                {"method": difference, "minus": other, **_plain(values)}
                for (difference, other), values in self.differences.items()
            ],
            "phones": [asdict(phone) for phone in self.phones],
            "heard": {name: list(values) for name, values in self.heard.items()},
            "warnings": list(self.warnings),
        }


def evaluate_people(
    talker: Talker,
    people: Sequence[Sequence[Observation]],
    tracks: Mapping[str, ExternalTrack] | None = None,
    sounds: Mapping[str, Path] | None = None,
) -> PeopleEvaluation:
    """Figures of a finished talker's methods, of external tracks, and of what is heard in sounds, on test people.

    Tracks are mapped to the talker's parameters by a regression on those of its own utterances that they hold. Of the
    sounds, by the utterances' names, lips are made with their words and without.

    Raises
    ------
    InputError
        A person has no utterance, an utterance is one of the talker's, or tracks lack a test utterance or hold too few
        of the talker's.
    """
    tests = z_score_people(people)
    warnings = check_unknown(talker, [test.observation for test in tests])
    methods = dict(build_methods(talker))
    if talker.network is not None:
        methods[NETWORKS_METHOD] = _networks_method(talker.network)
    curves = synthesise_people(talker, methods, tests)
    if tracks is not None:
        real = [ReferenceUtterance.of(test.observation, talker.model) for test in tests]
        mapped = iter(map_tracks(tracks, talker, real))
        curves |= synthesise_people(talker, {TRACKS_METHOD: lambda *_: next(mapped)}, tests)
    if sounds is not None:
        curves |= _heard_curves(talker, methods[DEFAULT_METHOD], tests, sounds)
    heard = {label for utterance in talker.utterances for label in utterance.phones.phones}
    return replace(compare_people(tests, curves, n_people=len(people), heard=heard), warnings=warnings)


def _heard_curves(
    talker: Talker, method: SynthesisMethod, tests: Sequence[TestUtterance], sounds: Mapping[str, Path]
) -> dict[str, tuple[FloatArray, ...]]:
    """Curves of the default on phones that are found in the sounds, and of the audio maps."""
    seen = [test.observation for test in tests]
    curves: dict[str, tuple[FloatArray, ...]] = {}
    for name, phones in heard_phones(seen, sounds).items():
        spoken = [
            replace(test, observation=replace(test.observation, phones=found))
            for test, found in zip(tests, phones, strict=True)
        ]
        curves |= synthesise_people(talker, {name: method}, spoken)
    for name in talker.audio_maps:
        mapped = iter(mapped_motion(talker, name, seen, sounds))
        curves |= synthesise_people(talker, {f"audio map {name}": lambda *_, mapped=mapped: next(mapped)}, tests)
    return curves


def _networks_method(network: PhoneNetwork) -> SynthesisMethod:
    def motion(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.float32]:
        return network.parameters(phones, np.arange(n_frames) / fps)

    return motion


def z_score_people(people: Sequence[Sequence[Observation]]) -> tuple[TestUtterance, ...]:
    """Utterances of all people with curves z-scored per person."""
    if not people or not all(people):
        raise InputError("there is no utterance to test; give folders with tracks of people")
    found: list[TestUtterance] = []
    for utterances in people:
        here = [speech_frames(utterance.phones, len(utterance.landmarks), utterance.fps) for utterance in utterances]
        curves = [
            LipCurves.of(utterance.landmarks[span]).values() for utterance, span in zip(utterances, here, strict=True)
        ]
        scale = CurveScale.of(curves)
        found += [
            TestUtterance(utterance, span, scale.z_score(values))
            for utterance, span, values in zip(utterances, here, curves, strict=True)
        ]
    return tuple(found)


def synthesise_people(
    talker: Talker,
    methods: Mapping[str, SynthesisMethod],
    tests: Sequence[TestUtterance],
    scale: CurveScale | None = None,
) -> dict[str, tuple[FloatArray, ...]]:
    """Curves (T, 2) of every method on the evaluated frames, z-scored by `scale`: by default its recordings."""
    scale = scale or CurveScale.of_talker(talker)

    def curves(method: SynthesisMethod, test: TestUtterance) -> FloatArray:
        seen = test.observation
        motion = method(seen.phones, len(seen.landmarks), seen.fps)
        return scale.z_score(LipCurves.of_parameters(talker.model, motion[test.evaluated]).values())

    return {name: tuple(curves(method, test) for test in tests) for name, method in methods.items()}


def compare_people(
    tests: Sequence[TestUtterance],
    curves: Mapping[str, Sequence[FloatArray]],
    *,
    n_people: int,
    heard: Collection[str],
    baselines: Collection[str] | None = None,
) -> PeopleEvaluation:
    """Figures of methods whose curves are given for each utterance.

    Parameters
    ----------
    curves
        z-scored curves (T, 2) of the evaluated frames of each utterance, by method.
    heard
        Phones of the talker's recordings.
    baselines
        Methods with which every other one is compared; by default all.
    """
    paired = {name: pair_curves(tests, values) for name, values in curves.items()}
    others = paired.keys() if baselines is None else baselines
    return PeopleEvaluation(
        n_people,
        len(tests),
        {name: estimate(item) for name, item in paired.items()},
        {
            (item, other): estimate_difference(paired[item], paired[other])
            for item in paired
            for other in others
            if item != other and other in paired
        },
        _phone_figures(tests, curves, heard),
        {name: _heard_correlations(tests, values, heard) for name, values in curves.items()},
    )


def pair_curves(tests: Sequence[TestUtterance], curves: Sequence[FloatArray]) -> PairedCurves:
    """Statistics of a method whose z-scored curves (T, 2) are given for each utterance."""
    costs = [
        warping_cost(test.real, made, np.ones(2), round(DTW_BAND_S * test.observation.fps))
        for test, made in zip(tests, curves, strict=True)
    ]
    return PairedCurves.of([test.real for test in tests], curves, costs)


def _phone_figures(
    tests: Sequence[TestUtterance], curves: Mapping[str, Sequence[FloatArray]], heard: Collection[str]
) -> tuple[PhoneFigures, ...]:
    rows: dict[str, list[FloatArray]] = {}  # by phone, for each token (1 + methods, 2)
    for at, test in enumerate(tests):
        every = np.stack([test.real, *(values[at] for values in curves.values())])
        labels = _frame_phones(test)
        for number in np.unique(labels):
            label = test.observation.phones.phones[number]
            if label != SILENCE:
                rows.setdefault(label, []).append(every[:, labels == number].mean(axis=1))
    found = []
    for label, tokens in sorted(rows.items()):
        real, *made = np.mean(tokens, axis=0)
        means = {name: (float(value[0]), float(value[1])) for name, value in zip(curves, made, strict=True)}
        found.append(PhoneFigures(label, len(tokens), label in heard, (float(real[0]), float(real[1])), means))
    return tuple(found)


def _heard_correlations(
    tests: Sequence[TestUtterance], curves: Sequence[FloatArray], heard: Collection[str]
) -> tuple[float, float]:
    parts = []
    for test in tests:
        is_heard = np.array([label in heard or label == SILENCE for label in test.observation.phones.phones])
        parts.append(is_heard[_frame_phones(test)])
    known = np.concatenate(parts)
    real, made = (np.concatenate([values[:, 0] for values in some]) for some in ([t.real for t in tests], curves))

    def correlation(here: NDArray[np.bool_]) -> float:
        return float(np.corrcoef(real[here], made[here])[0, 1]) if here.sum() > 1 and made[here].std() > 0 else np.nan

    return correlation(known), correlation(~known)


def _frame_phones(test: TestUtterance) -> NDArray[np.int64]:
    """(T,) index of the phone at each evaluated frame."""
    phones = test.observation.phones
    times = np.arange(test.evaluated.start, test.evaluated.start + len(test.real)) / test.observation.fps
    # frames beyond the labelled phones count to the first or the last
    return np.clip(np.searchsorted(phones.edges, times, side="right") - 1, 0, len(phones) - 1)


def _plain(values: Mapping[str, IntervalEstimate]) -> dict[str, dict[str, float]]:
    return {name: asdict(value) for name, value in values.items()}
