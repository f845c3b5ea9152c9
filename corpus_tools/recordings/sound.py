"""Sound and aligned phones of recordings, stored in a cache folder."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.video import content_key
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.sound.alignment import Aligner, TextMismatch
from tts2face.sound.pauses import Span, cut_at_pauses, cut_sound
from tts2face.sound.word_assignment import assign_words
from tts2face.sound.word_lattice import PronouncedWords
from tts2face.storage.array_cache import read_kept
from tts2face.storage.tensors import write_tensors
from tts2face.types import Waveform
from tts2face.video.media import read_sound

# seconds
LEVEL_WINDOW_S = 0.02
ALIGNMENT_KIND = "alignment"
ALIGNMENT_VERSION = 8  # increased when alignment gives other edges, which invalidates cached ones
RECOGNITION_KIND = "hearing"
RECOGNITION_VERSION = 3  # increased when other phones are recognised
SOUND_RATE = 16_000  # Hz; input of the aligner and the recogniser
MAX_UTTERANCE_S = 20.0  # longer recordings are cut at pauses


@dataclass(frozen=True, slots=True, eq=False)
class AlignedSpeech:
    """Phones, words, how well the words fit the sound, what does not, and the sound.

    ``is_recognised`` if there is no transcript: the words are then recognised phones between slashes.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    fit: float
    mismatches: tuple[TextMismatch, ...]
    sound: Waveform
    is_recognised: bool


class CachedAligner:
    """Aligner of recordings with a cache; models are loaded on first use, and the last file's sound stays in memory."""

    def __init__(self, cache: Path) -> None:
        self._cache = cache
        self._aligner = Aligner()
        self._last: tuple[str, Waveform] | None = None  # key, sound

    def sound(self, video: Path, span: Span | None = None) -> Waveform:
        """Sound of a file, or of a span of its seconds.

        Raises
        ------
        DataError
            There is no sound, or it cannot be decoded.
        """
        key = content_key(video)
        if self._last is None or self._last[0] != key:
            self._last = None  # frees the memory before the next sound is read
            self._last = key, read_sound(video, SOUND_RATE)
        return self._last[1] if span is None else cut_sound(self._last[1], span)

    def align(self, video: Path, words: PronouncedWords | None, span: Span | None = None) -> AlignedSpeech:
        """Phones of a recording's sound, from the cache if the same sound and words have been aligned.

        Parameters
        ----------
        words
            The transcript; phones are recognised from the sound if None.
        span
            Seconds of the file to align, from which the phones' time starts; the whole file by default.

        Raises
        ------
        DataError
            There is no sound, it is too short for these words, or it contains no speech.
        BackendError
            The phone recogniser does not run on this machine.
        """
        sound = self.sound(video, span)
        request = hashlib.sha256(json.dumps([words, span]).encode()).hexdigest()[:8]
        cached = self._cache / f"{content_key(video)}-{request}-{ALIGNMENT_VERSION}.{ALIGNMENT_KIND}"
        found = _read_cached_alignment(cached, sound, is_recognised=words is None)
        return found or self._align_words(sound, words, cached)

    def utterances(self, video: Path, words: PronouncedWords | None) -> tuple[tuple[Span, PronouncedWords | None], ...]:
        """A long recording cut at pauses: spans in seconds, and the words in each.

        Raises
        ------
        DataError
            There is no sound.
        BackendError
            The phone recogniser, which locates the words, does not run on this machine.
        """
        spans = cut_at_pauses(self.sound(video), MAX_UTTERANCE_S)
        if words is None:
            return tuple((span, None) for span in spans)
        recognised = [
            [phone for word in span_words for phone in word] for span_words in self._recognise_spans(video, spans)
        ]
        places = assign_words([pronunciations[0] for _, pronunciations in words], recognised)
        words_of_spans = [
            tuple(word for word, place in zip(words, places, strict=True) if place == at) for at in range(len(spans))
        ]
        return tuple((span, found) for span, found in zip(spans, words_of_spans, strict=True) if found)

    def _align_words(self, sound: Waveform, words: PronouncedWords | None, cached: Path) -> AlignedSpeech:
        found = self._aligner.align(sound, words, may_lack=words is not None)
        header = {
            "phones": found.phones.phones,
            "words": [[word.text, word.first, word.last, word.confidence] for word in found.words],
            "fit": found.fit.share,
            "mismatches": [[mismatch.begin, mismatch.end, mismatch.words] for mismatch in found.mismatches],
        }
        write_tensors(cached, ALIGNMENT_KIND, ALIGNMENT_VERSION, {"edges": found.phones.edges}, header)
        return AlignedSpeech(
            found.phones, found.words, found.fit.share, found.mismatches, sound, is_recognised=words is None
        )

    def _recognise_spans(self, video: Path, spans: Sequence[Span]) -> list[list[tuple[str, ...]]]:
        """Recognised phones of the words in each span, from the cache if available."""
        cached = self._cache / f"{content_key(video)}-{RECOGNITION_VERSION}.{RECOGNITION_KIND}"
        stored = read_kept(cached, RECOGNITION_KIND, RECOGNITION_VERSION, lambda _, header: header["words"])
        if stored is not None and len(stored) == len(spans):
            return [[tuple(word) for word in words] for words in stored]
        found = [list(self._aligner.recogniser.hear(self.sound(video, span)).words()) for span in spans]
        write_tensors(cached, RECOGNITION_KIND, RECOGNITION_VERSION, {"spans": np.array(spans)}, {"words": found})
        return found


def _read_cached_alignment(cached: Path, sound: Waveform, *, is_recognised: bool) -> AlignedSpeech | None:
    """The cached alignment; None if it is missing or damaged."""

    def build(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> AlignedSpeech:
        words = tuple(WordSpan(text, first, last, sure) for text, first, last, sure in header["words"])
        mismatches = tuple(TextMismatch(start, end, tuple(missing)) for start, end, missing in header["mismatches"])
        phones = PhoneSequence(header["phones"], arrays["edges"])
        return AlignedSpeech(phones, words, float(header["fit"]), mismatches, sound, is_recognised)

    return read_kept(cached, ALIGNMENT_KIND, ALIGNMENT_VERSION, build)
