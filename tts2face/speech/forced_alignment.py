"""Forced alignment: where in a recording each phone of a known text sounds.

The acoustic model and the two-pass state alignment are PocketSphinx's (Huggins-Daines et al. 2006), whose model lies in
its wheel. An `Aligner` serves one thread at a time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.phones import ARPABET, PHONES, nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.types import Waveform

MODEL_RATE = 16000  # Hz, what the acoustic model was trained on
FRAME_RATE = 200  # 1/s; 100 halves the time and doubles the edge error
MODEL_DELAY_S = (
    0.009  # the model's frames lie this much early; measured on the TIMIT sample, confirmed on an Australian voice
)
PADDING_S = 0.1  # quiet noise before and behind, so that the first and last phone have a silence to begin from
MARGIN_S = 0.15  # kept of the silence at either end: the model normalises by the mean, which more silence would shift
AUDIBLE_SHARE = 0.01  # of the loudest window's level
LEVEL_WINDOW_S = 0.01
NOISE_LEVEL = 1e-4  # of full scale; digital silence has no logarithm
PEAK_LEVEL = 0.7  # level at which the model hears the sound
MIN_PHONE_S = 0.005  # one frame: shorter phones and silences are not found
SILENT_NAMES = frozenset({"SIL", "+NSN+", "+SPN+"})

Pronunciations = Sequence[tuple[str, ...]]  # alternatives of one word, in phones of the table


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Phones from 0 s to the end of the sound, one span for each word, and how well they fit.

    ``confidence`` is the mean log likelihood per second of speech, relative to the best fitting state of the acoustic
    model at each instant: 0 is perfect; a wrong text lies far below a right one. ``scores`` (N,) are the log
    likelihoods of the phones, 0 for silences.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    confidence: float
    scores: NDArray[np.float64]


class Aligner:
    """Finds the edges of the phones of a known text."""

    def __init__(self) -> None:
        from pocketsphinx import Decoder

        self._decoder: Any = Decoder(
            lm=None, loglevel="FATAL", bestpath=False, frate=FRAME_RATE, beam=1e-100, wbeam=1e-80, pbeam=1e-100
        )
        self._known: dict[tuple[tuple[str, ...], ...], str] = {}

    def align(self, sound: Waveform, words: Sequence[tuple[str, Pronunciations]]) -> Alignment:
        """Edges of the phones of each word.

        Parameters
        ----------
        words
            Written word and its pronunciations; of several the best fitting is taken.

        Raises
        ------
        DataError
            There is no word, or the sound does not hold these words.
        """
        if not words:
            raise DataError("there is no word to align; give a transcript")
        names = [self._word_name(tuple(tuple(way) for way in ways)) for _, ways in words]
        part, begin = _trim_to_audible(sound)
        entries = self._decode(_pcm_bytes(part), " ".join(names))
        if [entry.name.split("(")[0] for entry in entries] != names:
            found = len(entries)
            raise DataError(f"only {found} of {len(names)} words could be aligned; check the transcript")
        return _build_alignment(entries, words, sound.duration, begin)

    def _word_name(self, ways: tuple[tuple[str, ...], ...]) -> str:
        """The decoder's name of a word with these pronunciations."""
        if ways not in self._known:
            name = f"w{len(self._known)}x"
            for number, way in enumerate(ways):
                spelt = name if number == 0 else f"{name}({number + 1})"
                self._decoder.add_word(spelt, " ".join(acoustic_phones(way)), number == len(ways) - 1)
            self._known[ways] = name
        return self._known[ways]

    def _decode(self, pcm: bytes, text: str) -> "list[_DecodedWord]":
        decoder = self._decoder
        decoder.reinit_feat()  # forgets the level of what was heard before: the same sound gives the same edges
        decoder.set_align_text(text)
        for second_pass in (False, True):
            try:
                if second_pass:
                    decoder.set_alignment()
                decoder.start_utt()
                decoder.process_raw(pcm, full_utt=True)
                decoder.end_utt()
            except RuntimeError as failed:
                raise DataError("the sound does not hold these words; check the transcript") from failed
        found = decoder.get_alignment()
        if found is None:
            raise DataError("the sound does not hold these words; check the transcript")
        entries = []
        for word in found:
            phones = [(phone.name, phone.start, phone.duration, phone.score) for phone in word]
            if not word.name.startswith(("<", "[")):
                entries.append(_DecodedWord(word.name, phones))
        return entries


@dataclass(frozen=True, slots=True)
class _DecodedWord:
    """A word as the decoder found it: phone names, first frame, frames, score."""

    name: str
    phones: list[tuple[str, int, int, int]]

    @property
    def way(self) -> int:
        """Which of the word's pronunciations fitted."""
        return int(self.name[self.name.index("(") + 1 : -1]) - 1 if "(" in self.name else 0


def acoustic_phones(phones: Sequence[str]) -> list[str]:
    """ARPABET names that the acoustic model knows, one for each phone, the nearest where it lacks one."""
    names = []
    for phone in phones:
        nearest = nearest_phones(phone, _MODEL_PHONES)[0]
        names.append(PHONES[nearest].arpabet.removesuffix("0"))
    return names


_MODEL_PHONES = frozenset(ARPABET.values())


def _trim_to_audible(sound: Waveform) -> tuple[Waveform, float]:
    """The part of a sound from a margin before to a margin behind what can be heard, and the second it begins at."""
    window = max(1, round(LEVEL_WINDOW_S * sound.rate))
    n_windows = len(sound.samples) // window
    levels = np.abs(sound.samples[: n_windows * window].reshape(n_windows, window)).max(axis=1, initial=0.0)
    loud = np.flatnonzero(levels > AUDIBLE_SHARE * levels.max(initial=0.0))
    if not len(loud):
        return sound, 0.0
    margin = round(MARGIN_S * sound.rate)
    first = max(0, int(loud[0]) * window - margin)
    last = min(len(sound.samples), (int(loud[-1]) + 1) * window + margin)
    return Waveform(sound.samples[first:last], sound.rate), first / sound.rate


def _pcm_bytes(sound: Waveform) -> bytes:
    """16-bit samples for the acoustic model, padded and at one level."""
    import soxr

    samples = sound.samples
    if sound.rate != MODEL_RATE:
        samples = soxr.resample(samples, sound.rate, MODEL_RATE)
    level = PEAK_LEVEL / max(float(np.abs(samples).max(initial=0.0)), 1e-3)
    n_padding = round(PADDING_S * MODEL_RATE)
    heard = np.random.default_rng(0).normal(0.0, NOISE_LEVEL, len(samples) + 2 * n_padding)
    heard[n_padding : n_padding + len(samples)] += samples * level
    pcm: NDArray[np.int16] = np.clip(heard * 32767, -32768, 32767).astype(np.int16)
    return pcm.tobytes()


def _build_alignment(
    entries: Sequence[_DecodedWord], words: Sequence[tuple[str, Pronunciations]], duration: float, begin: float
) -> Alignment:
    """Edges on the clock of a whole sound, of which the decoder heard what begins at `begin`."""
    labels: list[str] = []
    starts: list[float] = []
    spans: list[WordSpan] = []
    end = 0.0
    scores: dict[int, float] = {}  # by phone
    n_frames = 0
    for entry, (text, ways) in zip(entries, words, strict=True):
        onset = begin + _frame_to_seconds(entry.phones[0][1])
        if onset - end >= MIN_PHONE_S:  # silence, at the beginning too
            labels.append(SILENCE)
            starts.append(end)
        spans.append(WordSpan(text, len(labels), len(labels) + len(entry.phones)))
        for phone, (_, first, count, fit) in zip(ways[entry.way], entry.phones, strict=True):
            scores[len(labels)] = float(fit)
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


def enforce_increasing(edges: NDArray[np.float64], least: float = MIN_PHONE_S) -> NDArray[np.float64]:
    """Edges of which each lies at least `least` seconds behind the one before; first and last stay.

    Shorter phones borrow from their neighbours; where the whole is too short, all phones share it equally.
    """
    n = len(edges) - 1
    first, last = float(edges[0]), float(edges[-1])
    if (last - first) <= n * least:
        return np.linspace(first, last, n + 1)
    room = np.arange(n + 1) * least
    slack = np.clip(np.maximum.accumulate(edges - room), first, last - n * least)
    moved: NDArray[np.float64] = slack + room
    moved[0], moved[-1] = first, last
    return moved
