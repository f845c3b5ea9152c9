"""Temporal stability and cost of the picture: python tests/bench/bench_look.py [face.face ...].

Along a slow turn (0.25 degrees of pitch and 0.5 of yaw a frame) the change of a pixel is half the second difference of
three frames, in levels of 255; the table states the 99th percentile in the areas of hair, lashes, brows and the edge of
skin. The ladder draws the same frame with and without each step.
"""

import sys
import time

import numpy as np

from tests.picture.stability import flicker, part_masks
from tts2face.models.face import Face, keep_parts
from tts2face.models.face_loading import load_face
from tts2face.picture.kernels.picture import allocate_buffers
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer

N_FRAMES = 12


def stability(face: Face) -> None:
    """Print the flicker of each area."""
    renderer = mesh_renderer(face, Picture())
    weights = np.zeros(len(face.shape_names), np.float32)
    frames = []
    for i in range(N_FRAMES):
        head = np.radians([0.125 * i, 0.25 * i, 0, 0, 0, 0]).astype(np.float32)
        frames.append(renderer.draw(weights, head))
    change = flicker(np.array(frames))
    for name, mask in part_masks(renderer.scene, weights).items():
        if mask.any():
            most = np.percentile(change[mask], 99)
            print(f"  {name}: 99th percentile {most:.1f}, mean {change[mask].mean():.2f} levels")


def frame_ms(renderer: MeshRenderer, n: int = 25, **options: bool) -> float:
    """Milliseconds of one core for a frame of 512 x 512, the least of `n`."""
    scene, picture = renderer.scene, renderer.picture
    buffers = allocate_buffers(scene.surface, (picture.width, picture.height), picture.samples_per_side, **options)
    weights = np.zeros(len(scene.face.shape_names), np.float32)
    spent = []
    for _ in range(n):
        began = time.thread_time()
        renderer._draw(weights, np.zeros(6, np.float32), buffers)
        spent.append(time.thread_time() - began)
    return 1e3 * min(spent)


def ladder(face: Face) -> None:
    """Print what each step costs."""
    standard = mesh_renderer(face, Picture())
    bald = keep_parts(face, lambda part: part.kind != "strands")
    for name, ms in {
        "standard": frame_ms(standard),
        "one sample": frame_ms(mesh_renderer(face, Picture(supersampling=1))),
        "draft": frame_ms(mesh_renderer(face, Picture(quality="draft"))),
        "high": frame_ms(mesh_renderer(face, Picture(quality="high"))),
        "without strands": frame_ms(mesh_renderer(bald, Picture())),
    }.items():
        print(f"  {name}: {ms:.1f} ms")


def main() -> None:
    """Print the figures of the shipped head, or of the faces given."""
    for name in sys.argv[1:] or ["head"]:
        face = load_face(name)
        print(name)
        stability(face)
        ladder(face)


if __name__ == "__main__":
    main()
