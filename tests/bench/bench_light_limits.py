"""Light and sharpness of faces, as recorded and damaged, and what the damage does to tracked lips.

Run: ``PYTHONPATH=. python tests/bench/bench_light_limits.py RECORDINGS --others FOLDER [--cache FOLDER] [--n N]``.
Pictures of N recordings of one person and of all of FOLDER are damaged and tracked again. Prints the table of decision
141: lowest and highest of each measure; median and lowest r of lip opening and width against the tracking as recorded.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from corpus_tools.recordings.light import MEASURES, measure_light
from corpus_tools.recordings.limits import landmark_measures
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import observe
from corpus_tools.run_options import RunOptions
from tests.bench.bench_recording_limits import Pictures, lip_correlations, retrack
from tts2face.video.networks import find_bundle
from tts2face.video.streaming import StreamingTracker

RNG = np.random.default_rng(0)


def exposed(factor: float, noise: float = 4.0) -> Callable[[Pictures], Pictures]:
    """Pictures with another exposure and the noise of a webcam, in 8-bit levels."""
    return lambda pictures: [
        np.clip(one * factor + RNG.normal(0, noise, one.shape), 0, 255).astype(np.uint8) for one in pictures
    ]


def faded(share: float) -> Callable[[Pictures], Pictures]:
    """Pictures with a share of their contrast, as against the light."""
    return lambda pictures: [np.clip(150 + share * (one - 128.0), 0, 255).astype(np.uint8) for one in pictures]


def blurred(deviation_px: float) -> Callable[[Pictures], Pictures]:
    """Pictures out of focus."""
    return lambda pictures: [cv2.GaussianBlur(one, (0, 0), deviation_px).astype(np.uint8) for one in pictures]


DAMAGES: dict[str, Callable[[Pictures], Pictures]] = {
    "as recorded": lambda pictures: pictures,
    "noise of 10 levels": exposed(1.0, 10.0),
    "noise of 20 levels": exposed(1.0, 20.0),
    "light x 1/3": exposed(0.33),
    "light x 1/5": exposed(0.2),
    "light x 1/8": exposed(0.12),
    "light x 1.6": exposed(1.6),
    "light x 2": exposed(2.0),
    "light x 3": exposed(3.0),
    "contrast x 0.3": faded(0.3),
    "contrast x 0.15": faded(0.15),
    "blur of 2 px": blurred(2.0),
    "blur of 3 px": blurred(3.0),
    "blur of 4 px": blurred(4.0),
    "blur of 6 px": blurred(6.0),
}


def rows(seen: Sequence[Observation]) -> Iterator[str]:
    """Rows of the table."""
    tracker = StreamingTracker(find_bundle(None))
    for name, damage in DAMAGES.items():
        table, lost = [], 0
        for one in seen:
            made = retrack(one, damage, tracker)
            if made is None:
                lost += 1
                continue
            light = measure_light(made.frames, made.points, np.array([frame.time for frame in made.frames]))
            jitter = landmark_measures(made.filled, made.landmarks)["jitter"]
            same = lip_correlations(one, made.landmarks, made.first)
            table.append((*np.median(light[:, 1:], axis=0), jitter, *same))
        yield f"| {name} | {_cells(np.array(table))} | {lost} of {len(seen)} |" if table else f"| {name} | lost |"


def _cells(table: np.ndarray) -> str:
    low, median, high = np.quantile(table, [0, 0.5, 1], axis=0)
    ranges = [f"{low[at]:.3g} to {high[at]:.3g}" for at in range(len(MEASURES) + 1)]
    return " | ".join([*ranges, *(f"{median[at]:.3f}, {low[at]:.3f}" for at in (-2, -1))])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--others", type=Path, required=True)
    parser.add_argument("--cache", type=Path)
    parser.add_argument("--n", type=int, default=5)
    asked = parser.parse_args()
    one, others = (
        observe(path, run_options=RunOptions(asked.cache, 1)).kept for path in (asked.recordings, asked.others)
    )
    for line in rows([*one[:: max(1, len(one) // asked.n)][: asked.n], *others]):
        print(line, flush=True)


if __name__ == "__main__":
    main()
