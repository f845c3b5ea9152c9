"""The voice's transforms without the rest of SciPy: the same bits, and nothing that others notice."""

import subprocess
import sys

COMPARISON = """
import numpy as np
from tts2face.sound.transforms import import_hibari
import_hibari()
import sys
assert "scipy.fft" not in sys.modules
from hibari import dsp
import scipy.fft
noise = np.random.default_rng(0)
for n in (1, 2, 5, 37, 333):
    frames = noise.normal(size=(n, 1200)).astype(np.float32)
    spectra = scipy.fft.rfft(frames, axis=1)
    assert dsp.rfft(frames.copy(), 1).tobytes() == spectra.tobytes()
    turned = np.ascontiguousarray(spectra.T).T
    assert dsp.irfft(turned, 1200, 1).tobytes() == scipy.fft.irfft(turned, n=1200, axis=1).tobytes()
print(type(dsp.rfft(frames, 1)).__name__)
"""
ELSEWHERE = """
import importlib, sys, threading
from tts2face.sound import transforms
missing, found = transforms._Missing(), []
sys.meta_path.insert(0, missing)
thread = threading.Thread(target=lambda: found.append(importlib.import_module("scipy.fft")))
thread.start()
thread.join()
print(found[0].__name__)
"""
LATER = """
import scipy.fft
from tts2face.sound.transforms import import_hibari
import_hibari()
from hibari import dsp
print(dsp.FFT_BACKEND)
"""


def _output(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.strip()


def test_the_bits_are_those_of_scipy():
    assert _output(COMPARISON) == "ndarray"


def test_other_threads_import_scipy():
    assert _output(ELSEWHERE) == "scipy.fft"


def test_scipy_is_taken_where_it_is_loaded():
    assert _output(LATER) == "scipy"
