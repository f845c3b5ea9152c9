"""Curves of OpenFaceFX for the phones of a talker and of test people, as tracks for ``corpus evaluate --people``.

By default its channels are opening and width of the shipped head's lips moved by its ARKit weights, as its users see
them; with `--visemes`, the weights of its 15 visemes. `corpus evaluate` maps either to lips by a regression on the
talker's own recordings: with visemes, it thereby learns their shapes from the talker:

    pip install openfacefx
    python tests/bench/bench_peers.py grid_s1 ../shared/recordings/fadg0_tracks --out peers.csv
    tts2face corpus evaluate --people ../shared/recordings/fadg0_tracks --tracks peers.csv
"""

import argparse
import csv
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.reference import LipCurves
from corpus_tools.studies.evaluation.person_tracks import read_person
from lexicon.phones import ARPABET, nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.face.landmarks import moved_landmarks
from tts2face.lips.performer import match_shapes
from tts2face.models.face_loading import load_face
from tts2face.models.talker_file import load_talker
from tts2face.types import Trajectory

RATE_HZ = 50.0
CurveSource = Callable[[PhoneSequence], tuple[NDArray[np.float64], NDArray[np.float64]]]
ARPABET_NAMES = {symbol: name.removesuffix("0") for name, symbol in ARPABET.items()}


def viseme_curves(phones: PhoneSequence) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (T,) and weights (T, 15) of the visemes."""
    from openfacefx import build_viseme_curves

    times, weights = build_viseme_curves(_segments(phones), fps=RATE_HZ)
    return np.asarray(times, np.float64), np.asarray(weights, np.float64)


def _segments(phones: PhoneSequence) -> list[Any]:
    from openfacefx import PhonemeSegment

    segments = []
    for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        name = "SIL" if label == SILENCE else ARPABET_NAMES[nearest_phones(label, ARPABET_NAMES)[0]]
        segments.append(PhonemeSegment(name, float(start), float(end)))
    return segments


def head_curves(phones: PhoneSequence) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (T,), and opening and width (T, 2) of the lips of the shipped head moved by its ARKit curves."""
    from openfacefx import generate_from_alignment, sample

    retargeting = import_module("openfacefx.retarget")
    track = retargeting.retarget(generate_from_alignment(_segments(phones)), retargeting.PRESETS["arkit"])
    times = np.arange(int(phones.end * RATE_HZ) + 1) / RATE_HZ
    names = [channel.name for channel in track.channels]
    weights = np.stack([sample(channel, times) for channel in track.channels], axis=1)
    face = load_face("head")
    moved = moved_landmarks(face, match_shapes(Trajectory(tuple(names), weights.astype(np.float32), RATE_HZ), face))
    return times, LipCurves.of(moved).values()


def track_rows(talker: str, people: list[Path], curves: CurveSource) -> Iterator[list[object]]:
    """Rows of the CSV file; the first names the columns."""
    utterances = [(one.name, one.phones) for one in load_talker(talker).utterances]
    utterances += [(one.name, one.phones) for folder in people for one in read_person(folder)]
    for number, (name, phones) in enumerate(utterances):
        times, weights = curves(phones)
        if not number:
            yield ["utterance", "time", *(f"channel{at}" for at in range(weights.shape[1]))]
        for time, row in zip(times, weights, strict=True):
            yield [name, f"{time:.4f}", *(f"{value:.5f}" for value in row)]


def main() -> None:
    """Write the tracks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("talker")
    parser.add_argument("people", type=Path, nargs="+")
    parser.add_argument("--visemes", action="store_true")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    curves = viseme_curves if arguments.visemes else head_curves
    with arguments.out.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows(track_rows(arguments.talker, arguments.people, curves))


if __name__ == "__main__":
    main()
