"""Time of a photograph that speaks, beside the drawn woman in the same run: python tests/bench/bench_photo.py PHOTO."""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from bench_film import milliseconds, rate
from bench_renderers import clip_of
from PIL import Image

from tts2face.models.face_loading import load_face
from tts2face.photo.face_from_photo import face_from_photo
from tts2face.render.draw import mesh_renderer
from tts2face.render.picture import Picture

SIDES = (512, 1024)
N_FRAMES, N_MADE = 60, 3


def main() -> None:
    """Print the table."""
    photo, ada = Image.open(sys.argv[1]).convert("RGB"), load_face("ada")
    print("| side | made, s | ms a frame | of ada's | frames a second on all cores |\n| --- | --- | --- | --- | --- |")
    for side in SIDES:
        with TemporaryDirectory() as folder:
            path = Path(folder, "photo.png")
            photo.resize((side, side), Image.Resampling.LANCZOS).save(path)
            took = []
            for _ in range(N_MADE):
                began = time.perf_counter()
                face = face_from_photo(path, consent="drawn")
                took.append(time.perf_counter() - began)
        picture = Picture(size=f"{side}x{side}")
        clips = {one: clip_of(one, N_FRAMES) for one in (face, ada)}
        own, other = (milliseconds(mesh_renderer(one, picture), clip) for one, clip in clips.items())
        speed = rate(face, clips[face], picture)
        print(f"| {side} | {np.median(took):.2f} | {own:.1f} | {own / other:.2f} | {speed:.0f} |")


if __name__ == "__main__":
    main()
