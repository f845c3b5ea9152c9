"""How fast phones become lip motion, and whether the time grows in step with the text and the corpus.

Run: ``python tests/bench/bench_motion.py [TALKER]``. The phones are those of the talker's own sentences, shuffled, with
pauses between them; each time is the least of five.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence, enforce_increasing
from tts2face.lips.exemplar import (
    DEFAULT_OPTIONS,
    ExemplarModel,
    build_exemplar_model,
    select_tokens,
    speech_trajectory,
)
from tts2face.lips.options import THEOBALD_2007
from tts2face.models.talker import Talker, Utterance
from tts2face.models.talker_file import read_talker
from tts2face.types import frame_count

FPS = 30.0
STARTER = Path(__file__).resolve().parents[2] / "tts2face/data/grid_s1.talker"


def text(talker: Talker, duration_s: float) -> PhoneSequence:
    """Phones of at least that many seconds."""
    stream = np.random.default_rng(1)
    labels, durations = [SILENCE], [0.3]
    while sum(durations) < duration_s:
        spoken = talker.utterances[int(stream.integers(len(talker.utterances)))].phones
        labels += [label for label in spoken.phones[1:-1] if label != SILENCE] + [SILENCE]
        kept = [label != SILENCE for label in spoken.phones[1:-1]]
        durations += [*spoken.durations[1:-1][kept].tolist(), 0.3]
    return PhoneSequence(labels, np.concatenate([[0.0], np.cumsum(durations)]))


def least_time(work: Callable[[], object]) -> float:
    """Seconds, the least of five after one warm-up."""
    work()
    times = []
    for _ in range(5):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


def main() -> None:
    """Print the figures that docs/performance.md sums up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("talker", nargs="?", type=Path, default=STARTER)
    talker = read_talker(parser.parse_args().talker)
    voice = build_exemplar_model(talker)
    print(
        f"{len(voice.tokens)} tokens; made ready in {least_time(lambda: build_exemplar_model(talker)) * 1000:.0f} ms\n"
    )
    print("| speech | phones | time | real-time factor | plain T07 |\n| --- | --- | --- | --- | --- |")
    for seconds in (1, 10, 60, 600):
        phones = text(talker, seconds)
        default, plain = (_motion_time(phones, voice, options) for options in (DEFAULT_OPTIONS, THEOBALD_2007))
        print(
            f"| {phones.end:.1f} s | {len(phones)} | {default * 1000:.1f} ms | {default / phones.end:.5f} "
            f"| {plain / phones.end:.5f} |"
        )
    print("\n| corpus | tokens | search, each phone |\n| --- | --- | --- |")
    phones = text(talker, 60)
    for copies in (0.125, 0.5, 1, 4, 10, 100):
        larger = build_exemplar_model(_of_size(talker, copies))
        spent = least_time(lambda larger=larger: select_tokens(phones, larger, DEFAULT_OPTIONS))
        print(f"| x {copies:g} | {len(larger.tokens)} | {spent / len(phones) * 1e6:.1f} us |")


def _motion_time(phones: PhoneSequence, voice: ExemplarModel, options: object) -> float:
    n_frames = frame_count(phones.end, FPS)
    return least_time(lambda: speech_trajectory(phones, voice, fps=FPS, n_frames=n_frames, options=options))


def _of_size(talker: Talker, copies: float) -> Talker:
    """The talker with a part of its utterances, or with all of them several times, their edges moved by some 3 ms."""
    kept = talker.utterances[: max(1, round(len(talker.utterances) * min(copies, 1)))]
    generator = np.random.default_rng(0)
    again = tuple(_jittered(spoken, generator) for _ in range(max(1, int(copies)) - 1) for spoken in kept)
    return replace(talker, utterances=kept + again)


def _jittered(spoken: Utterance, generator: np.random.Generator) -> Utterance:
    edges = spoken.phones.edges.copy()
    edges[1:-1] += generator.normal(0, 0.003, len(edges) - 2)
    return replace(spoken, phones=PhoneSequence(spoken.phones.phones, enforce_increasing(edges)))


if __name__ == "__main__":
    main()
