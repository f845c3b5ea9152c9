"""A real capture as 68 + 7 markers: accuracy of the recovered face, expressions and head pose.

Run: ``python tests/bench/bench_markers.py ../shared/recordings/livelink/testset_arkit61_60fps.csv``. The default head's
landmarks, moved by a Live Link Face capture, become markers of a person 6 % smaller in a C3D file at 120 frames/s.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from corpus_tools.decomposition.basis import transfer_basis
from corpus_tools.decomposition.blend_weights import build_least_squares_estimator, moving_average
from corpus_tools.decomposition.capture import resample, resample_to_gesture_rate
from corpus_tools.decomposition.capture_files import read_livelink_recording
from corpus_tools.decomposition.marker_sets import read_marker_set
from corpus_tools.decomposition.markers import read_marker_recording
from tests.corpus_tools.decomposition.made_markers import FPS, SIZE, made_take, write_c3d
from tts2face.face.expressions import expression_landmarks
from tts2face.face.landmarks import rest_landmarks
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, N_MESH_LANDMARKS, UPPER_LIP_INNER_MID
from tts2face.models.palette import EXPRESSIONS

DISTANCES = {
    "lips open": (UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID),
    "lip corners": (61, 291),
    "right lids": (159, 145),
    "left lids": (386, 374),
    "right brow to eye": (105, 33),
    "cheek to nose": (50, 1),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("--noise", type=float, default=0.0, help="mm, standard deviation of each coordinate")
    options = parser.parse_args()
    face, marker_set = load_face("head"), read_marker_set()
    take = read_livelink_recording(options.capture, face)
    landmarks, head = (resample(values, take.fps, FPS) for values in (take.landmarks, take.head))
    made = made_take(landmarks, head, face, marker_set)
    own = rest_landmarks(face)
    with tempfile.TemporaryDirectory() as folder:
        noise = options.noise * np.random.default_rng(0).normal(size=made.points.shape)
        path = write_c3d(Path(folder) / "take.c3d", made.names, made.points + noise)
        still = made_take(np.repeat(own[None], 5, axis=0), np.zeros((5, 6)), face, marker_set)
        rest = write_c3d(Path(folder) / "rest.c3d", still.names, still.points)
        found = resample_to_gesture_rate(read_marker_recording(path, face, marker_set, neutral=rest))
    truth = resample(made.landmarks, FPS, 30.0)
    moved, wanted = (
        found.landmarks[:, :N_MESH_LANDMARKS] - found.landmarks.mean(axis=0)[:N_MESH_LANDMARKS],
        truth - truth.mean(axis=0),
    )
    away = np.square(moved - wanted[:, :N_MESH_LANDMARKS]).sum(axis=2)
    off, marker_error = np.sqrt(away.mean()), np.sqrt(away[:, list(marker_set.landmarks.values())].mean())
    size = np.sqrt(np.square(wanted[:, :N_MESH_LANDMARKS]).sum(axis=2).mean())
    print(f"motion {size:.2f} mm, error {off:.2f} mm, {marker_error:.3f} mm at markers")
    for name, (a, b) in DISTANCES.items():
        far = [np.linalg.norm(places[:, a] - places[:, b], axis=1) for places in (found.landmarks, truth)]
        slope = np.polyfit(far[1], far[0], 1)[0]
        print(f"{name}: r {np.corrcoef(far)[0, 1]:.3f}, slope {slope:.2f}, spread {far[1].std():.2f} mm")
    turned = resample(head, FPS, 30.0)[:, :3]
    angles = found.head[:, :3] - found.head[:, :3].mean(axis=0) - turned + turned.mean(axis=0)
    print(f"head: {np.degrees(np.abs(angles)).mean():.2f} degrees, at most {np.degrees(np.abs(angles)).max():.2f}")
    basis = transfer_basis(expression_landmarks(face), own, own * SIZE)
    fitted = build_least_squares_estimator(basis.expressions[:, :N_MESH_LANDMARKS], 0.25)
    seen = fitted.weights(moving_average((found.landmarks - found.rest)[:, :N_MESH_LANDMARKS]))
    real = fitted.weights(moving_average((truth - own * SIZE)[:, :N_MESH_LANDMARKS]))
    for at, name in enumerate(EXPRESSIONS):
        both = seen[:, at], real[:, at]
        print(f"{name}: r {np.corrcoef(*both)[0, 1]:.3f}, mean {both[0].mean():.2f} for {both[1].mean():.2f}")


if __name__ == "__main__":
    main()
