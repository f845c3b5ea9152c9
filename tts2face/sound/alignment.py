"""Forced alignment of the phones of a known text with a recording.

Acoustic model and two-pass state alignment are those of PocketSphinx (Huggins-Daines et al. 2006), whose wheel includes
the model. An `Aligner` is not thread-safe.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.phones import ARPABET, PHONES, nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.sound.pauses import sound_windows
from tts2face.types import Waveform

MODEL_RATE = 16000  # Hz, sample rate of the acoustic model's training data
FRAME_RATE = 200  # Hz; 100 halves the run time and doubles the edge error
# The model's frames are early by this time; measured on the TIMIT sample, confirmed on an Australian voice.
MODEL_DELAY_S = 0.009
PADDING_S = 0.1  # low noise at both ends, as silence before the first and after the last phone
MARGIN_S = 0.15  # silence retained at both ends; more of it would shift the mean by which the model normalises
AUDIBLE_SHARE = 0.01  # relative to the level of the loudest window
LEVEL_WINDOW_S = 0.01
NOISE_LEVEL = 1e-4  # relative to full scale; digital silence has no logarithm
PEAK_LEVEL = 0.7  # peak amplitude of the model's input
MIN_PHONE_S = 0.005  # one frame; shorter phones and silences cannot be resolved

Pronunciations = Sequence[tuple[str, ...]]  # alternatives of one word, in phones of the table


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Result of a forced alignment.

    Parameters
    ----------
    phones
        N phones from 0 s to the end of the sound.
    words
        One span of phones for each word.
    confidence
        Mean log likelihood per second of speech, relative to the best fitting state of the acoustic model in each
        frame: at most 0, and much lower for a wrong text than for the right one.
    scores : (N,)
        Log likelihoods of the phones; 0 for silences.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    confidence: float
    scores: NDArray[np.float64]


class SpeechAligner(Protocol):
    """Whatever aligns as `Aligner` does, for instance in another process."""

    def align(self, sound: Waveform, words: Sequence[tuple[str, Pronunciations]]) -> Alignment:
        """As `Aligner.align`."""


class Aligner:
    """Forced aligner, whose acoustic model is loaded when it is first used; not thread-safe."""

    def __init__(self) -> None:
        self._names: dict[tuple[tuple[str, ...], ...], str] = {}

    def load(self) -> None:
        """Load the acoustic model, for instance before a process forks."""
        _ = self._decoder

    @cached_property
    def _decoder(self) -> Any:
        from pocketsphinx import Decoder

        return Decoder(
            lm=None,
            dict=None,  # each word is added with its pronunciations; the package's 130,000 words take 0.1 s to read
            loglevel="FATAL",
            bestpath=False,
            frate=FRAME_RATE,
            beam=1e-100,
            wbeam=1e-80,
            pbeam=1e-100,
        )

    def align(self, sound: Waveform, words: Sequence[tuple[str, Pronunciations]]) -> Alignment:
        """Align the phones of words with a sound.

        Parameters
        ----------
        words
            Each written word with its alternative pronunciations, of which the best fitting one is chosen.

        Raises
        ------
        DataError
            There is no word, or the sound does not contain these words.
        """
        if not words:
            raise DataError("there is no word to align; give a transcript")
        names = [self._word_name(tuple(tuple(phones) for phones in alternatives)) for _, alternatives in words]
        part, begin = _trim_to_audible(sound)
        entries = self._decode(_pcm_bytes(part), " ".join(names))
        if [entry.name.split("(")[0] for entry in entries] != names:
            found = len(entries)
            raise DataError(f"only {found} of {len(names)} words could be aligned; check the transcript")
        return _build_alignment(entries, words, sound.duration, begin)

    def _word_name(self, pronunciations: tuple[tuple[str, ...], ...]) -> str:
        """Name of a word with these pronunciations in the decoder's dictionary."""
        if pronunciations not in self._names:
            name = f"w{len(self._names)}x"
            for number, phones in enumerate(pronunciations):
                label = name if number == 0 else f"{name}({number + 1})"
                self._decoder.add_word(label, " ".join(acoustic_phones(phones)), number == len(pronunciations) - 1)
            self._names[pronunciations] = name
        return self._names[pronunciations]

    def _decode(self, pcm: bytes, text: str) -> "list[_DecodedWord]":
        decoder = self._decoder
        decoder.reinit_feat()  # resets the running level normalisation: equal sounds give equal edges
        decoder.set_align_text(text)
        for second_pass in (False, True):
            try:
                if second_pass:
                    decoder.set_alignment()
                decoder.start_utt()
                decoder.process_raw(pcm, full_utt=True)
                decoder.end_utt()
            except RuntimeError as failed:
                raise DataError("the sound does not contain these words; check the transcript") from failed
        found = decoder.get_alignment()
        if found is None:
            raise DataError("the sound does not contain these words; check the transcript")
        entries = []
        for word in found:
            phones = [(phone.name, phone.start, phone.duration, phone.score) for phone in word]
            if not word.name.startswith(("<", "[")):
                entries.append(_DecodedWord(word.name, phones))
        return entries


@dataclass(frozen=True, slots=True)
class _DecodedWord:
    """A decoded word: name, first frame, number of frames and score of each phone."""

    name: str
    phones: list[tuple[str, int, int, int]]

    @property
    def pronunciation(self) -> int:
        """Index of the chosen pronunciation."""
        return int(self.name[self.name.index("(") + 1 : -1]) - 1 if "(" in self.name else 0


def acoustic_phones(phones: Sequence[str]) -> list[str]:
    """ARPABET names of the acoustic model's phones nearest to given phones."""
    names = []
    for phone in phones:
        nearest = nearest_phones(phone, _MODEL_PHONES)[0]
        names.append(PHONES[nearest].arpabet.removesuffix("0"))
    return names


_MODEL_PHONES = frozenset(ARPABET.values())


def _trim_to_audible(sound: Waveform) -> tuple[Waveform, float]:
    """Audible part of a sound with a margin of `MARGIN_S` at both ends, and its start in seconds."""
    windows = sound_windows(sound, LEVEL_WINDOW_S)
    levels, window = np.abs(windows).max(axis=1, initial=0.0), windows.shape[1]
    loud = np.flatnonzero(levels > AUDIBLE_SHARE * levels.max(initial=0.0))
    if not len(loud):
        return sound, 0.0
    margin = round(MARGIN_S * sound.rate)
    first = max(0, int(loud[0]) * window - margin)
    last = min(len(sound.samples), (int(loud[-1]) + 1) * window + margin)
    return sound.part(first, last), first / sound.rate


def _pcm_bytes(sound: Waveform) -> bytes:
    """16-bit samples at `MODEL_RATE`, padded with noise and normalised to `PEAK_LEVEL`."""
    import soxr

    samples = sound.samples
    if sound.rate != MODEL_RATE:
        samples = soxr.resample(samples, sound.rate, MODEL_RATE)
    level = PEAK_LEVEL / max(float(np.abs(samples).max(initial=0.0)), 1e-3)
    n_padding = round(PADDING_S * MODEL_RATE)
    padded = np.random.default_rng(0).normal(0.0, NOISE_LEVEL, len(samples) + 2 * n_padding)
    padded[n_padding : n_padding + len(samples)] += samples * level
    pcm: NDArray[np.int16] = np.clip(padded * 32767, -32768, 32767).astype(np.int16)
    return pcm.tobytes()


def _build_alignment(
    entries: Sequence[_DecodedWord], words: Sequence[tuple[str, Pronunciations]], duration: float, begin: float
) -> Alignment:
    """Alignment of a whole sound of `duration` seconds, whose decoded part starts at `begin` seconds."""
    labels: list[str] = []
    starts: list[float] = []
    spans: list[WordSpan] = []
    end = 0.0
    scores: dict[int, float] = {}  # by phone
    n_frames = 0
    for entry, (text, pronunciations) in zip(entries, words, strict=True):
        onset = begin + _frame_to_seconds(entry.phones[0][1])
        if onset - end >= MIN_PHONE_S:  # a silence, also before the first word
            labels.append(SILENCE)
            starts.append(end)
        spans.append(WordSpan(text, len(labels), len(labels) + len(entry.phones)))
        for phone, (_, first, count, score) in zip(pronunciations[entry.pronunciation], entry.phones, strict=True):
            scores[len(labels)] = float(score)
            labels.append(phone)
            starts.append(begin + _frame_to_seconds(first))
            end = begin + _frame_to_seconds(first + count)
            n_frames += count
    if duration - end >= MIN_PHONE_S:
        labels.append(SILENCE)
        starts.append(end)
    edges = np.array([*starts, duration])
    edges[0] = 0.0
    confidence = sum(scores.values()) / max(n_frames, 1) * FRAME_RATE
    by_phone = np.array([scores.get(at, 0.0) for at in range(len(labels))])
    return Alignment(PhoneSequence(labels, enforce_increasing(edges)), tuple(spans), confidence, by_phone)


def _frame_to_seconds(frame: int) -> float:
    return frame / FRAME_RATE + MODEL_DELAY_S - PADDING_S


def enforce_increasing(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Move (N + 1,) edges so that successive ones differ by at least `MIN_PHONE_S`; the first and last are fixed.

    Phones that are too short are lengthened at the cost of their neighbours. If the total duration is less than
    `MIN_PHONE_S` for each phone, all phones get equal durations.
    """
    n = len(edges) - 1
    first, last = float(edges[0]), float(edges[-1])
    if (last - first) <= n * MIN_PHONE_S:
        return np.linspace(first, last, n + 1)
    room = np.arange(n + 1) * MIN_PHONE_S
    slack = np.clip(np.maximum.accumulate(edges - room), first, last - n * MIN_PHONE_S)
    moved: NDArray[np.float64] = slack + room
    moved[0], moved[-1] = first, last
    return moved
