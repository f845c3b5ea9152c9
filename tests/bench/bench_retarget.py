"""Speed and accuracy of retargeting speech from a talker to a face.

Run: ``python tests/bench/bench_retarget.py TALKER FACE [--utterances 50]``. The talker's own recordings are retargeted;
lips are read back from the face's landmarks. Closed: at the frame of a bilabial where the talker's middle lip points
are nearest, the face's are less than 0.3 mm apart.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tts2face.lips.retargeting import BILABIALS, build_retargeter
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    UPPER_LIP_INNER_MID,
)
from tts2face.models.talker import Talker, Utterance
from tts2face.models.talker_file import read_talker
from tts2face.types import Trajectory

Floats = NDArray[np.float64]

CLOSED_MM = 0.3
REACH_S = 0.03  # either side of a bilabial; its edges are that uncertain


def landmarks_of(face: Face, weights: NDArray[np.floating]) -> Floats:
    """(T, 478, 3) landmarks for (T, K) weights; 0 where the face has none."""
    mixed = face.landmark_weights.astype(np.float64)
    rest = np.einsum("lk,lkd->ld", mixed, face.vertices[face.landmark_vertices])
    moved = np.stack([np.einsum("lk,lkd->ld", mixed, shape[face.landmark_vertices]) for shape in face.shapes])
    places = np.zeros((len(weights), 478, 3))
    places[:, face.landmarks] = rest + np.tensordot(weights, moved, axes=1)
    return places


def opening(places: NDArray[np.floating]) -> Floats:
    """(T,) gap of the middle lip points, mm."""
    return np.asarray(places[:, UPPER_LIP_INNER_MID, 1] - places[:, LOWER_LIP_INNER_MID, 1], np.float64)


def width(places: NDArray[np.floating]) -> Floats:
    """(T,) distance of the lip corners, mm."""
    return np.linalg.norm(places[:, MOUTH_CORNER_LEFT] - places[:, MOUTH_CORNER_RIGHT], axis=1).astype(np.float64)


def bilabial_frames(utterance: Utterance, gaps: Floats, fps: float) -> list[int]:
    """Frames at which the talker's lips are nearest in each bilabial."""
    found = []
    phones = utterance.phones
    for phone, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        first = max(0, int(np.floor((start - REACH_S) * fps)))
        last = int(np.ceil((end + REACH_S) * fps)) + 1
        if phone in BILABIALS and len(gaps[first:last]):
            found.append(first + int(gaps[first:last].argmin()))
    return found


def report(talker: Talker, face: Face, n_utterances: int) -> None:
    """Print the figures."""
    began = time.perf_counter()
    ready = build_retargeter(talker, face)
    prepared = time.perf_counter() - began
    chosen = talker.utterances[:: max(1, len(talker.utterances) // n_utterances)][:n_utterances]
    ready.retarget(talker.speech_trajectory(chosen[0]))
    spent, facing, open_, wide, jerk = 0.0, [], [], [], []
    for utterance in chosen:
        speech = talker.speech_trajectory(utterance)
        began = time.perf_counter()
        motion = ready.retarget(speech)
        spent += time.perf_counter() - began
        of_face, of_talker = landmarks_of(face, motion.values), talker.model.shapes(speech.values)
        open_.append([opening(of_face), opening(of_talker)])
        wide.append([width(of_face), width(of_talker)])
        jerk.append([np.abs(np.diff(opening(places), 3)).mean() for places in (of_face, of_talker)])
        frames = bilabial_frames(utterance, opening(of_talker), talker.fps)
        pairs = of_face[frames][:, list(INNER_LIP_UPPER), 1] - of_face[frames][:, list(INNER_LIP_LOWER), 1]
        facing.append(pairs)
    gaps, opened, widened = np.concatenate(facing), np.hstack(open_), np.hstack(wide)
    seconds = opened.shape[1] / talker.fps
    middle = gaps[:, INNER_LIP_UPPER.index(UPPER_LIP_INNER_MID)]
    print(f"prepared in {prepared:.2f} s; {opened.shape[1]} frames, real-time factor {spent / seconds:.5f}")
    for name, both in (("opening", opened), ("width", widened)):
        slope = np.polyfit(both[1], both[0], 1)[0]
        print(f"{name}: r {np.corrcoef(both)[0, 1]:.4f}, slope {slope:.3f} mm of the face per mm of the talker")
    print(
        f"{len(gaps)} bilabials: closed {np.mean(middle < CLOSED_MM):.3f}, "
        f"all pairs {np.mean((gaps < CLOSED_MM).all(axis=1)):.3f}, "
        f"mean gap {middle.mean():.3f} mm, deepest overlap {-gaps.min():.2f} mm"
    )
    print(f"jerk of the opening over the talker's: {np.divide(*np.mean(jerk, axis=0)):.3f}")
    growth(ready.retarget, talker)


def growth(retarget: Callable[[Trajectory], Trajectory], talker: Talker) -> None:
    """Print the time per frame of short and long speech: it must not grow."""
    values = np.concatenate([utterance.shape[:, : talker.model.n_speech] for utterance in talker.utterances[:200]])
    channels = talker.speech_trajectory(talker.utterances[0]).channels
    for n_frames in (250, 2500, 15000):
        speech = Trajectory(channels, values[:n_frames], talker.fps)
        began = time.perf_counter()
        retarget(speech)
        spent = time.perf_counter() - began
        print(f"{len(speech)} frames: {1e6 * spent / len(speech):.0f} us a frame")


def main() -> None:
    """Read and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("talker", type=Path)
    parser.add_argument("face", nargs="?", default="head")
    parser.add_argument("--utterances", type=int, default=50)
    arguments = parser.parse_args()
    report(read_talker(arguments.talker), load_face(arguments.face), arguments.utterances)


if __name__ == "__main__":
    main()
