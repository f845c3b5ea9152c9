"""Speed of drawing and encoding: python tests/bench/bench_render.py [frames].

Each line also states how many runs of a reference loop of plain numpy take the time of one frame.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.face_loading import load_face
from tts2face.picture.film import write_clips
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.processes.threads import available_cores
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

SIZES = ("256x256", "512x512", "1280x720", "1920x1080")
FPS, RATE = 30, 24_000


def clip_of(face, n_frames):
    """A jaw that opens and closes and a head that turns."""
    motion = np.zeros((n_frames, len(face.shape_names)))
    motion[:, face.shape_names.index("jawOpen")] = 0.3 + 0.3 * np.sin(np.arange(n_frames) / 3)
    head = np.zeros((n_frames, len(HEAD_CHANNELS)))
    head[:, 1] = 0.1 * np.sin(np.arange(n_frames) / 9)
    n_samples = n_frames * RATE // FPS
    speech = Speech(Waveform(np.zeros(n_samples), RATE), PhoneSequence((SILENCE,), np.array([0, n_samples / RATE])), ())
    return Clip(Trajectory(face.shape_names, motion, FPS), Trajectory(HEAD_CHANNELS, head, FPS), speech)


def reference_s() -> float:
    """Seconds of sorting 200,000 numbers, the best of five."""
    values = np.random.default_rng(0).normal(size=200_000)
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        np.sort(values)
        spent.append(time.perf_counter() - began)
    return min(spent)


def line(name, n_frames, seconds):
    """Print one figure."""
    each = seconds / n_frames
    print(f"{name}: {n_frames / seconds:.1f} frames/s, {each * 1e3:.1f} ms a frame = {each / reference_s():.2f} sorts")


def main():
    n_frames = int(sys.argv[1]) if len(sys.argv) > 1 else 150
    face = load_face("head")
    clip = clip_of(face, n_frames)
    began = time.perf_counter()
    stage = mesh_renderer(face, Picture())
    print(f"stage with compiling or loading of kernels: {time.perf_counter() - began:.2f} s")
    began = time.perf_counter()
    stage = mesh_renderer(face, Picture())
    print(f"stage: {time.perf_counter() - began:.2f} s; {len(face.vertices)} vertices, {len(face.triangles)} triangles")
    for threads in range(1, available_cores() + 1):
        began = time.perf_counter()
        for _ in stage.frames(clip, threads=threads):
            pass
        line(f"drawing 512x512, 2 x 2, {threads} thread(s)", n_frames, time.perf_counter() - began)
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a.mp4", "a.webm", "a.gif", "pictures"):
            began = time.perf_counter()
            write_clips(Path(folder) / name, [clip], stage)
            line(f"drawing and writing {name}", n_frames, time.perf_counter() - began)
        for size in SIZES:
            stage = mesh_renderer(face, Picture(size=size))
            began = time.perf_counter()
            write_clips(Path(folder) / "a.mp4", [clip], stage)
            line(f"drawing and writing {size} .mp4", n_frames, time.perf_counter() - began)


if __name__ == "__main__":
    main()
