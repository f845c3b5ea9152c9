"""Spectra of the voice ``heart`` with another F0 than its own.

The network's frames belong to their F0: with another one single words become up to 10 dB louder, and the creak at ends
keeps the old pitch. So the energy is matched to the plain spectrum, and creak is given to the harmonics.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray
from tts2face.sound.heart_network import Frames

Spectrum = NDArray[np.complex64]
MATCH_BINS, MATCH_FRAMES = 15, 3  # 300 Hz hold a harmonic of every F0
MOST_MATCH_DB = 14.0
SMOOTH_BINS = 9  # of 20 Hz, over old harmonics
FREE_DOWN = 6.0  # nepers; with 3 the old period is heard in one of 56 ends
CREAK_FRAMES = 4  # of the onset of both
FRAMES_BEHIND, CREAK_BINS = 8, 50  # behind a movement creak goes on; up to 1 kHz, which leaves bursts of stops
HEARD_DB = 30.0
LEAST_POWER = 1e-8


def spectrum(frames: Frames, f0: NDArray[np.floating], seed: int) -> Spectrum:
    """Spectrum (601, T) of frames with an F0 (T,); `hibari.dsp.synth` without its inverse transform."""
    from hibari import dsp

    made: Any = dsp.stft(dsp.pulses(f0.astype(np.float32)), frames.harmonic.shape[1])
    turn = np.zeros(frames.harmonic.shape, np.complex64)
    angle = np.tanh(frames.harmonic_phase)
    angle *= np.pi
    np.cos(angle, out=turn.real)
    np.sin(angle, out=turn.imag)
    turn *= dsp.ex(frames.harmonic)
    made *= turn
    shape = (frames.harmonic.shape[0], 2 * frames.harmonic.shape[1])
    noise = np.random.default_rng(seed).standard_normal(shape, dtype=np.float32).view(np.complex64)
    noise *= dsp.ex(frames.noise)
    made += noise
    np.cos(frames.free_phase, out=turn.real)
    np.sin(frames.free_phase, out=turn.imag)
    turn *= dsp.ex(frames.free)
    made += turn
    return np.asarray(made, np.complex64)


def samples_of(spectrum_of_frames: Spectrum) -> NDArray[np.float32]:
    """Samples (n,) of a spectrum at 24 kHz."""
    from hibari import dsp

    return np.asarray(dsp.ola(spectrum_of_frames), np.float32)


def creak_to_harmonics(frames: Frames, f0: FloatArray, spans: tuple[tuple[int, int], ...]) -> Frames:
    """Frames whose free branch gives its energy to the harmonics within spans of voiced frames."""
    share, behind = np.zeros(len(f0), np.float32), np.zeros(len(f0), np.float32)
    for first, end in spans:
        onset = np.clip((np.arange(first, end) - first) / CREAK_FRAMES, 0.0, 1.0)
        share[first:end] = np.maximum(share[first:end], onset)
        behind[end : end + FRAMES_BEHIND] = 1.0
    share *= np.asarray(f0) > 0
    both = np.exp(2 * frames.harmonic) + np.exp(2 * frames.free)
    joint = np.log(_moving_mean(both, SMOOTH_BINS, 0) + 1e-9) / 2
    harmonic = frames.harmonic + share * (np.maximum(joint, frames.harmonic) - frames.harmonic)
    free = frames.free - share * np.float32(FREE_DOWN)
    free[:CREAK_BINS] -= behind * np.float32(FREE_DOWN)
    # phases that change between old harmonics are echoes of the old period
    angle = np.pi * np.tanh(frames.harmonic_phase)
    smooth = np.arctan2(_moving_mean(np.sin(angle), SMOOTH_BINS, 0), _moving_mean(np.cos(angle), SMOOTH_BINS, 0))
    phase = np.where(share > 0.0, np.arctanh(np.clip(smooth / np.pi, -0.999, 0.999)), frames.harmonic_phase)
    return frames._replace(harmonic=harmonic.astype(np.float32), harmonic_phase=phase.astype(np.float32), free=free)


def is_heard(values: Spectrum) -> NDArray[np.bool_]:
    """Whether each frame (T,) of a spectrum is loud enough to be heard beside the loudest one."""
    power = _frames(_power(values))
    return np.asarray(power > 10 ** (-HEARD_DB / 10) * power.max())


def match_energy(changed: Spectrum, plain: Spectrum, spans: tuple[tuple[int, int], ...] = ()) -> Spectrum:
    """A changed spectrum with the energy of the plain one in each region.

    Within spans, where the plain one creaks, whole frames are matched: by bands its low energy would come back.
    """
    before, now = _power(plain), _power(changed)
    gain = np.sqrt(_regions(before) / _regions(now))
    if spans:
        whole = np.sqrt(_frames(before) / _frames(now))
        for first, end in spans:
            gain[:, first:end] = whole[first:end]
    most = 10 ** (MOST_MATCH_DB / 20)
    matched: Spectrum = (changed * np.clip(gain, 1 / most, most)).astype(np.complex64)
    return matched


def _power(values: Spectrum) -> NDArray[np.float32]:
    power: NDArray[np.float32] = np.square(values.real) + np.square(values.imag)
    return power


def _regions(power: NDArray[np.float32]) -> FloatArray:
    return _moving_mean(_moving_mean(power, MATCH_BINS, 0), MATCH_FRAMES, 1) + LEAST_POWER


def _frames(power: NDArray[np.float32]) -> FloatArray:
    return _moving_mean(power.sum(axis=0, dtype=np.float64), MATCH_FRAMES, 0) + LEAST_POWER


def _moving_mean(values: NDArray[np.floating], size: int, axis: int) -> FloatArray:
    """Means of an odd number of neighbours along an axis, whose ends are repeated."""
    half = [(size // 2, size // 2) if at == axis else (0, 0) for at in range(values.ndim)]
    padded = np.pad(values, half, mode="edge")
    sums = np.cumsum(padded, axis=axis, dtype=np.float64)
    sums = np.concatenate([np.zeros_like(sums.take([0], axis)), sums], axis=axis)
    n = values.shape[axis]
    means = (sums.take(range(size, n + size), axis) - sums.take(range(n), axis)) / size
    found: FloatArray = np.maximum(means, 0.0)
    return found
