"""Speech of a voice that reports no times: its sound with the phones of its words, by forced alignment."""

from collections.abc import Sequence

import numpy as np

from lexicon.errors import DataError
from lexicon.nominal_durations import NOMINAL_S
from lexicon.phones import PHONES
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.sound.alignment import Align
from tts2face.sound.voice import SpeechInput
from tts2face.types import Speech, Waveform

AlignedWord = tuple[str, list[tuple[str, ...]]]  # a written word with its phones, for the aligner


def aligned_speech(sound: Waveform, words: Sequence[AlignedWord], align: Align) -> Speech:
    """Sound with the phones of its words, at nominal durations where these cannot be aligned."""
    try:
        found = align(sound, words)
    # hundreds of equal words have no alignment, but their sound is right
    except DataError:
        return Speech(sound, *_nominal_phones(words, sound.duration))
    return Speech(sound, found.phones, found.words)


def written_text(content: SpeechInput) -> str:
    """Text of a voice that takes no phones."""
    if isinstance(content, str):
        return content.strip()
    return " ".join(word.text + word.after for word in content).strip()


def _nominal_phones(words: Sequence[AlignedWord], seconds: float) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones with nominal durations scaled to a sound."""
    labels = [phone for _, (phones,) in words for phone in phones]
    shares = np.cumsum([0.0, *(NOMINAL_S[PHONES[phone].kind] for phone in labels)])
    spans, first = [], 0
    for text, (phones,) in words:
        spans.append(WordSpan(text, first, first + len(phones)))
        first += len(phones)
    return PhoneSequence(labels, seconds * shares / shares[-1]), tuple(spans)
