"""Compilation of all kernels at the first run on a machine; later runs load them from the disk cache.

Motion kernels are compiled in a child process while this process compiles the drawing kernels, because numba compiles
one kernel at a time in each process.
"""

import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.face_loading import load_face
from tts2face.models.talker import Talker
from tts2face.render import raster
from tts2face.render.draw import draw
from tts2face.render.picture import Picture

COMPILE_MOTION_CODE = """
import os
from tts2face.child_process import exit_after
exit_after(lambda: os.read(0, 1))
from tts2face.synthesis.warm_up import compile_motion
compile_motion()
"""
COMPILE_TIMEOUT_S = 120.0


def kernels_are_compiled() -> bool:
    """Whether the drawing kernels are in the disk cache; compiling them delays the first picture by some seconds."""
    source = Path(raster.__file__).stat().st_mtime
    return any(index.stat().st_mtime >= source for index in _cache_indexes())


def compile_kernels() -> None:
    """Compile all kernels that a clip needs, and mark the disk cache as new.

    If the child process fails, the motion kernels are compiled at their first use. numba keeps cached code whose source
    file was replaced by one of the same content, so that the age of the cache does not show by itself that it is valid.
    """
    face = load_face("head")
    child = subprocess.Popen(
        [sys.executable, "-c", COMPILE_MOTION_CODE],
        stdin=subprocess.PIPE,  # closes when this process ends, which ends the child
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        draw(face, np.zeros(len(face.shape_names), np.float32), picture=Picture(size="64x64"))
        child.wait(COMPILE_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        child.kill()
    finally:
        if child.poll() is None:
            child.kill()
        child.wait()
        if child.stdin is not None:
            child.stdin.close()
    for index in _cache_indexes():
        with suppress(OSError):  # a cache that this user may only read
            index.touch()


def _cache_indexes() -> list[Path]:
    folder = Path(str(raster.draw_band.stats.cache_path))  # type: ignore[attr-defined]
    return list(folder.glob("raster.draw_band-*.nbi"))


def compile_motion() -> None:
    """Compile the kernels of lip synthesis, retargeting and gestures by synthesising one second of motion."""
    from tts2face.exemplar.synthesis import build_exemplar_model, speech_trajectory
    from tts2face.gesture.gesture_stream import GestureFields, GestureStream
    from tts2face.gesture.timeline import Timeline
    from tts2face.models.palette import load_palette
    from tts2face.models.talker import load_talker
    from tts2face.retargeting.to_face import build_retargeter
    from tts2face.types import Waveform

    talker: Talker = load_talker("grid_s1")
    retargeter = build_retargeter(talker, load_face("head"))
    phones = PhoneSequence([SILENCE, "p", "f", "ɑ", SILENCE], [0.0, 0.3, 0.4, 0.5, 0.7, 1.0])
    retargeter.retarget(speech_trajectory(phones, build_exemplar_model(talker), fps=30.0, n_frames=30))
    gestures = GestureStream(GestureFields(load_palette("starter")), style="grid_s1", seed=0, fps=30.0)
    gestures.next(Waveform(np.zeros(1600), 16_000), 3, Timeline())
