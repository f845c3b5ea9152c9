"""Processor time of a frame of a face with baked light, by stage, beside the renderer with lamps on the same face,
view and poses: python tests/bench/bench_film.py [face] [frames].
"""

import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from bench_render import clip_of

from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.light import Lamps
from tts2face.picture.baked import scene as film
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer
from tts2face.processes.threads import available_cores

STAGES = {  # of a frame, and the functions of `tts2face.picture.baked.scene` that it calls
    "pose": ("LitScene.deform", "LitScene.move"),
    "light of the pose": ("LitScene.light_pose",),
    "projection": ("project",),
    "visibility, 2 x 2": ("LitScene._sort", "find_nearest"),
    "fragments": ("list_fragments",),
    "shading": ("lay_planes", "evaluate", "find_texels", "fetch", "add_texels"),
    "eyes": ("colour_eyes",),
    "composing": ("compose",),
}
ROUNDS = 5


def timed(function: Callable[..., Any], spent: Counter[str], name: str) -> Callable[..., Any]:
    """A function that adds its processor time to a name."""

    def run(*given: Any, **named: Any) -> Any:
        began = time.thread_time()
        try:
            return function(*given, **named)
        finally:
            spent[name] += time.thread_time() - began

    return run


def milliseconds(renderer: MeshRenderer, clip: Any) -> float:
    """Processor time of a frame, the median of some rounds; the first picture of each is not counted."""
    found = []
    for _ in range(ROUNDS):
        drawn = renderer.frames(clip, threads=1)
        next(drawn)
        began = time.process_time()
        count = sum(1 for _ in drawn)
        found.append(1e3 * (time.process_time() - began) / count)
    return float(np.median(found))


def by_stage(renderer: MeshRenderer, clip: Any) -> dict[str, float]:
    """Milliseconds of each stage of a frame."""
    spent: Counter[str] = Counter()
    kept = {}
    for stage, names in STAGES.items():
        for name in names:
            owner, _, own = name.rpartition(".")
            place = getattr(film, owner) if owner else film
            kept[place, own] = getattr(place, own)
            setattr(place, own, timed(kept[place, own], spent, stage))
    n_frames = sum(1 for _ in renderer.frames(clip, threads=1))
    for (place, own), function in kept.items():
        setattr(place, own, function)
    return {stage: 1e3 * spent[stage] / n_frames for stage in STAGES}


def rate(face: Face, clip: Any, picture: Picture) -> float:
    """Frames a second on all cores."""
    renderer = mesh_renderer(face, picture)
    drawn = renderer.frames(clip, threads=available_cores())
    next(drawn)
    began = time.perf_counter()
    return sum(1 for _ in drawn) / (time.perf_counter() - began)


def main() -> None:
    """Print the table."""
    face = load_face(sys.argv[1] if len(sys.argv) > 1 else "ada")
    n_frames = int(sys.argv[2]) if len(sys.argv) > 2 else 60
    clip, plain = clip_of(face, n_frames), replace(face, light=Lamps())
    lit, lamps = mesh_renderer(face, Picture()), mesh_renderer(plain, Picture())
    for renderer in (lit, lamps):  # kernels
        renderer.draw(clip.motion.values[0], clip.head.values[0])
    print("| ms of processor time a frame, 512 x 512, one thread | |\n| --- | --- |")
    for stage, spent in by_stage(lit, clip).items():
        print(f"| {stage} | {spent:.1f} |")
    own, other = milliseconds(lit, clip), milliseconds(lamps, clip)
    print(f"| baked light, all | {own:.1f} |\n| lamps | {other:.1f}, {other / own:.1f} times as much |")
    for size in ("512x512", "1920x1080"):
        print(f"| frames a second on {available_cores()} cores, {size} | {rate(face, clip, Picture(size=size)):.0f} |")


if __name__ == "__main__":
    main()
