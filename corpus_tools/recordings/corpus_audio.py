"""What the microphone heard in a recording: its sound, and phones that are found once and kept in a cache folder."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from corpus_tools.recordings.corpus_video import content_key
from corpus_tools.recordings.folder import PronouncedTranscript
from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.speech.pauses import Span, cut_at_pauses
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.types import Waveform
from tts2face.video.media import read_sound

if TYPE_CHECKING:
    from tts2face.speech.forced_alignment import Aligner
    from tts2face.speech.phone_recognition import PhoneRecogniser

ALIGNMENT_KIND = "alignment"
ALIGNMENT_VERSION = 4  # rises when alignment gives other edges, so that cached ones are made again
RECOGNITION_KIND = "hearing"
RECOGNITION_VERSION = 1  # rises when other phones are recognised
SOUND_RATE = 16_000  # Hz; what the aligner and the recogniser hear
MAX_UTTERANCE_S = 20.0  # longer recordings are cut at pauses


@dataclass(frozen=True, slots=True, eq=False)
class AlignedSpeech:
    """Phones, words, the alignment's confidence, and the sound.

    ``is_recognised`` where nobody wrote what is said: the words then are the phones heard, between slashes.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    confidence: float
    sound: Waveform
    is_recognised: bool


class CachedAligner:
    """Listens to recordings; models are loaded when they are needed, the last file's sound is kept."""

    def __init__(self, cache: Path) -> None:
        self._cache = cache
        self._aligner: Aligner | None = None
        self._recogniser: PhoneRecogniser | None = None
        self._last: tuple[str, Waveform] | None = None

    def sound(self, video: Path, span: Span | None = None) -> Waveform:
        """Sound of a file, or of a span of its seconds.

        Raises
        ------
        DataError
            There is no sound, or it cannot be decoded.
        """
        key = content_key(video)
        if self._last is None or self._last[0] != key:
            self._last = None  # two long sounds need not lie in memory together
            self._last = key, read_sound(video, SOUND_RATE)
        whole = self._last[1]
        return whole if span is None else cut_sound(whole, span)

    def align(self, video: Path, words: PronouncedTranscript | None, span: Span | None = None) -> AlignedSpeech:
        """Phones of a recording's sound, from the cache when the same sound and words were aligned before.

        Parameters
        ----------
        words
            What is said; recognised from the sound when None.
        span
            Seconds of the file that are listened to, the clock of the phones beginning with them; all without it.

        Raises
        ------
        DataError
            There is no sound, it does not hold these words, or nobody speaks.
        BackendError
            Nothing on this machine recognises phones.
        """
        sound = self.sound(video, span)
        asked = hashlib.sha256(json.dumps([words, span]).encode()).hexdigest()[:8]
        kept = self._cache / f"{content_key(video)}-{asked}-{ALIGNMENT_VERSION}.{ALIGNMENT_KIND}"
        found = _read_cached_alignment(kept, sound, is_recognised=words is None)
        return found or self._align_words(sound, words, kept)

    def utterances(
        self, video: Path, words: PronouncedTranscript | None
    ) -> tuple[tuple[Span, PronouncedTranscript | None], ...]:
        """A long recording cut at pauses: spans of its seconds, and the words that are said in each.

        Raises
        ------
        DataError
            There is no sound.
        BackendError
            Nothing on this machine recognises phones, by which the words are placed.
        """
        from tts2face.speech.transcript_placement import assign_words

        spans = cut_at_pauses(self.sound(video), MAX_UTTERANCE_S)
        if words is None:
            return tuple((span, None) for span in spans)
        heard = [[phone for word in said for phone in word] for said in self._recognise_spans(video, spans)]
        places = assign_words([ways[0] for _, ways in words], heard)
        said_in = [
            tuple(word for word, place in zip(words, places, strict=True) if place == at) for at in range(len(spans))
        ]
        return tuple((span, said) for span, said in zip(spans, said_in, strict=True) if said)

    def _align_words(self, sound: Waveform, words: PronouncedTranscript | None, kept: Path) -> AlignedSpeech:
        from tts2face.speech.forced_alignment import Aligner

        self._aligner = self._aligner or Aligner()
        said = (
            words
            if words is not None
            else tuple((f"/{''.join(word)}/", (word,)) for word in self._recognise_words(sound))
        )
        if not said:
            raise DataError("no speech is heard; give recordings of somebody who speaks")
        found = self._aligner.align(sound, said)
        header = {
            "phones": found.phones.phones,
            "words": [[word.text, word.first, word.last] for word in found.words],
            "confidence": found.confidence,
        }
        write_tensors(kept, ALIGNMENT_KIND, ALIGNMENT_VERSION, {"edges": found.phones.edges}, header)
        return AlignedSpeech(found.phones, found.words, found.confidence, sound, words is None)

    def _recognise_spans(self, video: Path, spans: Sequence[Span]) -> list[list[tuple[str, ...]]]:
        """Phones of the words heard in each span, from the cache when they were recognised before."""
        kept = self._cache / f"{content_key(video)}-{RECOGNITION_VERSION}.{RECOGNITION_KIND}"
        if kept.is_file():
            try:
                said = read_tensors(kept, RECOGNITION_KIND, RECOGNITION_VERSION)[1]["words"]
                if len(said) == len(spans):
                    return [[tuple(word) for word in words] for words in said]
            except (DataError, KeyError):
                pass  # damaged: made again
        found = [list(self._recognise_words(self.sound(video, span))) for span in spans]
        write_tensors(kept, RECOGNITION_KIND, RECOGNITION_VERSION, {"spans": np.array(spans)}, {"words": found})
        return found

    def _recognise_words(self, sound: Waveform) -> tuple[tuple[str, ...], ...]:
        from tts2face.speech.phone_recognition import MAX_SOUND_S, PhoneRecogniser

        self._recogniser = self._recogniser or PhoneRecogniser()
        parts = [cut_sound(sound, span) for span in cut_at_pauses(sound, MAX_SOUND_S)]
        return tuple(word for part in parts for word in self._recogniser.words(part))


def cut_sound(sound: Waveform, span: Span) -> Waveform:
    """The sound in a span of seconds."""
    first, last = (round(second * sound.rate) for second in span)
    return Waveform(sound.samples[first:last], sound.rate)


def _read_cached_alignment(kept: Path, sound: Waveform, *, is_recognised: bool) -> AlignedSpeech | None:
    """What the cache holds; None where it holds nothing or is damaged."""
    if not kept.is_file():
        return None
    try:
        arrays, header = read_tensors(kept, ALIGNMENT_KIND, ALIGNMENT_VERSION)
        words = tuple(WordSpan(text, first, last) for text, first, last in header["words"])
        phones = PhoneSequence(header["phones"], arrays["edges"])
        return AlignedSpeech(phones, words, float(header["confidence"]), sound, is_recognised)
    except (DataError, KeyError):
        return None
