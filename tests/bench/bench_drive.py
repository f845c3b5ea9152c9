"""Speech-driven lips: correlation of features with the face, and audio maps on held-out utterances.

Run: ``python tests/bench/bench_drive.py ../shared/recordings/grid_s1`` (``--quick`` for a look; ``--choose`` for the
inner cross-validation; ``--picture docs/pictures/cca_strength.svg`` draws the ties as Fig. 5 of Theobald et al. 2007).
"""

import argparse
import pickle
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.reference import ReferenceUtterance, Thresholds
from corpus_tools.measures.scores import Scores, score_splits
from corpus_tools.measures.splits import split_into_folds, split_randomly
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import observe
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.training.canonical_correlation import canonical_correlation
from corpus_tools.training.learn_audio_maps import (
    AUDIO_MAP_FEATURES,
    TALKER_NETWORK_OPTIONS,
    build_training_utterances,
    sound_features,
    utterance_features,
)
from corpus_tools.training.linear_audio_map import learn_linear_map
from corpus_tools.training.network_audio_map import NetworkMapOptions, learn_network_map
from corpus_tools.training.pose_correction import fit_pose_correction
from corpus_tools.training.train_talker import learn_talker
from tts2face.lips import explanation
from tts2face.models.audio_map import AudioMap
from tts2face.sound.features import FEATURE_RATE
from tts2face.sound.pauses import speech_level
from tts2face.types import Waveform
from tts2face.video.media import read_sound

PLAIN = ("formants", "lpc", "lsf", "mfcc")
FRAMES = (50, 100, 200, 300, 500, 700, 1000, 1500, 2000, 3000)
COLOURS = {"formants": "#2a8c3c", "lpc": "#2457c5", "lsf": "#111111", "mfcc": "#c8281e"}
COLUMNS = ("r_opening", "r_width", "rmse_z", "dtw_cost", "range_ratio", "closure", "false_closure")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--observations", type=Path, help="a pickle of `corpus_tools.recordings.observe.Observations`")
    parser.add_argument("--hold-out", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--choose", action="store_true")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    kept = (
        pickle.loads(options.observations.read_bytes()).kept
        if options.observations
        else observe(options.recordings).kept
    )
    if options.quick:
        kept, options.hold_out, options.trials = kept[:120], 30, 10
    train, test = split_randomly(kept, hold_out=options.hold_out, seed=options.seed)
    leak = fit_pose_correction(train)
    bench = Bench(*(tuple(leak.apply(one) for one in part) for part in (train, test)))
    if options.choose:
        bench.choose()
        return
    ties = bench.ties(options.trials, options.seed)
    if options.picture:
        options.picture.write_text(plot_ties(ties))
    bench.compare()


def sampled_correlations(
    a: NDArray[np.floating], b: NDArray[np.floating], n_frames: Sequence[int], *, trials: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(N, trials) first canonical correlation of as many randomly selected frames (T07 Fig. 5)."""
    strengths = np.zeros((len(n_frames), trials))
    for row, n in enumerate(n_frames):
        for trial in range(trials):
            chosen = rng.choice(len(a), n, replace=False)
            strengths[row, trial] = canonical_correlation(a[chosen], b[chosen]).correlations[0]
    return strengths


class Bench:
    def __init__(self, train: tuple[Observation, ...], test: tuple[Observation, ...]) -> None:
        self.train, self.test = train, test
        self.heard: dict[str, dict] = {}
        self.kept = (*train, *test)

    def of(self, kind: str) -> dict:
        if kind not in self.heard:
            parts = kind.split("+")
            missing = [part for part in parts if part not in self.heard]
            self.heard |= sound_features(self.kept, missing) if missing else {}
            names = self.heard[parts[0]]
            self.heard[kind] = {
                name: np.concatenate([self.heard[part][name] for part in parts], axis=1) for name in names
            }
        return self.heard[kind]

    def ties(self, trials: int, seed: int) -> dict[str, np.ndarray]:
        """First canonical correlation of randomly selected frames, mean over trials."""
        model = learn_talker(self.train, metadata=EVALUATION_METADATA).model
        speech = [explanation.speech_frames(one.phones, len(one.landmarks), one.fps) for one in self.train]
        seen = np.concatenate(
            [model.parameters(one.landmarks[here])[:, :20] for one, here in zip(self.train, speech, strict=True)]
        )
        found = {}
        print("| feature | " + " | ".join(str(n) for n in FRAMES) + " |\n| --- |" + " --- |" * len(FRAMES))
        for kind in (*PLAIN, "lsf+level", "mfcc+lsf"):
            heard = self.of(kind)
            table = np.concatenate([heard[one.name][here] for one, here in zip(self.train, speech, strict=True)])
            ns = [n for n in FRAMES if n <= len(table)]
            strengths = sampled_correlations(table, seen, ns, trials=trials, rng=np.random.default_rng(seed))
            found[kind] = strengths.mean(axis=1)
            print(f"| {kind} | " + " | ".join(f"{value:.3f}" for value in found[kind]) + " |", flush=True)
        return found

    def learnt(
        self, kind: str, network: NetworkMapOptions | None, context: int, learn: tuple, talker: object
    ) -> AudioMap:
        lessons = build_training_utterances(learn, talker.model, self.of(kind))
        if network is None:
            return learn_linear_map(lessons, feature=kind, before=context, after=context)
        return learn_network_map(lessons, feature=kind, options=network)

    def score(self, name: str, kind: str, drive: AudioMap, test: tuple, talker: object) -> Scores:
        real = [ReferenceUtterance.of(one, talker.model) for one in test]
        made = [drive.parameters(self.of(kind)[one.name]) for one in test]
        one = score_splits(name, [(talker.model, real, made)], Thresholds.of(real))
        print(
            f"| {one.method} | {one['r_opening']:.3f} | {one['r_width']:.3f} | {one['rmse_z']:.3f} "
            f"| {one['dtw_cost']:.3f} | {one['range_ratio']:.2f} | {one['closure']:.2f} | {one['false_closure']:.2f} |",
            flush=True,
        )
        return one

    def methods(self) -> list[tuple[str, str, NetworkMapOptions | None, int]]:
        found: list = [(f"linear, {kind}", kind, None, 0) for kind in (*PLAIN, "mfcc+level", "lsf+level", "mfcc+lsf")]
        found += [(f"linear, {kind}, 5 frames either side", kind, None, 5) for kind in ("mfcc", "mfcc+lsf")]
        plain = replace(TALKER_NETWORK_OPTIONS, n_hidden=10, articulation=0.0)
        for kind in (*PLAIN, "lsf+level", "mfcc+lsf"):
            found.append((f"network, {kind}, 10 units, 5 frames", kind, plain, 0))
        for frames in (0, 1, 3, 4, 7):
            found.append(
                (f"network, mfcc, 10 units, {frames} frames", "mfcc", replace(plain, before=frames, after=frames), 0)
            )
        for units in (5, 20, 40, 80):
            found.append((f"network, mfcc+lsf, {units} units, 5 frames", "mfcc+lsf", replace(plain, n_hidden=units), 0))
        for share in (0.5, 1.0):
            name = f"network, mfcc+lsf, 40 units, 5 frames, articulation {share:g}"
            found.append((name, "mfcc+lsf", replace(plain, n_hidden=40, articulation=share), 0))
        return found

    def compare(self) -> None:
        """The chosen drives and those of the paper on the utterances held out."""
        talker = learn_talker(self.train, metadata=EVALUATION_METADATA)
        head()
        chosen = (
            ("linear, mfcc (T07)", "mfcc", None, 0),
            (f"linear, {AUDIO_MAP_FEATURES} (default `linear`)", AUDIO_MAP_FEATURES, None, 0),
            (f"linear, {AUDIO_MAP_FEATURES}, 5 frames either side", AUDIO_MAP_FEATURES, None, 5),
            (
                "network, mfcc, 10 units, 5 frames (T07)",
                "mfcc",
                replace(TALKER_NETWORK_OPTIONS, n_hidden=10, articulation=0.0),
                0,
            ),
            ("the same, articulation 0.5", "mfcc", replace(TALKER_NETWORK_OPTIONS, n_hidden=10), 0),
            (
                f"network, {AUDIO_MAP_FEATURES}, 40 units, 5 frames",
                AUDIO_MAP_FEATURES,
                replace(TALKER_NETWORK_OPTIONS, articulation=0.0),
                0,
            ),
            ("the same, articulation 0.5 (default `network`)", AUDIO_MAP_FEATURES, TALKER_NETWORK_OPTIONS, 0),
        )
        for name, kind, network, context in chosen:
            drive = self.learnt(kind, network, context, self.train, talker)
            self.score(name, kind, drive, self.test, talker)
        self.made_as_loud(drive, talker)

    def made_as_loud(self, drive: AudioMap, talker: object) -> None:
        """Every utterance made as loud as all together, as recordings of others are."""
        learnt = np.concatenate([self.of("level")[one.name] for one in self.train])
        drive = replace(drive, loudness=speech_level(learnt, 1.0 / self.train[0].fps))
        kept = self.heard[AUDIO_MAP_FEATURES]
        louder = {}
        for one in self.test:
            sound = read_sound(one.video, FEATURE_RATE)
            gain = drive.gain_for(speech_level(self.of("level")[one.name], 1.0 / self.train[0].fps))
            louder[one.name] = utterance_features(
                one, Waveform(np.clip(gain * sound.samples, -1, 1), FEATURE_RATE), AUDIO_MAP_FEATURES
            )
        self.heard[AUDIO_MAP_FEATURES] = louder
        self.score("the same, each utterance made as loud as the talker", AUDIO_MAP_FEATURES, drive, self.test, talker)
        self.heard[AUDIO_MAP_FEATURES] = kept

    def choose(self) -> None:
        """Every method by three-fold cross-validation on the training utterances; means of the folds."""
        parts = split_into_folds(self.train, n_folds=3, seed=0)
        talkers = [learn_talker(learn, metadata=EVALUATION_METADATA) for learn, _ in parts]
        rows = []
        for name, kind, network, context in self.methods():
            every = []
            for (learn, check), talker in zip(parts, talkers, strict=True):
                drive = self.learnt(kind, network, context, learn, talker)
                every.append(self.score(f"{name} (fold)", kind, drive, check, talker))
            means = [np.mean([getattr(one, what) for one in every]) for what in COLUMNS]
            rows.append(f"| {name} | " + " | ".join(f"{value:.3f}" for value in means) + " |")
        head()
        print("\n".join(rows))


def head() -> None:
    print("\n| drive | " + " | ".join(COLUMNS).replace("_", " ") + " |\n| --- |" + " --- |" * len(COLUMNS))


def plot_ties(ties: dict[str, np.ndarray]) -> str:
    """The ties as a picture in SVG: one line a feature, frames across, correlation up."""
    low, width, height, left, top = 0.4, 620, 340, 70, 30

    def place(n: float, value: float) -> tuple[float, float]:
        across = (np.log10(n) - np.log10(FRAMES[0])) / np.log10(FRAMES[-1] / FRAMES[0])
        return left + width * across, top + height * (1.0 - (value - low) / (1.0 - low))

    text = 'font-family="sans-serif" font-size="14"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + width + 130} {top + height + 60}">',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for value in np.arange(low, 1.01, 0.1):
        _, y = place(FRAMES[0], value)
        lines.append(f'<path d="M{left} {y:.1f}h{width}" stroke="#ddd"/>')
        lines.append(f'<text x="{left - 10}" y="{y + 5:.1f}" text-anchor="end" {text}>{value:.1f}</text>')
    for n in (50, 100, 200, 500, 1000, 3000):
        x, _ = place(n, low)
        lines.append(f'<text x="{x:.1f}" y="{top + height + 22}" text-anchor="middle" {text}>{n}</text>')
    middle = left + width / 2
    lines.append(f'<text x="{middle}" y="{top + height + 48}" text-anchor="middle" {text}>frames of 40 ms</text>')
    turned = f'transform="rotate(-90 20 {top + height / 2})"'
    lines.append(
        f'<text x="20" y="{top + height / 2}" text-anchor="middle" {turned} {text}>first canonical correlation</text>'
    )
    ends = sorted((place(FRAMES[-1], ties[kind][-1])[1], kind) for kind in PLAIN)
    last = -np.inf
    for y, kind in ends:
        points = [place(n, value) for n, value in zip(FRAMES, ties[kind], strict=False)]
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        lines.append(f'<path d="M{path}" fill="none" stroke="{COLOURS[kind]}" stroke-width="2"/>')
        lines += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{COLOURS[kind]}"/>' for x, y in points]
        last = max(y, last + 18)
        shown = kind if kind == "formants" else kind.upper()
        lines.append(f'<text x="{left + width + 14}" y="{last + 5:.1f}" fill="{COLOURS[kind]}" {text}>{shown}</text>')
    return "\n".join([*lines, "</svg>"])


if __name__ == "__main__":
    main()
