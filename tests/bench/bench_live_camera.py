"""Time of an answer and processor time for a picture of a live camera, of `camera_process` alone.

Pictures of GRID s1 as JPEG of 480 x 360 pixels are sent one after the other, each after the answer to the last one:

    python tests/bench/bench_live_camera.py ../shared/recordings [--pictures 250]
"""

import argparse
import asyncio
import io
import os
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import aclosing
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

from tts2face.processes.async_parent import started
from tts2face.serving.studio.camera import PROGRAM
from tts2face.serving.studio.camera_process import FOLLOW
from tts2face.video.media import read_frames

SIZE = (480, 360)
FPS = 25


def jpegs(folder: Path, count: int) -> list[bytes]:
    """Pictures of the first recordings of a folder."""
    made: list[bytes] = []
    for clip in sorted(folder.iterdir()):
        for frame in read_frames(clip):
            if frame.pixels.std() < 2:
                continue  # blank pictures at the start
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
    spent = asyncio.run(follow(pictures))
    for state, times in spent.items():
        answers, work = 1000 * np.array(times).T
        middle, late = np.percentile(answers, [50, 95])
        print(f"{state}: {len(times)} pictures, {middle:.0f} ms (95 %: {late:.0f} ms), processor {work.mean():.0f} ms")


async def follow(pictures: list[bytes]) -> dict[str, list[tuple[float, float]]]:
    """Seconds until the answer and of the processor for each picture, by the state of the answer."""
    is_asked, spent = asyncio.Event(), dict[str, list[tuple[float, float]]]()
    sent = used = 0.0

    async def given() -> AsyncIterator[tuple[Mapping[str, Any], bytes]]:
        nonlocal sent, used
        for number, picture in enumerate(pictures):
            await is_asked.wait()
            is_asked.clear()
            sent, used = time.perf_counter(), children_seconds()
            yield {"time": number / FPS}, picture

    async with started(PROGRAM) as child, aclosing(child.stream(FOLLOW, {}, inputs=given())) as answers:
        began, n_answers = time.perf_counter(), 0
        async for answer in answers:
            if "channels" in answer.content:
                print(f"ready after {time.perf_counter() - began:.1f} s")
            else:
                times = (time.perf_counter() - sent, children_seconds() - used)
                spent.setdefault(answer.content["state"], []).append(times)
                n_answers += 1
            if n_answers == len(pictures):
                break
            is_asked.set()
    return spent


def children_seconds() -> float:
    """Processor time of the processes that this one has started."""
    own = str(os.getpid())
    parents = {path: path.read_text().rpartition(")")[2].split()[1] for path in Path("/proc").glob("[0-9]*/stat")}
    return sum(cpu_seconds(int(path.parent.name)) for path, parent in parents.items() if parent == own)


def cpu_seconds(process: int) -> float:
    """Processor time of a process and its threads."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
