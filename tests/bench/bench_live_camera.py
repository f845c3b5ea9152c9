"""Time of an answer and processor time for a picture of a live camera, of `camera_process` alone.

    python tests/bench/bench_live_camera.py ../shared/recordings [--pictures 250]

Pictures of GRID s1 as JPEG of 480 x 360 pixels are sent one after the other, each after the answer to the last one.
"""

import argparse
import io
import json
import os
import struct
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from tts2face.video.media import read_frames

SIZE = (480, 360)
FPS = 25


def jpegs(folder: Path, count: int) -> list[bytes]:
    """Pictures of the first recordings of a folder."""
    made: list[bytes] = []
    for clip in sorted(folder.iterdir()):
        for frame in read_frames(clip):
            if frame.pixels.std() < 2:
                continue  # blank pictures at the begin
            height = SIZE[1]
            width = round(frame.pixels.shape[1] * height / frame.pixels.shape[0])
            whole = np.full((height, SIZE[0], 3), 110, np.uint8)
            left = (SIZE[0] - width) // 2
            whole[:, left : left + width] = cv2.resize(frame.pixels, (width, height))
            content = io.BytesIO()
            Image.fromarray(whole).save(content, "JPEG", quality=80)
            made.append(content.getvalue())
            if len(made) == count:
                return made
    return made


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--pictures", type=int, default=250)
    asked = parser.parse_args()
    pictures = jpegs(asked.recordings / "grid_s1" / "clips", asked.pictures)
    command = [sys.executable, "-m", "tts2face.service.synthesis.camera_process"]
    began = time.perf_counter()
    child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdout.readline()
    print(f"ready after {time.perf_counter() - began:.1f} s")
    spent: dict[str, list[tuple[float, float]]] = {}
    for number, picture in enumerate(pictures):
        sent, used = time.perf_counter(), cpu_seconds(child.pid)
        child.stdin.write(struct.pack("<dI", number / FPS, len(picture)) + picture)
        child.stdin.flush()
        state = json.loads(child.stdout.readline())["state"]
        spent.setdefault(state, []).append((time.perf_counter() - sent, cpu_seconds(child.pid) - used))
    for state, times in spent.items():
        answers, work = 1000 * np.array(times).T
        middle, late = np.percentile(answers, [50, 95])
        print(f"{state}: {len(times)} pictures, {middle:.0f} ms (95 %: {late:.0f} ms), processor {work.mean():.0f} ms")
    child.stdin.close()
    child.wait()


def cpu_seconds(process: int) -> float:
    """Processor time of a process and its threads."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
