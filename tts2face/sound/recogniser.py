"""Phones that are heard in a recording: their probabilities in each frame, and the most probable ones.

The acoustic network is that of hama (Park 2026, Apache-2.0), included in its wheel. Its outputs are IPA symbols in
frames of 20 ms, trained by connectionist temporal classification (Graves et al. 2006): a phone shows as a spike of one
or two frames near its middle, and between spikes the network says ``blank``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, InputError
from lexicon.ipa import parse_ipa
from lexicon.phones import ARPABET, nearest_phones
from tts2face.sound.pauses import is_near_sound
from tts2face.types import Waveform

# seconds between frames of the network's output
FRAME_S = 0.02
RATE = 16_000  # Hz
FRAME = round(FRAME_S * RATE)  # samples
LEAST_SQUARE = 1e-30  # digital silence has no logarithm
NOTHING = -100.0  # log probability of phones in silence: less than a network ever says
PART_S, CONTEXT_S = 24.0, 1.0  # of a sound in one call, whose memory grows with its length
PEAK, LEAST_PEAK = 0.3, 1e-4  # of what the network hears; its output depends on the level
WORD_BOUNDARY = "<wb>"
BLANKS = ("<blank>", WORD_BOUNDARY, "<pad>")
# Symbols that the network uses for one phone of a language in turn, beside those that are read as it.
ALSO = {
    "ə": "ʌ ɐ", "ʌ": "ə ɐ", "ɚ": "ɝ", "ɝ": "ɚ", "ɹ": "r", "oʊ": "o", "eɪ": "e", "ɑ": "ɒ a", "ɔ": "ɒ", "ɪ": "ɨ",
    "t": "ɾ", "d": "ɾ", "l": "ɫ", "u": "ʉ", "h": "ɦ",
}  # fmt: skip
ENGLISH = frozenset(ARPABET.values())  # the network hears English and Korean; other phones show as the nearest ones
FEATURES = tuple(sorted(ENGLISH))  # phones whose probabilities are features of a classifier of frames
Phones = tuple[str, ...]


def levelled(sound: Waveform) -> Waveform:
    """The sound at the level of the network's training data."""
    factor = np.float32(PEAK / max(float(np.abs(sound.samples).max(initial=0.0)), LEAST_PEAK))
    return Waveform(sound.samples * factor, sound.rate)


class PhoneRecogniser:
    """Recogniser of phones.

    Raises
    ------
    BackendError
        The package hama does not support this machine.
    """

    def __init__(self) -> None:
        try:
            from hama.asr import ASRModel

            self._network: Any = ASRModel()
            self._lock = Lock()
        except (ImportError, OSError, RuntimeError) as missing:
            raise BackendError(
                "the words of recordings are found by the package hama, which runs on Linux and macOS: "
                "pip install hama; or use another machine"
            ) from missing

    @cached_property
    def _symbols(self) -> dict[str, list[int]]:
        """Columns of the network's output by the phone of the table that their symbol is read as."""
        found: dict[str, list[int]] = {}
        for column, token in enumerate(self._network.decoder_tokens):
            if len(phones := _phones_of(token)) == 1:
                found.setdefault(phones[0], []).append(column)
        return found

    @cache  # noqa: B019 - there are few phones, and few recognisers
    def _columns(self, phone: str) -> list[int]:
        """Columns of the network's output that stand for a phone: its own, and those of the nearest English phones."""
        heard = [
            phone,
            *(other for near in nearest_phones(phone, ENGLISH) for other in (near, *ALSO.get(near, "").split())),
        ]
        return sorted({column for symbol in heard for column in self._symbols.get(symbol, [])})

    def hear(self, sound: Waveform) -> "Heard":
        """Phones that are heard in a sound of any length."""
        return Heard(self._output(sound), tuple(self._network.decoder_tokens), self._columns)

    def _output(self, sound: Waveform) -> NDArray[np.float32]:
        """Log probabilities (T, K) of the network's symbols; long sounds are heard in parts that overlap.

        Silence that lasts is left out: with it, the network is less sure of what is said.
        """
        import soxr

        samples = sound.samples if sound.rate == RATE else soxr.resample(sound.samples, sound.rate, RATE)
        samples = levelled(Waveform(samples, RATE)).samples
        kept = self._sounding_frames(samples)
        heard = self._hear_parts(samples if kept.all() else samples[np.repeat(kept, FRAME)[: len(samples)]])
        if kept.all():
            return heard
        found = np.full((len(kept), heard.shape[1]), NOTHING, np.float32)
        found[:, self._network.decoder_tokens.index(BLANKS[0])] = 0.0
        places = np.flatnonzero(kept)[: len(heard)]
        found[places] = heard[: len(places)]
        return found

    def _sounding_frames(self, samples: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether frames are near a sound; the last one has the rest of the samples, or none."""
        padded = np.pad(samples.astype(np.float64), (0, FRAME - len(samples) % FRAME)).reshape(-1, FRAME)
        return is_near_sound(10.0 * np.log10(np.square(padded).mean(axis=1) + LEAST_SQUARE), FRAME_S)

    def _hear_parts(self, samples: NDArray[np.float32]) -> NDArray[np.float32]:
        part, context, frame = (round(seconds * RATE) for seconds in (PART_S, CONTEXT_S, FRAME_S))
        found = []
        for start in range(0, max(len(samples), 1), part):
            first, is_last = max(start - context, 0), start + part >= len(samples)
            heard = self._hear(samples[first : start + part + context])
            last = len(heard) if is_last else (start + part - first) // frame
            found.append(heard[(start - first) // frame : last])
        return np.concatenate(found)

    def _hear(self, samples: NDArray[np.float32]) -> NDArray[np.float32]:
        inputs = {"waveform": samples[None], "waveform_lengths": np.array([len(samples)], np.int64)}
        with self._lock:
            found, lengths = self._network.session.run(["log_probs", "out_lengths"], inputs)
        return np.asarray(found[0, : int(np.ravel(lengths)[0])], np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Heard:
    """Log probabilities (T, K) of the network's symbols in frames of `FRAME_S`, and which of them stand for phones."""

    output: NDArray[np.float32]
    symbols: tuple[str, ...]
    columns: Callable[[str], list[int]]

    def log_probabilities(self, phones: Phones) -> NDArray[np.float32]:
        """Log probabilities (T, P + 1) of phones of the table, and of none."""
        groups = [*map(self.columns, phones), [self.symbols.index(blank) for blank in BLANKS]]
        return np.stack([np.logaddexp.reduce(self.output[:, group], axis=1) for group in groups], axis=1)

    def words(self) -> tuple[Phones, ...]:
        """The most probable phones of each word."""
        words: list[list[str]] = [[]]
        for before, column in pairwise([-1, *self.output.argmax(axis=1).tolist()]):
            if column != before and self.symbols[column] == WORD_BOUNDARY:
                words.append([])
            elif column != before:
                words[-1] += _phones_of(self.symbols[column])
        return tuple(tuple(word) for word in words if word)


@cache
def _phones_of(token: str) -> Phones:
    """Phones of the phone table for a symbol of the network; none for symbols that are not phones."""
    try:
        return tuple(segment.phone for segment in parse_ipa(token))
    except InputError:
        return ()
