"""Processor time to check a take of 5 s on one core: ``taskset -c 0 python -m tests.bench.bench_takes GRID``.

GRID is a folder of recordings as of GRID s1; two sentences are joined, scaled and written as a browser does.
"""

import sys
import tempfile
import time
from pathlib import Path

import av
import numpy as np

from corpus_tools.recordings.observe import RecordingChecker, recordings_to_check
from corpus_tools.run_options import RunOptions
from lexicon.values.tables import read_table
from tests.corpus_tools.build.test_browser_recordings import RATE, write_browser_file
from tts2face.video.media import read_frames, read_sound

SECONDS, N_TAKES = 5.0, 5
SIZES = ((640, 480), (1280, 720))


def scaled(pixels: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The picture in the middle of a larger one of the same height."""
    width = round(pixels.shape[1] * size[1] / pixels.shape[0]) // 2 * 2
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
    whole = np.full((size[1], size[0], 3), 110, np.uint8)
    left = (size[0] - width) // 2
    whole[:, left : left + width] = frame.reformat(width, size[1]).to_ndarray(format="rgb24")
    return whole


def main() -> None:
    """Print the median time of a check after the first, which loads the networks."""
    recordings = Path(sys.argv[1])
    rows = read_table(recordings / "manifest.csv")[1 : 2 * N_TAKES + 1]
    for size in SIZES:
        with tempfile.TemporaryDirectory() as folder:
            checker, times = RecordingChecker(RunOptions(Path(folder) / "cache", 1)), []
            for number in range(N_TAKES):
                pair = rows[2 * number : 2 * number + 2]
                clips = [recordings / "clips" / f"{Path(row[0]).stem}.mkv" for row in pair]
                pictures = [scaled(frame.pixels, size) for clip in clips for frame in read_frames(clip)]
                pictures = pictures[: round(SECONDS * 25)]
                samples = np.concatenate([read_sound(clip, RATE).samples[: 3 * RATE] for clip in clips])
                path = Path(folder) / f"take-{number}.webm"
                moments = np.arange(len(pictures)) / 25
                write_browser_file("vp8.webm", path, pictures, moments, samples[: round(SECONDS * RATE)])
                (recording,) = recordings_to_check(path, " ".join(row[1] for row in pair))
                begin = time.process_time()
                checker.check(recording)
                times.append(time.process_time() - begin)
        print(f"{size[0]} x {size[1]}: first {times[0]:.1f} s, then {np.median(times[1:]):.1f} s for {SECONDS:g} s")


if __name__ == "__main__":
    main()
