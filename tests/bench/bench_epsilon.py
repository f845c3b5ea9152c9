"""Effect of epsilon on the weights of basis expressions (Ju and Lee 2008, section 4.1), on real recordings.

Run: ``python tests/bench/bench_epsilon.py ../shared/recordings [--cache FOLDER]``. The recordings are 40 videos of
GRID s1 and 20 s of Live Link Face, taken apart as by ``tts2face corpus gestures --epsilon``. Error: root mean square of
the landmarks as counted (lips at a tenth), of 41-frame means. Beyond: share of weights below 0 or above 1. Spread:
standard deviation within a recording.
"""

import argparse
from pathlib import Path

import numpy as np

from corpus_tools.build_palette import ESTIMATORS, StyleSource, build_basis, build_estimator
from corpus_tools.decomposition.blend_weights import moving_average
from corpus_tools.decomposition.capture import FaceRecording, resample_to_gesture_rate
from corpus_tools.decomposition.capture_files import read_livelink_recording
from corpus_tools.decomposition.decompose import weight_displacements
from corpus_tools.decomposition.recordings import read_video_recording
from corpus_tools.dense.tracked_pictures import find_videos
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from corpus_tools.training.pose_correction import fit_pose_correction
from tests.corpus_tools.decomposition.weight_errors import approximation_error
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.models.palette import GESTURE_FPS
from tts2face.video.networks import find_bundle

EPSILONS = (0.0, 0.1, 0.25, 0.5, 1.0)


def report(name: str, captured: list[FaceRecording]) -> None:
    face, leak = load_face("head"), fit_pose_correction(captured)
    basis = build_basis(StyleSource(recordings=Path()), captured, face)
    slow = [moving_average(resample_to_gesture_rate(leak.apply(one)).landmarks - basis.rest) for one in captured]
    counted, expressions = weight_displacements(np.concatenate(slow)), weight_displacements(basis.expressions)
    print(f"\n{name}: {len(counted)} frames, {root_mean_square(counted):.3f} mm from rest")
    print("| estimator | epsilon | error, mm | beyond 0 to 1 | mean size | spread in a recording | speed, 1/s |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for estimator in ESTIMATORS:
        for epsilon in EPSILONS:
            weights = build_estimator(estimator, basis, epsilon).weights(counted)
            error = approximation_error(
                counted[:, :N_MESH_LANDMARKS], expressions[:, :N_MESH_LANDMARKS], weights
            ).mean()
            beyond = np.mean((weights < -1e-9) | (weights > 1 + 1e-9))
            parts = np.split(weights, np.cumsum([len(one) for one in slow])[:-1])
            spread = np.mean([part.std(axis=0).mean() for part in parts])
            speed = np.concatenate([np.linalg.norm(np.diff(part, axis=0), axis=1) for part in parts]).mean()
            cells = f"{error:.3f} | {beyond:.0%} | {np.abs(weights).mean():.3f} | {spread:.3f}"
            print(f"| {estimator} | {epsilon:g} | {cells} | {speed * GESTURE_FPS:.3f} |", flush=True)


def root_mean_square(counted: np.ndarray) -> float:
    return float(np.sqrt(np.square(counted[:, :N_MESH_LANDMARKS]).sum(axis=2).mean(axis=1)).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--cache", type=Path)
    options = parser.parse_args()
    eyes = CachedTracker(RunOptions(options.cache).folder(), find_bundle(None))
    report("GRID s1", [read_video_recording(video, eyes) for video in find_videos(options.recordings / "grid_s1")])
    take = options.recordings / "livelink" / "testset_arkit61_60fps.csv"
    report("Live Link Face", [read_livelink_recording(take, load_face("head"))])


if __name__ == "__main__":
    main()
