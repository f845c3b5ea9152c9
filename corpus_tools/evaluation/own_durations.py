"""The words of held-out utterances in a voice of our own, with its own durations, brought onto the real clock.

The voice says the words in its own time. To be laid beside the real lips its clock is put onto theirs word by word:
the beginning and the end of each word fall on those of the real one, time runs evenly between. So tempo and pauses, in
which no two speakers agree, count for nothing; how the time of a word is shared among its phones, and which phones
those are, counts in full. The map knows words' edges only and never looks at lips.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.evaluation.measures import speech_frames
from corpus_tools.evaluation.methods import SynthesisMethod
from corpus_tools.evaluation.reference import LipCurves, ReferenceUtterance
from corpus_tools.evaluation.scores import OwnDurationMotion, UtteranceComparison, speech_spread
from lexicon.errors import InputError
from lexicon.normalize import normalize
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.models.talker import ShapeModel
from tts2face.types import Speech, frame_count
from tts2face.voice.engine import Voice

OVERSAMPLING = (
    4  # instants a frame at which motion is made before it is read between frames: lines across 10 ms cut no peak
)
MIN_WORD_GAP_S = 1e-6  # a word ends this long before the next begins, where the real one pauses less than that
EXTRAPOLATION_S = 60.0  # outside the words time runs evenly, this far


@dataclass(frozen=True, slots=True, eq=False)
class VoicedUtterance:
    """One utterance in a voice's own time: phones, frames of the sound, and where its words lie on both clocks.

    ``ours`` and ``real`` (K,) are the same instants, in seconds of the voice's clock and of the real one.
    """

    phones: PhoneSequence
    n_frames: int
    voice_s: NDArray[np.float64]
    real: NDArray[np.float64]

    def times(self, real: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds of the voice's clock for seconds of the real one."""
        return np.interp(real, self.real, self.voice_s)


def speak_references(voice: Voice, real: Sequence[ReferenceUtterance]) -> tuple[VoicedUtterance | None, ...]:
    """Utterances as a voice says them; None for those without words, and where it counts other words.

    Raises
    ------
    InputError
        None is left.
    """
    said = tuple(_speak_reference(voice, one) for one in real)
    if all(one is None for one in said):
        raise InputError("own durations need recordings whose words are known; add transcripts")
    return said


def _speak_reference(voice: Voice, one: ReferenceUtterance) -> VoicedUtterance | None:
    words = one.observation.words
    if not words or one.observation.is_recognised:
        return None
    speech = voice.speak(normalize(" ".join(word.text for word in words)))
    if len(speech.words) != len(words):
        return None
    return map_word_times(speech, one.observation.phones, words, one.observation.fps)


def map_word_times(speech: Speech, phones: PhoneSequence, words: Sequence[WordSpan], fps: float) -> VoicedUtterance:
    """Speech, and where its words lie among those of a recording."""
    ours, real = _word_edges(speech.phones, speech.words), _word_edges(phones, words)
    outside = np.array([-EXTRAPOLATION_S, EXTRAPOLATION_S])
    ours, real = (np.concatenate([each[:1] + outside[:1], each, each[-1:] + outside[1:]]) for each in (ours, real))
    return VoicedUtterance(speech.phones, frame_count(speech.waveform.duration, fps), ours, real)


def _word_edges(phones: PhoneSequence, words: Sequence[WordSpan]) -> NDArray[np.float64]:
    """(2 W,) seconds at which words begin and end, always rising."""
    begins = np.array([phones.edges[word.first] for word in words])
    ends = np.array([phones.edges[word.last] for word in words])
    ends[:-1] = np.minimum(ends[:-1], begins[1:] - MIN_WORD_GAP_S)
    return np.stack([begins, ends], axis=1).ravel()


def compare_own_durations(
    method: SynthesisMethod, one: ReferenceUtterance, said: VoicedUtterance, model: ShapeModel
) -> UtteranceComparison:
    """What a method makes of the voice's phones, beside the real utterance."""
    fps, n_fine = one.observation.fps, OVERSAMPLING * (said.n_frames - 1) + 1
    made = method(said.phones, n_fine, OVERSAMPLING * fps)
    wanted = said.times(np.arange(len(one.parameters)) / fps)
    columns = [np.interp(wanted, np.arange(n_fine) / (OVERSAMPLING * fps), column) for column in made.T]
    there, ours = np.stack(columns, axis=1).astype(np.float32), made[::OVERSAMPLING]
    own = OwnDurationMotion(
        said.phones, speech_frames(said.phones, said.n_frames, fps), ours, LipCurves.of(model.shapes(ours))
    )
    return UtteranceComparison(one, there, LipCurves.of(model.shapes(there)), speech_spread(model), own)
