"""A performer's video on faces: how near lips, lids and head come, found again in the clip, and how fast it is.

Run: ``python tests/bench/bench_mimic.py ../shared/recordings/grid_s1/clips --takes 6``.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from tts2face.models.landmarks import MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT, eye_aperture, inner_lip_gaps
from tts2face.picture.film import write_clips
from tts2face.picture.options import Picture
from tts2face.session.performance import retarget_take, take_clips
from tts2face.session.session import Session
from tts2face.video.blendshapes import BlendshapeReader
from tts2face.video.media import read_frames, read_media_info, read_sound
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.streaming import StreamingTracker
from tts2face.video.take import Take, read_take
from tts2face.video.tracking import FaceTracker


def track_clip(path: Path, tracker: FaceTracker) -> tuple[np.ndarray, np.ndarray]:
    """Landmarks in mm and head angles in degrees against their middle, of a clip."""
    fps = read_media_info(path).fps
    posed = remove_pose(tracker.track(lambda: (picture.pixels for picture in read_frames(path)), fps).points, fps)
    angles = np.degrees(head_angles(posed.rotations))
    return posed.landmarks, angles - np.median(angles, axis=0)


def motion_errors(take: Take, shown: tuple[np.ndarray, np.ndarray]) -> list[float]:
    """Correlations of opening, width and lids, ratio of the openings' ranges, and errors of pitch, yaw, roll."""

    def curves(landmarks: np.ndarray) -> list[np.ndarray]:
        width = np.linalg.norm(landmarks[:, MOUTH_CORNER_LEFT] - landmarks[:, MOUTH_CORNER_RIGHT], axis=1)
        return [inner_lip_gaps(landmarks)[:, 5], width, eye_aperture(landmarks, "Left")]

    source, again = curves(take.landmarks), curves(shown[0])
    rates = [float(np.corrcoef(a, b)[0, 1]) for a, b in zip(source, again, strict=True)]
    away = np.abs(np.degrees(take.head.values[:, :3]) - shown[1]).mean(axis=0)
    return [*rates, float(again[0].std() / source[0].std()), *(float(value) for value in away)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--takes", type=int, default=6)
    options = parser.parse_args()
    videos = sorted(options.clips.iterdir())
    videos = [videos[i] for i in np.linspace(0, len(videos) - 1, options.takes).astype(int)]
    tracker, reader = FaceTracker(), BlendshapeReader()
    began = time.perf_counter()
    film = StreamingTracker()
    takes = [read_take(video, film, reader) for video in videos]
    read_s, film_s = time.perf_counter() - began, sum(len(take.landmarks) / take.fps for take in takes)
    print(f"watching {film_s:.0f} s of film: {film_s / read_s:.1f} x real time")
    print("| face | r opening | r width | r lids | range | pitch, yaw, roll off (degrees) | whole, x real time |")
    for name in ("head", "ada"):
        session = Session(face=name, palette=None)
        rows, drawn_s = [], 0.0
        for video, take in zip(videos, takes, strict=True):
            with tempfile.TemporaryDirectory() as folder:
                out = Path(folder) / "out.mp4"
                began = time.perf_counter()
                clips = take_clips(retarget_take(take, session.face), read_sound(video, 48_000))
                write_clips(out, clips, session.renderer(Picture()))
                drawn_s += time.perf_counter() - began
                rows.append(motion_errors(take, track_clip(out, tracker)))
        middle = np.median(rows, axis=0)
        print(
            f"| {name} | {middle[0]:.3f} | {middle[1]:.3f} | {middle[2]:.3f} | {middle[3]:.2f} | "
            f"{middle[4]:.2f}, {middle[5]:.2f}, {middle[6]:.2f} | {film_s / (read_s + drawn_s):.1f} |"
        )


if __name__ == "__main__":
    main()
