"""Acoustic features of video frames: formants, MFCC, LPC, LSF, level (Theobald et al. 2007, section 3.2).

Each frame is analysed in its own window of samples, so that block-wise analysis gives the same bytes as analysis of the
whole sound.
"""

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.arrays import ordered_product
from tts2face.types import Trajectory, Waveform

FEATURE_RATE = 16_000  # Hz, sample rate of the analysed sound
WINDOW_S = 0.04  # effective length of the Gaussian window (T07, section 3.2)
WINDOW_SAMPLES = 1361  # odd; twice the window length, at which Praat truncates its Gaussian, and 5 ms
HALF_WINDOW_SAMPLES = WINDOW_SAMPLES // 2  # samples needed after a frame's time
N_MFCC = 12
LPC_ORDER = 16  # two for each kHz of the rate
# Praat's default
PRE_EMPHASIS_HZ = 50.0
N_FORMANT_POLES = 8  # formants up to half the rate, one for each kHz; the first four are returned
NEUTRAL_TUBE_HZ = (500.0, 1500.0, 2500.0, 3500.0)  # formants of a neutral vocal tract, for frames without formants
NOISE_LEVEL = 3e-5  # relative to full scale; digital silence has neither logarithm nor formants
WINDOWS_AT_ONCE = 1000  # 11 MB

AnalysisWindows = NDArray[np.float64]
Measure = Callable[[AnalysisWindows], NDArray[np.float64]]
FEATURE_KINDS = ("formants", "mfcc", "lpc", "lsf", "level", "mel")
# Log powers of bands, three times a frame of 25 Hz; relative to the mean of the speech so far, which is that of a voice
# and a microphone. It is found at once, and follows slowly.
N_BANDS = 24
BAND_LIMITS_HZ = (80.0, 7600.0)
# samples: 25 ms
BAND_WINDOW = 400
# samples: the window, and zeros up to a power of two
BAND_TRANSFORM = 512
BAND_OFFSETS = (-213, 0, 213)  # samples from the frame
# natural logarithms
LEAST_BAND_POWER = 1e-8
FIRST_MEAN = -9.0
FIRST_LEVEL = -20.0
SILENT_BANDS = -15.5  # mean of a noise of -76 dB of full scale: digital silence says nothing of a voice
MEAN_FRAMES, LEAST_FOLLOWED = 4, 0.03  # weight of the first mean, in frames; least share of a frame
LEVEL_FALL, SPEECH_RANGE = 0.02, 3.5  # of the level a frame; speech is not farther below it


def speech_features(sound: Waveform, kind: str, *, fps: float, n_frames: int, start: float = 0.0) -> Trajectory:
    """(n_frames, D) features of a sound at the times ``start + i / fps``; the sound is padded with silence.

    Parameters
    ----------
    sound
        Sound at `FEATURE_RATE`.
    kind
        One of `FEATURE_KINDS`, or several as ``mfcc+lsf``: ``formants`` (4, Hz), ``mfcc`` (13, the first is the level),
        ``lpc`` (16 prediction coefficients), ``lsf`` (16, rad), ``level`` (1, dB relative to full scale), ``mel`` (72,
        logarithms of the powers of 24 bands at three instants, relative to `ChannelMean`).
    start
        Time of the first frame in seconds.

    Raises
    ------
    InputError
        The kind does not exist, or the sound has another sample rate.
    """
    measures = feature_measures(kind)
    if sound.rate != FEATURE_RATE:
        raise InputError(f"features are measured at {FEATURE_RATE} Hz, not {sound.rate}; resample the sound")
    centres = np.rint((start + np.arange(n_frames) / fps) * FEATURE_RATE).astype(np.int64)
    parts = [
        measure_windows(analysis_windows(sound.samples, centres[at : at + WINDOWS_AT_ONCE]), measures)
        for at in range(0, n_frames, WINDOWS_AT_ONCE)
    ]
    values = channel_adaptation(kind)(np.concatenate(parts))
    return Trajectory([f"{kind}.{i}" for i in range(values.shape[1])], values, fps)


def feature_measures(kind: str) -> tuple[Measure, ...]:
    """Functions that compute a kind of feature, or several kinds joined by ``+``."""
    names = kind.split("+")
    for name in names:
        if name not in MEASURES:
            raise InputError(f"there is no feature {name!r}; choose {', '.join(FEATURE_KINDS)}")
    return tuple(MEASURES[name] for name in names)


def measure_windows(windows: AnalysisWindows, measures: tuple[Measure, ...]) -> NDArray[np.float32]:
    """(T, D) features of T windows; the columns of all measures are concatenated."""
    if not len(windows):  # Praat does not accept sounds without samples
        return measure_windows(np.zeros((1, WINDOW_SAMPLES)) + NOISE_LEVEL, measures)[:0]
    return np.concatenate([measure(windows) for measure in measures], axis=1).astype(np.float32)


def analysis_windows(samples: NDArray[np.float32], centres: NDArray[np.int64]) -> AnalysisWindows:
    """(T, `WINDOW_SAMPLES`) samples around T indices, padded with zeros, plus a fixed noise of `NOISE_LEVEL`."""
    first = max(int(centres.min(initial=len(samples))) - HALF_WINDOW_SAMPLES, 0)
    last = max(int(centres.max(initial=0)) + HALF_WINDOW_SAMPLES + 1, first)
    part = np.zeros(last - first + 2 * WINDOW_SAMPLES)
    available = samples[first:last]
    part[WINDOW_SAMPLES : WINDOW_SAMPLES + len(available)] = available
    starts = np.clip(centres - HALF_WINDOW_SAMPLES - first + WINDOW_SAMPLES, 0, len(part) - WINDOW_SAMPLES)
    # the same in each window: blocks of a stream and a whole file have equal features
    noise = np.random.default_rng(0).normal(0.0, NOISE_LEVEL, WINDOW_SAMPLES)
    return np.asarray(part[starts[:, None] + np.arange(WINDOW_SAMPLES)] + noise, np.float64)


def mfcc(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 13) mel-frequency cepstral coefficients of T windows; the first is the level."""
    sound = _concatenate_windows(
        np.concatenate([windows, windows[-1:]])
    )  # for a single frame Praat returns the level only
    found = sound.to_mfcc(number_of_coefficients=N_MFCC, window_length=WINDOW_S, time_step=_sample_step(windows))
    return np.asarray(found.to_array().T[: len(windows)], np.float64)


def lpc(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 16) linear prediction coefficients of T windows, by autocorrelation."""
    from parselmouth.praat import call

    analysis = ("To LPC (autocorrelation)...", LPC_ORDER, WINDOW_S, _sample_step(windows), PRE_EMPHASIS_HZ)
    found = call(call(_concatenate_windows(windows), *analysis), "Down to Matrix (lpc)")
    return np.asarray(found.values.T, np.float64)


def lsf(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 16) line spectral frequencies of T windows in radians."""
    return line_spectral_frequencies(lpc(windows))


def line_spectral_frequencies(coefficients: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T, M) angles in (0, pi), increasing, of T all-pole filters ``1 / A(z)``.

    Parameters
    ----------
    coefficients : (T, M)
        ``a_1 ... a_M`` of ``A(z) = 1 + sum_k a_k z^-k``; M is even, and A has its roots inside the unit circle.

    Notes
    -----
    ``P, Q = A(z) +- z^-(M+1) A(1/z)`` have their roots on the unit circle (Itakura 1975). Without those at z = -1 and
    z = 1 each is a polynomial in cos w, written in Chebyshev polynomials; its roots are the eigenvalues of their
    colleague matrix (Good 1961).
    """
    n_frames, order = coefficients.shape
    if order == 0 or order % 2:
        raise InputError(f"line spectral frequencies need an even number of coefficients above 0, not {order}")
    filters = np.concatenate([np.ones((n_frames, 1)), coefficients, np.zeros((n_frames, 1))], axis=1)
    mirrored = filters[:, ::-1]
    signs = (-1.0) ** np.arange(order + 2)
    half = order // 2
    quotients = (  # long division by 1 + z^-1 and 1 - z^-1; the first half, middle included, of a symmetric polynomial
        (signs * np.cumsum(signs * (filters + mirrored), axis=1))[:, : half + 1],
        np.cumsum(filters - mirrored, axis=1)[:, : half + 1],
    )
    angles = [np.arccos(np.clip(_chebyshev_roots(quotient[:, ::-1]), -1.0, 1.0)) for quotient in quotients]
    return np.sort(np.concatenate(angles, axis=1), axis=1)


def _chebyshev_roots(middle_out: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, n) real roots of ``c_0 / 2 + sum_k c_k T_k(x)``, doubled, for (T, n + 1) coefficients c."""
    n = middle_out.shape[1] - 1
    series = 2.0 * middle_out
    series[:, 0] /= 2.0
    colleague = np.zeros((len(series), n, n))
    rows = np.arange(n - 1)
    colleague[:, rows, rows + 1] = 0.5
    colleague[:, rows + 1, rows] = 0.5
    if n > 1:
        colleague[:, 0, 1] = 1.0
    leading = series[:, n:] * (2.0 if n > 1 else 1.0)
    colleague[:, n - 1] -= series[:, :n] / leading
    return np.asarray(np.linalg.eigvals(colleague).real, np.float64)


def formants(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 4) first formants of T windows in Hz; `NEUTRAL_TUBE_HZ` if none is found."""
    even = windows[:, :-1]  # with an even length, no sample lies at the middle, where Praat would round
    found = _concatenate_windows(even).to_formant_burg(
        time_step=_sample_step(even),
        max_number_of_formants=N_FORMANT_POLES,
        maximum_formant=FEATURE_RATE / 2,
        window_length=WINDOW_S,
        pre_emphasis_from=PRE_EMPHASIS_HZ,
    )
    instants = found.x1 + np.arange(len(even)) * found.dx
    numbers = range(1, len(NEUTRAL_TUBE_HZ) + 1)
    values = np.array([[found.get_value_at_time(number, at) for number in numbers] for at in instants])
    return np.where(np.isfinite(values), values, NEUTRAL_TUBE_HZ)


def level(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 1) level of T windows in dB relative to full scale, with a Hann taper of twice `WINDOW_S`."""
    taper = np.hanning(windows.shape[1])
    power = np.square(windows) @ taper / taper.sum()
    return np.asarray(10.0 * np.log10(power)[:, None], np.float64)


def mel(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 72) log powers of `N_BANDS` bands at `BAND_OFFSETS` around the middles of T windows."""
    taper = np.hanning(BAND_WINDOW)
    starts = [HALF_WINDOW_SAMPLES + offset - BAND_WINDOW // 2 for offset in BAND_OFFSETS]
    parts = np.stack([windows[:, start : start + BAND_WINDOW] for start in starts], axis=1) * taper
    powers = np.square(np.abs(np.fft.rfft(parts, BAND_TRANSFORM))) / np.square(taper).sum()
    # `@` would add in an order that depends on the threads of BLAS (decision 022)
    bands = np.log(ordered_product(powers, mel_bands(N_BANDS, BAND_LIMITS_HZ, BAND_TRANSFORM)) + LEAST_BAND_POWER)
    return bands.reshape(len(windows), -1)


@cache
def mel_bands(n_bands: int, limits: tuple[float, float], transform: int) -> NDArray[np.float64]:
    """Weights (F, B) of triangular bands of a spectrum, equally wide in mel (O'Shaughnessy 1987)."""
    lowest, highest = (2595.0 * np.log10(1.0 + hertz / 700.0) for hertz in limits)
    edges = 700.0 * (10.0 ** (np.linspace(lowest, highest, n_bands + 2) / 2595.0) - 1.0)
    frequencies = np.linspace(0.0, FEATURE_RATE / 2, transform // 2 + 1)[:, None]
    low = edges[:-2]
    middle = edges[1:-1]
    high = edges[2:]
    weights: NDArray[np.float64] = np.clip(
        np.minimum((frequencies - low) / (middle - low), (high - frequencies) / (high - middle)), 0.0, None
    )
    return weights


class ChannelMean:
    """Takes the mean of the speech so far out of `mel` features, whose frames arrive one after another."""

    def __init__(self) -> None:
        self._mean = np.full(N_BANDS, FIRST_MEAN)
        self._level, self._n_frames = FIRST_LEVEL, 0

    def __call__(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """(T, 72) features relative to the mean."""
        found = np.empty_like(values)
        for at, frame in enumerate(values.reshape(-1, len(BAND_OFFSETS), N_BANDS)):
            bands = frame.mean(axis=0, dtype=np.float64)
            is_sound = bands.mean() > SILENT_BANDS
            self._level = max(float(bands.mean()), self._level - LEVEL_FALL) if is_sound else self._level
            if is_sound and bands.mean() > self._level - SPEECH_RANGE:
                self._n_frames += 1
                self._mean += (bands - self._mean) * max(LEAST_FOLLOWED, 1.0 / (self._n_frames + MEAN_FRAMES))
            found[at] = (frame - self._mean).ravel()
        return found


def channel_adaptation(kind: str) -> Callable[[NDArray[np.float32]], NDArray[np.float32]]:
    """Normalisation that makes features of a kind independent of voice and microphone, for one sound."""
    return ChannelMean() if kind == "mel" else np.asarray


MEASURES: Mapping[str, Measure] = MappingProxyType(
    dict(zip(FEATURE_KINDS, (formants, mfcc, lpc, lsf, level, mel), strict=True))
)


def _sample_step(windows: AnalysisWindows) -> float:
    return float(windows.shape[1] / FEATURE_RATE)


def _concatenate_windows(windows: AnalysisWindows) -> Any:
    import parselmouth

    return parselmouth.Sound(windows.ravel(), sampling_frequency=FEATURE_RATE)
