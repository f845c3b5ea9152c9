"""Time and size of the export of a clip of 60 s to each format, memory for an hour, and the fit of gestures to ARKit.

Run: ``PYTHONPATH=. python tests/bench/bench_export.py``
"""

import resource
import tempfile
import time
from pathlib import Path

import numpy as np

import tts2face
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, build_arkit_projection
from tts2face.interchange.exports.parts import Target
from tts2face.interchange.exports.table import FORMATS
from tts2face.types import concatenate_clips

SECONDS = 60.0
N_RUNS = 3
TEXT = "We were away a year ago, but Bob may move five big maps. Then the old man told them a very long story."
HOUR_FORMATS = ("track", "livelink", "a2f", "glb", "bvh", "npz", "oculus", "textgrid", "vtt")


def minute(session: tts2face.Session) -> list[tts2face.Piece]:
    """Pieces of a clip of about 60 s."""
    pieces = list(session.stream(" ".join([TEXT] * 12)))
    kept: list[tts2face.Piece] = []
    for piece in pieces:
        if piece.begin < SECONDS:
            kept.append(piece)
    return kept


def time_formats(pieces: list[tts2face.Piece], face: tts2face.AnimatedFace, folder: Path) -> None:
    """Print seconds (the median of three runs) and size of each format."""
    for one in FORMATS:
        if not one.is_installed:
            continue
        path = folder / f"clip{one.suffixes[0]}"
        took = []
        for _ in range(N_RUNS):
            began = time.perf_counter()
            tts2face.export(pieces, path, face=face, format=one.name)
            took.append(time.perf_counter() - began)
        print(f"{one.name:13} {np.median(took):6.3f} s  {path.stat().st_size / 1e6:7.2f} MB")


def measure_hour(pieces: list[tts2face.Piece], face: tts2face.AnimatedFace, folder: Path) -> None:
    """Print the growth of the process's largest memory while an hour is exported to each format."""
    rounds = int(np.ceil(3600.0 / sum(piece.clip.speech.waveform.duration for piece in pieces)))
    for name in HOUR_FORMATS:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        began = time.perf_counter()
        tts2face.export((piece for _ in range(rounds) for piece in pieces), folder / "hour", face=face, format=name)
        took = time.perf_counter() - began
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        size = (folder / "hour").stat().st_size / 1e6
        print(f"hour of {name:9} {took:6.1f} s  {size:8.1f} MB on disk  memory +{grown:.0f} MB")


def gesture_fit(pieces: list[tts2face.Piece], face: tts2face.Face) -> None:
    """Print how much of the displacement by gesture channels their ARKit weights reproduce."""
    for style in ("recorded", "largest"):
        clip = concatenate_clips([piece.clip for piece in pieces])
        motion = clip.motion.values.copy()
        if style == "largest":
            motion[:, 52:] *= 3.0
        target = Target(Path(), "x", 30, 30, 24_000, clip.motion.channels, face)  # type: ignore[arg-type]
        projection = build_arkit_projection(target)
        weights = projection.weights(motion)
        own = [face.shape_names.index(name) for name in ARKIT_SHAPES]
        frames = np.linspace(0, len(motion) - 1, 60).astype(int)
        rest = np.tensordot(motion[frames][:, own].clip(0, 1), face.shapes[own], 1)
        wanted = np.tensordot(motion[frames][:, projection.others], face.shapes[projection.others], 1)
        given = np.tensordot(weights[frames], face.shapes[own], 1) - rest
        moved = np.linalg.norm(wanted, axis=2).max(axis=0) > 0.1
        error = np.linalg.norm((given - wanted)[:, moved], axis=2)
        size = np.linalg.norm(wanted[:, moved], axis=2)
        share = 1 - (error**2).sum() / (size**2).sum()
        rms, wanted_rms = np.sqrt((error**2).mean()), np.sqrt((size**2).mean())
        print(
            f"gestures, {style}: {share:.2f} of the squared displacement; error rms {rms:.2f} mm of "
            f"{wanted_rms:.2f} mm, 95th percentile {np.percentile(error, 95):.2f} mm"
        )


def main() -> None:
    """Run all measurements."""
    session = tts2face.Session()
    pieces = minute(session)
    seconds = sum(piece.clip.speech.waveform.duration for piece in pieces)
    print(f"{seconds:.1f} s, {sum(len(piece.clip.motion) for piece in pieces)} frames")
    with tempfile.TemporaryDirectory() as name:
        time_formats(pieces, session.face, Path(name))
        gesture_fit(pieces, session.mesh)
        measure_hour(pieces, session.face, Path(name))


if __name__ == "__main__":
    main()
