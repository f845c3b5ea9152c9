"""Evaluation with a voice's own durations, mapped to the time axis of the recordings.

A voice speaks the words of held-out utterances. Its time axis is mapped to the recorded one piecewise linearly, from
the edges of its words to those of the recorded words. Differences of tempo and pauses therefore have no effect on the
measures, whereas phones and their durations within words have. The map uses word edges only, not lip motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.methods import SynthesisMethod
from corpus_tools.measures.reference import LipCurves, ReferenceUtterance
from corpus_tools.measures.scores import OwnDurationMotion, UtteranceComparison, speech_spread
from lexicon.errors import InputError
from lexicon.normalize import normalize
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.lips.motion_measures import speech_frames
from tts2face.models.talker import ShapeModel
from tts2face.numeric.arrays import interpolate_columns
from tts2face.sound.voice import Voice
from tts2face.types import Speech, frame_count

OVERSAMPLING = 4  # instants per frame at which motion is synthesised before linear interpolation: 10 ms preserve peaks
MIN_WORD_GAP_S = 1e-6  # minimum pause between words
EXTRAPOLATION_S = 60.0  # the map is extrapolated linearly this far outside the words


@dataclass(frozen=True, slots=True, eq=False)
class VoicedUtterance:
    """One utterance of a voice with its own durations: phones, number of frames, and word edges on both time axes.

    ``voice_s`` and ``real`` (K,) are corresponding instants in seconds of the voice and of the recording.
    """

    phones: PhoneSequence
    n_frames: int
    voice_s: NDArray[np.float64]
    real: NDArray[np.float64]

    def times(self, real: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds of the voice for seconds of the recording."""
        return np.interp(real, self.real, self.voice_s)


def speak_references(voice: Voice, real: Sequence[ReferenceUtterance]) -> tuple[VoicedUtterance | None, ...]:
    """Utterances spoken by a voice; None for those without words or with another number of words.

    Raises
    ------
    InputError
        No utterance remains.
    """
    voiced = tuple(_speak_reference(voice, reference) for reference in real)
    if all(item is None for item in voiced):
        raise InputError("own durations need recordings whose words are known; add transcripts")
    return voiced


def _speak_reference(voice: Voice, reference: ReferenceUtterance) -> VoicedUtterance | None:
    words = reference.observation.words
    if not words or reference.observation.is_recognised:
        return None
    speech = voice.speak(normalize(" ".join(word.text for word in words)))
    if len(speech.words) != len(words):
        return None
    return map_word_times(speech, reference.observation.phones, words, reference.observation.fps)


def map_word_times(speech: Speech, phones: PhoneSequence, words: Sequence[WordSpan], fps: float) -> VoicedUtterance:
    """One utterance spoken by the voice, with the map of its word edges to those of the recording."""
    synthesised, real = _word_edges(speech.phones, speech.words), _word_edges(phones, words)
    outside = np.array([-EXTRAPOLATION_S, EXTRAPOLATION_S])
    synthesised, real = (
        np.concatenate([each[:1] + outside[:1], each, each[-1:] + outside[1:]]) for each in (synthesised, real)
    )
    return VoicedUtterance(speech.phones, frame_count(speech.waveform.duration, fps), synthesised, real)


def _word_edges(phones: PhoneSequence, words: Sequence[WordSpan]) -> NDArray[np.float64]:
    """(2 W,) strictly increasing seconds: start and end of each word."""
    starts = np.array([phones.edges[word.first] for word in words])
    ends = np.array([phones.edges[word.last] for word in words])
    ends[:-1] = np.minimum(ends[:-1], starts[1:] - MIN_WORD_GAP_S)
    return np.stack([starts, ends], axis=1).ravel()


def compare_own_durations(
    method: SynthesisMethod, real: ReferenceUtterance, voiced: VoicedUtterance, model: ShapeModel
) -> UtteranceComparison:
    """Comparison of a method's motion for the voice's phones with the real utterance."""
    fps, n_fine = real.observation.fps, OVERSAMPLING * (voiced.n_frames - 1) + 1
    synthesised = method(voiced.phones, n_fine, OVERSAMPLING * fps)
    wanted = voiced.times(np.arange(len(real.parameters)) / fps)
    there = interpolate_columns(synthesised, np.arange(n_fine) / (OVERSAMPLING * fps), wanted).astype(np.float32)
    ours = synthesised[::OVERSAMPLING]
    own = OwnDurationMotion(
        voiced.phones, speech_frames(voiced.phones, voiced.n_frames, fps), ours, LipCurves.of(model.shapes(ours))
    )
    return UtteranceComparison(real, there, LipCurves.of(model.shapes(there)), speech_spread(model), own)
