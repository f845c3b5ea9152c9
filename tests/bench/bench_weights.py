"""Weights of basis expressions on real faces: error against the number of samples, as Fig. 6 of Ju and Lee 2008.

Run: ``python tests/bench/bench_weights.py ../shared/recordings --picture docs/pictures/expression_weights.svg``. The
expressions are the default head's own, carried to the person; faces are averaged over 41 frames at 30 a second, and
every seventh is estimated. The error is the root mean square over the landmarks of the face, irises left out.
"""

import argparse
import pickle
import time
from pathlib import Path

import numpy as np

from corpus_tools.decomposition.basis import transfer_basis
from corpus_tools.decomposition.blend_weights import (
    N_AVERAGED,
    N_NEAREST,
    N_SAMPLES,
    Estimator,
    build_least_squares_estimator,
    build_nearest_samples_estimator,
    moving_average,
)
from corpus_tools.decomposition.capture import resample, resample_to_gesture_rate
from corpus_tools.decomposition.capture_files import read_livelink_recording
from corpus_tools.recordings.observe import observe
from corpus_tools.training.pose_correction import correct_pose
from tests.corpus_tools.decomposition.weight_errors import approximation_error
from tts2face.face.expressions import expression_landmarks
from tts2face.face.landmarks import rest_landmarks
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.models.palette import EXPRESSIONS, GESTURE_FPS

SAMPLES = (50, 100, 200, 500, 1000, 2000, 5000)
NEAREST = (5, 20, N_NEAREST, 150)
SLACKS = (0.0, 0.25, 0.5, 1.0)
DRAWN_SLACK = 0.25
AFFECTED = (N_AVERAGED + 1) // 2  # frames at an end whose mean reaches beyond it
EVERY = 7  # frames; neighbours of 41-frame means are alike
COLOURS = {5: "#2a8c3c", 20: "#2457c5", 60: "#c8281e", 150: "#b8860b"}


class Faces:
    """Averaged displacements (T, L, 3) of a source, and the basis (5, L, 3) on it."""

    def __init__(self, name: str, seen: list[np.ndarray], basis: np.ndarray) -> None:
        self.name, self.basis = name, basis[:, :N_MESH_LANDMARKS]
        self.raw = np.concatenate([one[::EVERY, :N_MESH_LANDMARKS] for one in seen])
        self.slow = np.concatenate([moving_average(one[:, :N_MESH_LANDMARKS])[::EVERY] for one in seen])

    def error(self, estimator: Estimator) -> float:
        return float(approximation_error(self.slow, self.basis, estimator.weights(self.slow)).mean())

    def drawn_errors(self, slack: float, n_seeds: int) -> dict[int, list[float]]:
        return {
            n_nearest: [self.sampled(slack, n_samples, n_nearest, n_seeds) for n_samples in SAMPLES]
            for n_nearest in NEAREST
        }

    def sampled(self, slack: float, n_samples: int, n_nearest: int, n_seeds: int) -> float:
        if n_nearest > n_samples:
            return float("nan")
        draws = [np.random.default_rng(seed) for seed in range(n_seeds)]
        return float(
            np.mean(
                [
                    self.error(
                        build_nearest_samples_estimator(
                            self.basis, draw, slack=slack, n_samples=n_samples, n_nearest=n_nearest
                        )
                    )
                    for draw in draws
                ]
            )
        )

    def report(self, n_seeds: int) -> dict[int, list[float]]:
        size = np.sqrt(np.square(self.slow).sum(axis=2).mean(axis=1)).mean()
        print(f"\n{self.name}: {len(self.slow)} faces, {size:.3f} mm from rest")
        print("| epsilon | least squares | paper, 1000 and 60 | weights by least squares | by the paper's |")
        print("| --- | --- | --- | --- | --- |")
        for slack in SLACKS:
            exact = build_least_squares_estimator(self.basis, slack)
            paper = build_nearest_samples_estimator(self.basis, np.random.default_rng(0), slack=slack)
            means = [
                ", ".join(f"{value:.2f}" for value in one.weights(self.slow).mean(axis=0)) for one in (exact, paper)
            ]
            paper_error = self.sampled(slack, N_SAMPLES, N_NEAREST, n_seeds)
            print(f"| {slack:g} | {self.error(exact):.3f} | {paper_error:.3f} | {means[0]} | {means[1]} |")
        errors = self.drawn_errors(DRAWN_SLACK, n_seeds)
        print(f"\n| epsilon {DRAWN_SLACK:g}, neighbours | " + " | ".join(str(n) for n in SAMPLES) + " |")
        print("| --- |" + " --- |" * len(SAMPLES))
        for n_nearest, row in errors.items():
            cells = [f"{value:.3f}" if np.isfinite(value) else "" for value in row]
            print(f"| {n_nearest} | " + " | ".join(cells) + " |", flush=True)
        for name, one in (("least squares", exact), ("paper", paper)):
            began = time.perf_counter()
            one.weights(self.slow)
            print(f"{name}: {1e6 * (time.perf_counter() - began) / len(self.slow):.1f} us a frame")
        return errors


def ends_of(seen: np.ndarray, n_frames: int = 60) -> None:
    """Print how far means at the beginning of recordings cut short are from those of the whole."""
    whole, away = moving_average(seen), []
    for first in range(25, len(seen) - n_frames, 5):
        cut = seen[first : first + n_frames]
        guesses = (
            moving_average(cut)[:AFFECTED],
            np.stack([cut[: 2 * t + 1].mean(axis=0) for t in range(AFFECTED)]),
            np.stack([cut[: t + AFFECTED].mean(axis=0) for t in range(AFFECTED)]),
        )
        off = [np.square(one - whole[first : first + AFFECTED]).sum(axis=2).mean(axis=1) for one in guesses]
        away.append(np.sqrt(off))
    errors = np.mean(away, axis=0)
    for name, error in zip(("mirrored", "shortened", "one-sided"), errors, strict=True):
        print(f"ends {name}: first frame {error[0]:.2f} mm away, all {AFFECTED} {error.mean():.3f} mm")


def plot_errors(panels: list[tuple[Faces, dict[int, list[float]]]]) -> str:
    """An SVG of one panel for each source."""
    parts = ['<rect width="100%" height="100%" fill="white"/>']
    for number, (faces, errors) in enumerate(panels):
        parts += _panel(faces, errors, 70 + 470 * number)
    body = "\n".join(parts)
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 400" font-family="sans-serif" font-size="13">\n'
        f"{body}\n</svg>\n"
    )


def _panel(faces: Faces, errors: dict[int, list[float]], left: int) -> list[str]:
    bound = faces.error(build_least_squares_estimator(faces.basis, DRAWN_SLACK))
    top = np.ceil(np.nanmax([max(row) for row in (np.nan_to_num(one) for one in errors.values())]) * 2) / 2

    def x(n: int) -> float:
        return left + 370 * float(np.log(n / SAMPLES[0]) / np.log(SAMPLES[-1] / SAMPLES[0]))

    def y(value: float) -> float:
        return 330 - 280 * value / top

    parts = [
        f'<text x="{left + 185}" y="28" text-anchor="middle" font-size="15">{faces.name}, ε {DRAWN_SLACK:g}</text>'
    ]
    for value in np.arange(0, top + 0.01, 0.5):
        parts.append(f'<path d="M{left} {y(value):.1f}h370" stroke="#ddd"/>')
        parts.append(f'<text x="{left - 8}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>')
    for n in SAMPLES:
        parts.append(f'<text x="{x(n):.1f}" y="350" text-anchor="middle">{n}</text>')
    for at, (n_nearest, row) in enumerate(errors.items()):
        told = [(x(n), y(value)) for n, value in zip(SAMPLES, row, strict=True) if np.isfinite(value)]
        colour = COLOURS[n_nearest]
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in told)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colour}"/>' for a, b in told]
        key = 60 + 18 * at
        parts.append(f'<path d="M{left + 235} {key - 4}h22" stroke="{colour}" stroke-width="2"/>')
        parts.append(f'<text x="{left + 264}" y="{key}">{n_nearest} nearest</text>')
    key = 60 + 18 * len(errors)
    for place in (f"M{left} {y(bound):.1f}h370", f"M{left + 235} {key - 4}h22"):
        parts.append(f'<path d="{place}" stroke="#111" stroke-width="2" stroke-dasharray="6 4"/>')
    parts.append(f'<text x="{left + 264}" y="{key}">least squares</text>')
    parts.append(f'<text x="{left + 185}" y="378" text-anchor="middle">number of random samples</text>')
    parts.append(
        f'<text transform="rotate(-90 {left - 44} 190)" x="{left - 44}" y="190" text-anchor="middle">error, mm</text>'
    )
    return parts


def sources(recordings: Path, observations: Path | None) -> tuple[Faces, Faces, np.ndarray]:
    """GRID s1 and Live Link, and the latter's displacements at every frame."""
    face = load_face("head")
    own, expressions = rest_landmarks(face), expression_landmarks(face)
    sizes = np.sqrt(np.square(expressions[:, :N_MESH_LANDMARKS]).sum(axis=2).mean(axis=1))
    print("expressions, mm: " + ", ".join(f"{name} {size:.2f}" for name, size in zip(EXPRESSIONS, sizes, strict=True)))
    kept = pickle.loads(observations.read_bytes()).kept if observations else observe(recordings / "grid_s1").kept
    kept = correct_pose(kept)
    rest = np.median(np.concatenate([one.landmarks[::5] for one in kept]), axis=0)
    seen = [resample(one.landmarks - rest, one.fps, GESTURE_FPS) for one in kept]
    grid = Faces("GRID s1, neutral sentences", seen, transfer_basis(expressions, own, rest).expressions)
    take = resample_to_gesture_rate(
        read_livelink_recording(recordings / "livelink" / "testset_arkit61_60fps.csv", face)
    )
    moved = take.landmarks[:, :N_MESH_LANDMARKS] - own[:N_MESH_LANDMARKS]
    return grid, Faces("Live Link Face, 20 s of speech", [moved], expressions), moved


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--observations", type=Path, help="a pickle of `corpus_tools.recordings.observe.Observations`")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    grid, livelink, moved = sources(options.recordings, options.observations)
    panels = [(faces, faces.report(options.seeds)) for faces in (grid, livelink)]
    ends_of(moved)
    if options.picture:
        options.picture.write_text(plot_errors(panels))


if __name__ == "__main__":
    main()
