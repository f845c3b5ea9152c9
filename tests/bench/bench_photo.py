"""Time of a photograph that speaks, beside the drawn woman in the same run: python tests/bench/bench_photo.py PHOTO.

The second table has seconds of a session that has spoken before, to the first byte and to the end of an MP4 stream.
"""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from bench_film import milliseconds, rate
from bench_render import clip_of
from numpy.typing import NDArray
from PIL import Image

from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.photo.face_from_photo import face_from_photo
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.request import Request
from tts2face.session.session import Session

SIDES = (512, 1024)
N_FRAMES, N_MADE, N_STREAMED = 60, 3, 7
TEXT = "We were away a year ago, but Bob may move five big maps."


def stream_times(face: Face, size: str) -> NDArray[np.float64]:
    """Median seconds to the first byte and to the last of clips of a face that is ready, and seconds of the clips."""
    session, found = Session(face=face), []
    for seed in range(N_STREAMED + 1):
        first, seconds, began = 0.0, 0.0, time.perf_counter()
        for chunk in session.stream_file(Request(text=TEXT, seed=seed), picture=Picture(size=size)):
            seconds += chunk.seconds
            if chunk.content and not first:
                first = time.perf_counter() - began
        found.append((first, time.perf_counter() - began, seconds))
    return np.asarray(np.median(found[1:], axis=0))


def main() -> None:
    """Print the table."""
    photo, ada, faces = Image.open(sys.argv[1]).convert("RGB"), load_face("ada"), []
    print("| side | made, s | ms a frame | of ada's | frames a second on all cores |\n| --- | --- | --- | --- | --- |")
    for side in SIDES:
        with TemporaryDirectory() as folder:
            path = Path(folder, "photo.png")
            photo.resize((side, side), Image.Resampling.LANCZOS).save(path)
            took = []
            for _ in range(N_MADE):
                began = time.perf_counter()
                face = face_from_photo(path, consent="nobody")
                took.append(time.perf_counter() - began)
        faces.append(face)
        picture = Picture(size=f"{side}x{side}")
        clips = {one: clip_of(one, N_FRAMES) for one in (face, ada)}
        own, other = (milliseconds(mesh_renderer(one, picture), clip) for one, clip in clips.items())
        speed = rate(face, clips[face], picture)
        print(f"| {side} | {np.median(took):.2f} | {own:.1f} | {own / other:.2f} | {speed:.0f} |")
    print("\n| clip | first byte, s | last byte, s | seconds of the clip |\n| --- | --- | --- | --- |")
    for side, one in (*zip(SIDES, faces, strict=True), (SIDES[0], ada)):
        first, last, seconds = stream_times(one, f"{side}x{side}")
        print(f"| {one.metadata['name']}, {side} | {first:.2f} | {last:.2f} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
