"""Speech of a voice that has one pitch: rate, F0, formants and emphasised words are changed in the finished sound."""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

import numpy as np

from lexicon.intonation import Movement, movements
from lexicon.phones import PHONES
from lexicon.sequence import PhoneSequence, WordSpan, enforce_increasing
from lexicon.tones import EVEN, Tone
from tts2face.numeric.arrays import FloatArray
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.psola import Stretch, resynthesize
from tts2face.sound.tune import EMPHASIS_LENGTH, SEMITONES, PlacedWord, Tune, shape_pitch
from tts2face.sound.voice import SpeechInput, pronounce_content
from tts2face.types import Speech

ENGLISH = "en"
OBSTRUENTS = frozenset({"stop", "affricate", "fricative", "click"})  # after which nobody hears a rise
STRETCH_RAMP_S = 0.01  # between a word of another length and its neighbours


@dataclass(frozen=True, slots=True)
class Intention:
    """Words of a content with their tones and stresses (none where unknown), and the movements of its F0.

    Of English content the words are those that are spoken; of others those that are written.
    """

    words: tuple[str, ...]
    tones: tuple[Tone, ...]
    stresses: tuple[tuple[int, ...], ...]
    movements: tuple[Movement, ...]

    @property
    def is_plain(self) -> bool:
        """Whether the voice says it as it is."""
        return not self.movements and all(tone == EVEN for tone in self.tones)


def intention(content: SpeechInput, language: str) -> Intention:
    """Tones of the words of a content, and movements if it is English: other voices intone their own languages."""
    if language.partition("-")[0] == ENGLISH:
        words = pronounce_content(content, language, {})
        texts = tuple(word.text for word in words)
        found = movements(texts, [word.mark for word in words])
        return Intention(texts, tuple(word.tone for word in words), tuple(word.stress for word in words), found)
    if isinstance(content, str):
        return Intention((), (), (), ())
    return Intention(tuple(word.text for word in content), tuple(word.tone for word in content), (), ())


def is_retuned(prosody: Prosody, intended: Intention) -> bool:
    """Whether `retuned` changes anything."""
    return not intended.is_plain or prosody != PLAIN_PROSODY


def retuned(speech: Speech, prosody: Prosody, intended: Intention) -> Speech:
    """Speech with a prosody, tones and movements; edges move with the sound."""
    places = matched_words(intended.words, [word.text for word in speech.words])
    words = [_placed(speech, span, intended, place) for span, place in zip(speech.words, places, strict=True)]
    spans = {place: at for at, place in enumerate(places) if place is not None}
    moves = [
        Movement(move.tune, spans[move.at], spans[move.until])
        for move in intended.movements
        if move.at in spans and move.until in spans
    ]
    tune = Tune(prosody, words, moves)
    stretch = _stretch(words, speech.waveform.duration, prosody.rate)
    sound = resynthesize(
        speech.waveform,
        stretch,
        None if tune.is_plain else lambda times, hertz: _shaped(times, hertz, tune, speech.phones),
        prosody.formants,
    )
    if sound is speech.waveform:
        return speech
    edges = enforce_increasing(np.minimum(stretch.moved(speech.phones.edges), sound.duration))
    edges[-1] = sound.duration
    return Speech(sound, PhoneSequence(speech.phones.phones, edges), speech.words)


def _shaped(times: FloatArray, hertz: FloatArray, tune: Tune, phones: PhoneSequence) -> FloatArray:
    """F0 (N,) at N times, shaped in voiced phones; the hum of a neural voice in others goes with that around it."""
    at = np.clip(np.searchsorted(phones.edges, times, side="right") - 1, 0, len(phones) - 1)
    voiced = np.array([label in PHONES and PHONES[label].is_voiced for label in phones.phones])[at]
    sonorous = np.array([label in PHONES and PHONES[label].kind not in OBSTRUENTS for label in phones.phones])[at]
    ratio: FloatArray = np.full(len(times), 2.0 ** (tune.prosody.pitch / SEMITONES))
    if voiced.any():
        found = shape_pitch(np.where(voiced, hertz, 0.0), times, tune, sonorous).f0
        ratio = np.interp(times, times[voiced], found[voiced] / hertz[voiced])
    changed: FloatArray = hertz * ratio
    return changed


def matched_words(known: Sequence[str], spoken: Sequence[str]) -> list[int | None]:
    """Index of the known word that each spoken one is, or is a part of; None where there is none."""
    if len(known) == len(spoken):
        return list(range(len(spoken)))
    # by letters: a voice divides words and joins them as its language does
    before, behind = ([(at, letter) for at, word in enumerate(texts) for letter in word.lower() if letter.isalnum()]
                      for texts in (known, spoken))  # fmt: skip
    found: list[int | None] = [None] * len(spoken)
    matcher = SequenceMatcher(None, [letter for _, letter in before], [letter for _, letter in behind], autojunk=False)
    for first, other, size in matcher.get_matching_blocks():
        for at in range(size):
            place = behind[other + at][0]
            found[place] = before[first + at][0] if found[place] is None else found[place]
    return found


def _placed(speech: Speech, span: WordSpan, intended: Intention, place: int | None) -> PlacedWord:
    edges = speech.phones.edges
    labels = speech.phones.phones[span.first : span.last]
    stress = intended.stresses[place] if place is not None and intended.stresses else ()
    vowels = [at for at, label in enumerate(labels) if label in PHONES and PHONES[label].is_vowel] or [0]
    strongest = [at for at in vowels if len(stress) == len(labels) and stress[at] == 1]
    vowel = span.first + (strongest or vowels)[-1]
    start, end, vowel_start, vowel_end = edges[[span.first, span.last, vowel, vowel + 1]].tolist()
    return PlacedWord(start, end, (vowel_start, vowel_end), EVEN if place is None else intended.tones[place])


def _stretch(words: Sequence[PlacedWord], duration: float, rate: float) -> Stretch:
    """Emphasised words are longer; all is faster by the rate."""
    times, factors = [0.0], [1.0]
    for word in words:
        if word.tone.emphasis and word.end - word.start > 2 * STRETCH_RAMP_S and word.start >= times[-1]:
            factor = EMPHASIS_LENGTH**word.tone.emphasis
            times += [word.start, word.start + STRETCH_RAMP_S, word.end - STRETCH_RAMP_S, word.end]
            factors += [1.0, factor, factor, 1.0]
    return Stretch(np.array([*times, duration]), np.array([*factors, 1.0]) / rate)
