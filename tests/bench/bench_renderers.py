"""Frames per second of both renderers: python tests/bench/bench_renderers.py [frames]."""

import sys
import time
from dataclasses import replace

import numpy as np

from lexicon.errors import BackendError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.face_loading import load_face
from tts2face.picture.options import RENDERERS, Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

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


def main():
    n_frames = int(sys.argv[1]) if len(sys.argv) > 1 else 90
    face = load_face("head")
    clip = clip_of(face, n_frames)
    for supersampling in (1, 2):
        for renderer in RENDERERS:
            picture = replace(Picture(), renderer=renderer, supersampling=supersampling)
            try:
                drawn = mesh_renderer(face, picture).frames(clip)
                next(drawn)
            except BackendError as missing:
                print(f"{renderer}: {missing}")
                continue
            began = time.perf_counter()
            count = sum(1 for _ in drawn)
            print(
                f"{renderer}, {supersampling} x {supersampling}: {count / (time.perf_counter() - began):.1f} frames/s"
            )


if __name__ == "__main__":
    main()
