"""Speech as other people, rooms, microphones and lines would have it, for the training of what hears it."""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import PhoneSequence
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Waveform

VOICES = (0.86, 1.2)  # factors by which a vocal tract and its pitch are shortened, and speech is quicker
PAUSES_S = (0.05, 0.7)  # of silence at both ends
NOISE_DB = (-3.0, 35.0)  # of speech over noise
NOISE_TILT, NOISE_SPREAD, N_BANDS = (0.0, 1.2), 0.6, 9  # spectral slope, log amplitudes of bands, and their number
BABBLE_SHARE, N_TALKERS = 0.25, 6
ECHO_SHARE, ECHO_S, ECHO_LEVELS, FIRST_ECHO_S = 0.35, (0.2, 0.7), (0.2, 0.7), 0.005
MICROPHONE_SHARE, MICROPHONE_SPREAD, MICROPHONE_BANDS = 0.5, 0.5, 7
CODED_SHARE, TELEPHONE_SHARE, TELEPHONE_HZ = 0.2, 0.1, 8000
CODECS = (("libmp3lame", "mp3", 64_000), ("libmp3lame", "mp3", 32_000), ("libopus", "ogg", 16_000))
AUDIBLE, LOWEST_HZ, PEAK = 0.02, 60.0, 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Damaged:
    """Sound of speech that begins ``lead`` seconds later than it did, and is ``faster`` by a factor."""

    sound: Waveform
    lead: float
    faster: float

    def phones(self, phones: PhoneSequence) -> PhoneSequence:
        """Phones in this sound, from those before; silences at the ends are longer by the pauses."""
        edges = phones.edges / self.faster + self.lead
        edges[[0, -1]] = 0.0, self.sound.duration
        return PhoneSequence(phones.phones, edges)


def damage(sound: Waveform, others: Sequence[Waveform], rng: np.random.Generator) -> Damaged:
    """The same speech by another voice in another place; `others` speak behind it."""
    import soxr

    rate, faster = sound.rate, float(rng.uniform(*VOICES))
    lead, tail = (round(float(seconds) * rate) for seconds in rng.uniform(*PAUSES_S, 2))
    voice = soxr.resample(sound.samples.astype(np.float64), rate * faster, rate)
    samples = np.concatenate([np.zeros(lead), voice, np.zeros(tail)])
    power = speech_power(samples)
    if rng.random() < ECHO_SHARE:
        samples = with_echo(samples, rate, (float(rng.uniform(*ECHO_S)), float(rng.uniform(*ECHO_LEVELS))), rng)
    if rng.random() < BABBLE_SHARE:
        noise = babble(len(samples), [other.samples for other in others], rng)
    else:
        noise = stationary_noise(len(samples), rate, float(rng.uniform(*NOISE_TILT)), rng)
    samples = samples + noise * np.sqrt(power / 10 ** (float(rng.uniform(*NOISE_DB)) / 10))
    if rng.random() < MICROPHONE_SHARE:
        samples = _filtered(samples, _bands(len(samples), MICROPHONE_BANDS, MICROPHONE_SPREAD, rng))
    line = rng.random()
    if line < CODED_SHARE:
        samples = coded(samples, rate, *CODECS[int(rng.integers(len(CODECS)))])
    elif line < CODED_SHARE + TELEPHONE_SHARE:
        samples = np.resize(soxr.resample(soxr.resample(samples, rate, TELEPHONE_HZ), TELEPHONE_HZ, rate), len(samples))
    scaled = (samples * PEAK / np.abs(samples).max()).astype(np.float32)
    return Damaged(Waveform(scaled, rate), lead / rate, faster)


def damaged_copies(
    sounds: Sequence[Waveform], n_copies: int, rng: np.random.Generator
) -> Iterator[tuple[int, Damaged]]:
    """Each sound several times, damaged in several ways, with its number; the others speak behind it."""
    for at in range(n_copies * len(sounds)):
        number = at % len(sounds)
        yield number, damage(sounds[number], sounds, rng)


def speech_power(samples: NDArray[np.floating]) -> float:
    """Mean square of the samples that are not silent."""
    return float(np.square(samples[np.abs(samples) > AUDIBLE * np.abs(samples).max()], dtype=np.float64).mean())


def stationary_noise(n: int, rate: int, tilt: float, rng: np.random.Generator) -> FloatArray:
    """Noise (n,) of unit power whose amplitudes fall with the frequency to the power of `tilt`, and differ by bands."""
    frequencies = np.maximum(np.fft.rfftfreq(n, 1.0 / rate), LOWEST_HZ)
    made = _filtered(rng.normal(size=n), frequencies**-tilt * _bands(n, N_BANDS, NOISE_SPREAD, rng))
    scaled: FloatArray = made / made.std()
    return scaled


def babble(n: int, others: Sequence[NDArray[np.floating]], rng: np.random.Generator) -> FloatArray:
    """Several people at once (n,), of unit power."""
    made = np.zeros(n)
    for _ in range(N_TALKERS):
        other = others[int(rng.integers(len(others)))]
        made += np.resize(np.roll(other / other.std(), int(rng.integers(len(other)))), n)
    scaled: FloatArray = made / made.std()
    return scaled


def _bands(n: int, n_bands: int, spread: float, rng: np.random.Generator) -> FloatArray:
    """Smooth random amplitudes of the frequencies of n samples."""
    places = np.linspace(0.0, 1.0, n // 2 + 1)
    return np.exp(np.interp(places, np.linspace(0.0, 1.0, n_bands), rng.normal(0.0, spread, n_bands)))


def _filtered(samples: FloatArray, amplitudes: FloatArray) -> FloatArray:
    found: FloatArray = np.fft.irfft(np.fft.rfft(samples) * amplitudes, len(samples))
    return found


def with_echo(samples: FloatArray, rate: int, room: tuple[float, float], rng: np.random.Generator) -> FloatArray:
    """Speech in a room: seconds in which its echo falls by 60 dB, and the echo's level relative to the speech."""
    from scipy.signal import fftconvolve

    n = round(room[0] * rate)
    answer = rng.normal(size=n) * 10.0 ** (-3.0 * np.arange(n) / n)
    answer[: round(FIRST_ECHO_S * rate)] = 0.0
    answer *= room[1] / np.sqrt(np.square(answer).sum())
    answer[0] = 1.0
    found: FloatArray = fftconvolve(samples, answer)[: len(samples)]
    return found


def coded(samples: FloatArray, rate: int, codec: str, container: str, bit_rate: int) -> FloatArray:
    """The samples after a codec, without its delay."""
    import av

    file = io.BytesIO()
    with av.open(file, "w", format=container) as written:
        stream: Any = written.add_stream(codec, rate=rate, layout="mono", bit_rate=bit_rate)
        pcm = (samples / np.abs(samples).max() * 0.9 * 32767).astype(np.int16)[None]
        frame = av.AudioFrame.from_ndarray(pcm, format="s16", layout="mono")
        frame.sample_rate = rate
        for packet in [*stream.encode(frame), *stream.encode(None)]:
            written.mux(packet)
    file.seek(0)
    with av.open(file, "r") as read:
        resampler = av.AudioResampler("fltp", "mono", rate)
        frames = [part.to_ndarray()[0] for item in read.decode(audio=0) for part in resampler.resample(item)]
    heard = np.concatenate(frames).astype(np.float64)
    n = len(samples) + len(heard)
    agreement = np.fft.irfft(np.fft.rfft(heard, n) * np.conj(np.fft.rfft(samples, n)), n)
    delay = int(np.argmax(agreement[: rate // 4]))
    return np.pad(heard[delay : delay + len(samples)], (0, max(0, len(samples) - len(heard) + delay)))
