"""Seconds for each stage from a recording to an observation, and what the second tracking pass gains.

Run: python tests/bench/bench_corpus.py ../shared/recordings/grid_s1 20
"""

import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

from corpus_tools.recordings.folder import find_recordings, pronounce_recording
from tts2face.sound.alignment import Aligner
from tts2face.video.media import read_frames, read_sound
from tts2face.video.pose import remove_pose
from tts2face.video.tracking import FaceTracker

LIPS = (0, 13, 14, 17, 61, 291)


def noise(points: np.ndarray) -> tuple[float, float]:
    """Jitter of the lips in the first 0.4 s, before speech: second differences, mm; in the picture and in depth."""
    still = remove_pose(points, 25.0).landmarks[:10, LIPS]
    jitter = np.diff(still, n=2, axis=0) / np.sqrt(6)
    return float(jitter[..., :2].std()), float(jitter[..., 2].std())


def main(folder: Path, n_recordings: int) -> None:
    """Print the table."""
    tracker, aligner = FaceTracker(), Aligner()
    seconds: dict[str, float] = defaultdict(float)
    jitter: dict[str, list[tuple[float, float]]] = defaultdict(list)
    found = find_recordings(folder)
    for recording in found[:: max(1, len(found) // n_recordings)][:n_recordings]:
        marks = [time.perf_counter()]
        pictures = [picture.pixels for picture in read_frames(recording.video)]
        marks.append(time.perf_counter())
        tracked = tracker.track(lambda pictures=pictures: pictures, 25.0).points
        marks.append(time.perf_counter())
        aligner.align(read_sound(recording.video, 16_000), pronounce_recording(recording))
        marks.append(time.perf_counter())
        remove_pose(tracked, 25.0)
        marks.append(time.perf_counter())
        for stage, took in zip(("read", "track", "align", "pose"), np.diff(marks), strict=True):
            seconds[stage] += float(took) / len(pictures)
        once = np.array([found[0] for found, _ in tracker.follow(pictures)])
        jitter["one pass"].append(noise(once))
        jitter["two passes"].append(noise(tracked))
    for stage, took in seconds.items():
        sys.stdout.write(f"{stage:10} {n_recordings / took:8.0f} frames/s on one core\n")
    for passes, values in jitter.items():
        sys.stdout.write(f"{passes:10} jitter {np.mean(values, axis=0).round(3)} mm in the picture, in depth\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
