"""How fast the neural voice is, and how exact its edges are: as it states them, and found in its sound in two ways:
those of the voice, and those of the aligner of recordings.

Run: ``python tests/bench/bench_voice.py``. Edges are compared with landmarks of the sound that no aligner had a part
in: the instant at which the energy above 4 kHz rises or falls most steeply where a sibilant meets a vowel, and the
first and last audible instant of the sentence.
"""

import argparse
import time
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt
from sentences import sentences

from lexicon.phones import PHONES
from lexicon.sequence import SILENCE, PhoneSequence, enforce_increasing
from tts2face.sound.alignment import Aligner
from tts2face.sound.heart import NeuralVoice
from tts2face.sound.heart_letters import LetteredWord
from tts2face.sound.segments import StatedPhone
from tts2face.types import Waveform

SIBILANTS = frozenset({"s", "z", "ʃ", "ʒ"})
HIGH_HZ = 4000
SEARCH_S = 0.1  # either side of the middle between the two edges that are compared
STEP_S = 0.001
SMOOTHING_S = 0.005
AUDIBLE = 0.02


def high_energy(sound: Waveform) -> NDArray[np.float64]:
    """Log energy above `HIGH_HZ` at steps of `STEP_S`."""
    sections = butter(4, HIGH_HZ, "highpass", fs=sound.rate, output="sos")
    power = sosfiltfilt(sections, sound.samples.astype(np.float64)) ** 2
    window = np.hanning(round(2 * SMOOTHING_S * sound.rate))
    smooth = np.convolve(power, window / window.sum(), "same")
    return 10 * np.log10(smooth[:: round(STEP_S * sound.rate)] + 1e-9)


def landmarks(phones: PhoneSequence) -> Iterator[tuple[int, int]]:
    """Number of each edge between a sibilant and a vowel, and +1 where energy rises there, -1 where it falls."""
    for at, (before, behind) in enumerate(zip(phones.phones, phones.phones[1:], strict=False), start=1):
        if before in SIBILANTS and PHONES[behind].is_vowel:
            yield at, -1
        elif behind in SIBILANTS and PHONES[before].is_vowel:
            yield at, 1


def sounding(phones: PhoneSequence) -> PhoneSequence:
    """The sequence with inner silences given to the phone before them, so that both ways have the same phones."""
    kept = [at for at, phone in enumerate(phones.phones) if phone != SILENCE]
    edges = [phones.edges[at] for at in kept] + [phones.edges[kept[-1] + 1]]
    return PhoneSequence([phones.phones[at] for at in kept], edges)


def stated(words: Sequence[LetteredWord], phones: Sequence[StatedPhone], duration: float) -> PhoneSequence:
    """Phones as the voice states them."""
    spoken = [one for one in phones if one.label != SILENCE]
    end = spoken[-1].start + spoken[-1].duration
    edges = enforce_increasing(np.array([*(one.start for one in spoken), min(end, duration)]))
    return PhoneSequence([one.label for one in spoken], edges)


def main() -> None:
    """Print the figures that docs/performance.md sums up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", type=int, default=100, help="sentences")
    n = parser.parse_args().n
    voice, aligner = NeuralVoice({}), Aligner()
    errors: dict[str, list[float]] = {"stated": [], "recordings": [], "segments": []}
    ends: dict[str, list[float]] = {name: [] for name in errors}
    seconds = dict.fromkeys(("voice", "recordings", "voice and segments"), 0.0)
    length = 0.0
    voice.speak("Hello.")
    for text in sentences(n):
        began = time.perf_counter()
        (part,) = voice.parts(text)
        sound, words, phones = part.sound, part.words, part.stated
        spoken = time.perf_counter()
        aligned = aligner.align(sound, [(word.text, [word.phones]) for word in words])
        done = time.perf_counter()
        speech = voice.speak(text)
        seconds["voice"] += spoken - began
        seconds["recordings"] += done - spoken
        seconds["voice and segments"] += time.perf_counter() - done
        length += sound.duration
        ways = {
            "stated": stated(words, phones, sound.duration),
            "recordings": sounding(aligned.phones),
            "segments": sounding(speech.phones),
        }
        energy = high_energy(sound)
        slope = np.gradient(energy)
        level = np.abs(sound.samples)
        audible = np.flatnonzero(level > AUDIBLE * level.max()) / sound.rate
        for name, found in ways.items():
            ends[name] += [found.start - audible[0], found.end - audible[-1]]
        for at, sign in landmarks(ways["segments"]):
            middle = (ways["recordings"].edges[at] + ways["segments"].edges[at]) / 2
            first = max(0, round((middle - SEARCH_S) / STEP_S))
            true = (first + int(np.argmax(sign * slope[first : round((middle + SEARCH_S) / STEP_S)]))) * STEP_S
            for name, found in ways.items():
                errors[name].append(float(found.edges[at] - true))
    print(f"{n} sentences, {length:.0f} s of speech; real-time factors:")
    print(", ".join(f"{name} {spent / length:.4f}" for name, spent in seconds.items()))
    print("| edges | sibilant edges | median error | median absolute | within 20 ms | sentence ends, median absolute |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, all_errors in errors.items():
        ms = 1000 * np.array(all_errors)
        near = f"{np.mean(np.abs(ms) <= 20):.0%}"
        apart, size = 1000 * np.median(np.abs(ends[name])), np.median(np.abs(ms))
        print(f"| {name} | {len(ms)} | {np.median(ms):+.0f} ms | {size:.0f} ms | {near} | {apart:.0f} ms |")


if __name__ == "__main__":
    main()
