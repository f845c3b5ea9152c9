"""What a voice sounds like at each frame: formants, MFCC, LPC, LSF (Theobald et al. 2007, section 3.2).

Every frame is measured in a cell of samples of its own, so that numbers do not depend on what else is measured with
them: sound given in pieces gives the same bytes as the whole.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.speech.pauses import NOISE_QUANTILE, SPEECH_QUANTILE
from tts2face.types import Trajectory, Waveform

FEATURE_RATE = 16_000  # Hz; sound is read at this rate
WINDOW_S = 0.04  # effective length of the Gaussian window (T07, section 3.2)
WINDOW_SAMPLES = 1361  # samples, odd: twice the window, which is where Praat cuts its Gaussian off, and 5 ms
HALF_WINDOW_SAMPLES = WINDOW_SAMPLES // 2  # samples needed behind a frame's instant
N_MFCC = 12
LPC_ORDER = 16  # two for each kHz of the rate
PRE_EMPHASIS_HZ = 50.0
N_FORMANT_POLES = 8  # formants up to half the rate, one for each kHz; the first four are kept
NEUTRAL_TUBE_HZ = (500.0, 1500.0, 2500.0, 3500.0)  # of a vocal tract at rest; stand where no formant is found
NOISE_LEVEL = 3e-5  # of full scale; digital silence has neither logarithm nor formants
WINDOWS_AT_ONCE = 1000  # 11 MB

AnalysisWindows = NDArray[np.float64]
Measure = Callable[[AnalysisWindows], NDArray[np.float64]]
FEATURE_KINDS = ("formants", "mfcc", "lpc", "lsf", "level")


def speech_features(sound: Waveform, kind: str, *, fps: float, n_frames: int, start: float = 0.0) -> Trajectory:
    """Features of a sound at the instants ``start + i / fps``, i = 0 ... n_frames - 1; silence beyond its ends.

    Parameters
    ----------
    sound
        At `FEATURE_RATE`.
    kind
        One of `FEATURE_KINDS`, or several as ``mfcc+lsf``: ``formants`` (4, Hz), ``mfcc`` (13, the first is the level),
        ``lpc`` (16 prediction coefficients), ``lsf`` (16, rad), ``level`` (1, dB of full scale).

    Raises
    ------
    InputError
        The kind does not exist, or the sound has another rate.
    """
    measures = feature_measures(kind)
    if sound.rate != FEATURE_RATE:
        raise InputError(f"features are measured at {FEATURE_RATE} Hz, not {sound.rate}; resample the sound")
    centres = np.rint((start + np.arange(n_frames) / fps) * FEATURE_RATE).astype(np.int64)
    parts = [
        measure_windows(analysis_windows(sound.samples, centres[at : at + WINDOWS_AT_ONCE]), measures)
        for at in range(0, n_frames, WINDOWS_AT_ONCE)
    ]
    values = np.concatenate(parts)
    return Trajectory([f"{kind}.{i}" for i in range(values.shape[1])], values, fps)


def feature_measures(kind: str) -> tuple[Measure, ...]:
    """What measures a kind of feature, or several joined by ``+``.

    Raises
    ------
    InputError
        One of them does not exist.
    """
    names = kind.split("+")
    for name in names:
        if name not in MEASURES:
            raise InputError(f"there is no feature {name!r}; choose {', '.join(FEATURE_KINDS)}")
    return tuple(MEASURES[name] for name in names)


def measure_windows(windows: AnalysisWindows, measures: tuple[Measure, ...]) -> NDArray[np.float32]:
    """(T, D) features of cells, one kind beside the other."""
    if not len(windows):  # Praat knows no sound without samples
        return measure_windows(np.zeros((1, WINDOW_SAMPLES)) + NOISE_LEVEL, measures)[:0]
    return np.concatenate([measure(windows) for measure in measures], axis=1).astype(np.float32)


def analysis_windows(samples: NDArray[np.float32], centres: NDArray[np.int64]) -> AnalysisWindows:
    """(T, `WINDOW_SAMPLES`) samples about each of T places, zeros beyond the ends, with the same faint noise."""
    first = max(int(centres.min(initial=len(samples))) - HALF_WINDOW_SAMPLES, 0)
    last = max(int(centres.max(initial=0)) + HALF_WINDOW_SAMPLES + 1, first)
    part = np.zeros(last - first + 2 * WINDOW_SAMPLES)
    heard = samples[first:last]
    part[WINDOW_SAMPLES : WINDOW_SAMPLES + len(heard)] = heard
    starts = np.clip(centres - HALF_WINDOW_SAMPLES - first + WINDOW_SAMPLES, 0, len(part) - WINDOW_SAMPLES)
    noise = np.random.default_rng(0).normal(0.0, NOISE_LEVEL, WINDOW_SAMPLES)
    return np.asarray(part[starts[:, None] + np.arange(WINDOW_SAMPLES)] + noise, np.float64)


def mfcc(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 13) mel-frequency cepstral coefficients of cells; the first is the level."""
    sound = _concatenate_windows(
        np.concatenate([windows, windows[-1:]])
    )  # of a single frame Praat gives the level alone
    found = sound.to_mfcc(number_of_coefficients=N_MFCC, window_length=WINDOW_S, time_step=_sample_step(windows))
    return np.asarray(found.to_array().T[: len(windows)], np.float64)


def lpc(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 16) linear prediction coefficients of cells, by autocorrelation."""
    from parselmouth.praat import call

    analysis = ("To LPC (autocorrelation)...", LPC_ORDER, WINDOW_S, _sample_step(windows), PRE_EMPHASIS_HZ)
    found = call(call(_concatenate_windows(windows), *analysis), "Down to Matrix (lpc)")
    return np.asarray(found.values.T, np.float64)


def lsf(windows: AnalysisWindows) -> NDArray[np.float64]:
    """(T, 16) line spectral frequencies of cells, radians."""
    return line_spectral_frequencies(lpc(windows))


def line_spectral_frequencies(coefficients: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T, M) angles in (0, pi), increasing, of T all-pole filters ``1 / A(z)``.

    Parameters
    ----------
    coefficients : (T, M)
        ``a_1 ... a_M`` of ``A(z) = 1 + sum_k a_k z^-k``; M is even, and A has its roots inside the unit circle.

    Raises
    ------
    InputError
        M is odd or 0.

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
    """(T, 4) first formants of cells, Hz; those of a neutral tube where none is found."""
    even = windows[:, :-1]  # Praat takes the sample before the middle of a window: let none lie on the middle
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
    """(T, 1) level of cells in dB of full scale, through a Hann window of twice `WINDOW_S`."""
    taper = np.hanning(windows.shape[1])
    power = np.square(windows) @ taper / taper.sum()
    return np.asarray(10.0 * np.log10(power)[:, None], np.float64)


def speech_level(levels: NDArray[np.floating]) -> float:
    """Mean level in dB of the frames with speech, of (T, 1) levels: those above the middle of noise and speech."""
    noise, speech = np.quantile(levels, NOISE_QUANTILE), np.quantile(levels, SPEECH_QUANTILE)
    return float(levels[levels >= (noise + speech) / 2].mean())


MEASURES: Mapping[str, Measure] = MappingProxyType(
    dict(zip(FEATURE_KINDS, (formants, mfcc, lpc, lsf, level), strict=True))
)


def _sample_step(windows: AnalysisWindows) -> float:
    return float(windows.shape[1] / FEATURE_RATE)


def _concatenate_windows(windows: AnalysisWindows) -> Any:
    import parselmouth

    return parselmouth.Sound(windows.ravel(), sampling_frequency=FEATURE_RATE)
