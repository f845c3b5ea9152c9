"""Speed of gesture synthesis, and growth of the cost of a frame with the size of the palette.

Run: ``python tests/bench/bench_gestures.py [PALETTE]``. Twelve fields, two of each feature, at 30 frames a second, in
one thread; processor time, the least of three. They hear the palette's own recordings in random order.
"""

import argparse
import resource
import time
from dataclasses import dataclass

import numpy as np

from corpus_tools.studies.gestures.clips import replace_style, select_recordings
from corpus_tools.studies.gestures.measures import split_recordings
from tts2face.gestures.field import Field, FieldState, initial_state, sample_field
from tts2face.gestures.stream import GestureFields
from tts2face.models.palette import GESTURE_FPS, Palette, Style
from tts2face.models.palette_file import load_palette

SECONDS = 120
PARTS = (0.1, 1 / 3, 1.0)
COPIES = 2  # of six features: twelve fields
TRIES = 3


@dataclass(frozen=True, slots=True)
class Timed:
    """Microseconds a frame of each feature, and seconds in which its field is made."""

    frame_us: dict[str, float]
    made_s: dict[str, float]

    @property
    def real_time_factor(self) -> float:
        """Seconds of gestures a second, all fields together."""
        return 1e6 / (COPIES * GESTURE_FPS * sum(self.frame_us.values()))


def megabytes() -> float:
    """Peak memory of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def shuffled_intensity(style: Style) -> np.ndarray:
    """(T, 1) intensity of the style's recordings in random order."""
    parts = split_recordings(style.intensity, style.lengths)
    order = np.random.default_rng(5).permutation(len(parts))
    return np.resize(np.concatenate([parts[at] for at in order]), round(SECONDS * GESTURE_FPS))[:, None]


def frame_us(made: Field, start: FieldState, prosody: np.ndarray) -> float:
    sample_field(made, start, prosody[:3], np.full(3, 0.5))  # compile
    times = []
    for seed in range(TRIES):
        chances = np.random.default_rng(seed).random(len(prosody))
        began = time.process_time()
        sample_field(made, start, prosody, chances)
        times.append(time.process_time() - began)
    return min(times) / len(prosody) * 1e6


def measure_time(palette: Palette, name: str, prosody: np.ndarray) -> Timed:
    fields, frames, made_s = GestureFields(palette), {}, {}
    for feature in fields.features:
        began = time.process_time()
        made = fields.of(name, feature)
        made_s[feature] = time.process_time() - began
        frames[feature] = frame_us(made, initial_state(made, 0.5), prosody)
    return Timed(frames, made_s)


def main() -> None:
    """Print the figures that docs/performance.md sums up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("palette", nargs="?", default="starter")
    palette = load_palette(parser.parse_args().palette)
    name = max(palette.styles, key=lambda one: palette.styles[one].seconds)
    whole = palette.styles[name]
    prosody = shuffled_intensity(whole)
    measure_time(replace_style(palette, name, select_recordings(whole, np.arange(20))), name, prosody[:90])  # compile
    before = megabytes()
    order = np.random.default_rng(6).permutation(len(whole.lengths))
    found = {}
    for part in PARTS:
        kept = np.sort(order[: max(2, round(part * len(order)))])
        style = whole if part == 1 else select_recordings(whole, kept)
        found[part] = measure_time(replace_style(palette, name, style), name, prosody)
    features = list(found[1.0].frame_us)
    print(f"| {whole.seconds / 60:.0f} minutes | {' | '.join(features)} | twelve fields, x real time |")
    print(f"| --- |{' --- |' * (len(features) + 1)}")
    for part, one in found.items():
        cells = " | ".join(f"{one.frame_us[feature]:.1f}" for feature in features)
        print(f"| {part:.2f} of it | {cells} | {one.real_time_factor:.0f} |")
    print(f"\nFields of the whole palette made in {sum(found[1.0].made_s.values()):.1f} s.")
    print(f"Memory: {before:.0f} MB before, {megabytes():.0f} MB at its height, {megabytes() - before:.0f} MB more.")


if __name__ == "__main__":
    main()
