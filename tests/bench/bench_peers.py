"""Curves of OpenFaceFX for the phones of a talker and of test people, as tracks for ``corpus evaluate --people``.

    pip install openfacefx
    python tests/bench/bench_peers.py grid_s1 ../shared/recordings/fadg0_tracks --out peers.csv
    tts2face corpus evaluate --people ../shared/recordings/fadg0_tracks --tracks peers.csv

Its channels are the weights of 15 visemes; `corpus evaluate` maps them to lips by a regression on the talker's own
recordings, so that the talker's range of motion is known to it.
"""

import argparse
import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.evaluation.person_tracks import read_person
from lexicon.phones import ARPABET, nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.talker import load_talker

RATE_HZ = 50.0
ARPABET_NAMES = {symbol: name.removesuffix("0") for name, symbol in ARPABET.items()}


def viseme_curves(phones: PhoneSequence) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (T,) and weights (T, 15) of the visemes."""
    from openfacefx import PhonemeSegment, build_viseme_curves

    segments = []
    for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        name = "SIL" if label == SILENCE else ARPABET_NAMES[nearest_phones(label, ARPABET_NAMES)[0]]
        segments.append(PhonemeSegment(name, float(start), float(end)))
    times, weights = build_viseme_curves(segments, fps=RATE_HZ)
    return np.asarray(times, np.float64), np.asarray(weights, np.float64)


def track_rows(talker: str, people: list[Path]) -> Iterator[list[object]]:
    """Rows of the CSV file; the first names the columns."""
    utterances = [(one.name, one.phones) for one in load_talker(talker).utterances]
    utterances += [(one.name, one.phones) for folder in people for one in read_person(folder)]
    for number, (name, phones) in enumerate(utterances):
        times, weights = viseme_curves(phones)
        if not number:
            yield ["utterance", "time", *(f"viseme{at}" for at in range(weights.shape[1]))]
        for time, row in zip(times, weights, strict=True):
            yield [name, f"{time:.4f}", *(f"{value:.5f}" for value in row)]


def main() -> None:
    """Write the tracks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("talker")
    parser.add_argument("people", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    with arguments.out.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows(track_rows(arguments.talker, arguments.people))


if __name__ == "__main__":
    main()
