"""Compactness of a face's dense modes, and a sheet of pictures of them.

Run: ``tts2face corpus face ../shared/recordings/grid_s1 --out me.face --consent "..." --basis 30``, then
``python tests/bench/bench_dense.py me.face --picture modes.png``.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from tts2face.models.face import Face
from tts2face.models.face_file import read_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

N_DRAWN = 6
AMOUNTS = (-2.0, 0.0, 2.0)  # standard deviations
CAMERAS = ("close", "three-quarter")


def table(face: Face) -> None:
    found = face.metadata["dense"]
    print(f"{found['frames']} frames, {found['landmarks']} landmarks; modes for 95 and 99 % of the variance: ", end="")
    print(f"dense {found['modes_for_95_and_99']}, landmarks alone {found['sparse_modes_for_95_and_99']}")
    print("| modes | dense, share | landmarks, share | held out: dense, mm | landmarks, mm |")
    print("| --- | --- | --- | --- | --- |")
    for row, n_modes in enumerate(found["held_out"]["modes"]):
        shares = [found[name][n_modes - 1] for name in ("shares", "sparse_shares")]
        errors = [found["held_out"][name][row] for name in ("dense_mm", "sparse_mm")]
        print(f"| {n_modes} | {shares[0]:.3f} | {shares[1]:.3f} | {errors[0]:.3f} | {errors[1]:.3f} |")


def sheet(face: Face, size: str) -> Image.Image:
    rows = []
    for camera in CAMERAS:
        renderer = mesh_renderer(face, Picture(size=size, camera=camera))
        pictures = [
            [renderer.draw(weights(face, mode, amount)) for mode in range(1, N_DRAWN + 1)] for amount in AMOUNTS
        ]
        rows += [np.concatenate(row, axis=1)[..., :3] for row in pictures]
    image = Image.fromarray(np.concatenate(rows))
    pen, side = ImageDraw.Draw(image), image.width // N_DRAWN
    for row in range(len(rows)):
        for mode in range(N_DRAWN):
            pen.text((mode * side + 4, row * side + 4), f"dense{mode + 1} {AMOUNTS[row % 3]:+g}", fill="black")
    return image


def weights(face: Face, mode: int, amount: float) -> np.ndarray:
    shown = np.zeros(len(face.shape_names), np.float32)
    shown[face.shape_names.index("denseMean")] = 1.0
    shown[face.shape_names.index(f"dense{mode}")] = amount
    return shown


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("face", type=Path)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--size", default="256x256")
    options = parser.parse_args()
    face = read_face(options.face)
    if "dense" in face.metadata:
        table(face)
    if options.picture:
        sheet(face, options.size).save(options.picture)


if __name__ == "__main__":
    main()
