"""Synthesis methods that are compared, learnt from the training part.

Evaluation with a voice's own durations, mapped to the time axis of the recordings.

A voice speaks the words of held-out utterances. Its time axis is mapped to the recorded one piecewise linearly, from
the edges of its words to those of the recorded words. Differences of tempo and pauses therefore have no effect on the
measures, whereas phones and their durations within words have. The map uses word edges only, not lip motion.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.evaluation.reference import LipCurves, ReferenceUtterance
from corpus_tools.studies.evaluation.scores import OwnDurationMotion, UtteranceComparison, speech_spread
from lexicon.errors import InputError
from lexicon.normalize import normalize
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.lips.exemplar import ExemplarModel, build_exemplar_model, speech_trajectory
from tts2face.lips.explanation import speech_frames
from tts2face.lips.options import METHOD_OPTIONS, SynthesisOptions
from tts2face.lips.tokens import build_targets
from tts2face.models.networks import PhoneNetwork
from tts2face.models.talker import ShapeModel, Talker
from tts2face.numeric.arrays import interpolate_columns
from tts2face.sound.voice import Voice
from tts2face.types import Speech, frame_count

NETWORK_METHOD = "sliding-window network"

# Speech parameters (T, D) for timed phones at T frames, learnt from the training part.
SynthesisMethod = Callable[[PhoneSequence, int, float], NDArray[np.float32]]


def build_methods(talker: Talker, options: Mapping[str, SynthesisOptions] | None = None) -> dict[str, SynthesisMethod]:
    """Baselines and exemplar methods by name; `METHOD_OPTIONS` without options."""
    voice = build_exemplar_model(talker)
    n_speech = talker.model.n_speech
    return {
        "mean face": lambda _, n_frames, __: np.zeros((n_frames, n_speech), np.float32),
        "mean phone pose": mean_pose_method(talker, voice),
        **({NETWORK_METHOD: network_method(talker.network)} if talker.network is not None else {}),
        **{name: exemplar_method(voice, chosen) for name, chosen in (options or METHOD_OPTIONS).items()},
    }


def network_method(network: PhoneNetwork) -> SynthesisMethod:
    """The first of a talker's networks alone: a plain sliding-window network."""

    def motion(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.float32]:
        return network.parameters(phones, np.arange(n_frames) / fps, slice(1))

    return motion


def exemplar_method(voice: ExemplarModel, options: SynthesisOptions) -> SynthesisMethod:
    """Synthesis from exemplars."""

    def motion(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.float32]:
        return speech_trajectory(phones, voice, fps=fps, n_frames=n_frames, options=options).values

    return motion


def mean_pose_method(talker: Talker, voice: ExemplarModel) -> SynthesisMethod:
    """Baseline: linear interpolation between the mean poses of phones, placed at their middles."""
    n_speech, inventory = talker.model.n_speech, voice.tokens.inventory
    poses: dict[str, list[NDArray[np.float64]]] = {label: [] for label in inventory}
    for utterance in talker.utterances:
        frame_times = np.arange(len(utterance.shape)) / talker.fps
        middles = (utterance.phones.edges[:-1] + utterance.phones.edges[1:]) / 2
        read = interpolate_columns(utterance.shape[:, :n_speech], frame_times, middles)
        for label, pose in zip(utterance.phones.phones, read, strict=True):
            poses[label].append(pose)
    mean = {label: np.mean(seen, axis=0) for label, seen in poses.items() if seen}

    def motion(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.float32]:
        targets = build_targets(phones, inventory)
        middles = targets.spans[:, 1:3].mean(axis=1)
        keys = np.stack([mean[label] for label in targets.labels])
        times = np.arange(n_frames) / fps
        return interpolate_columns(keys[:, :n_speech], middles, times).astype(np.float32)

    return motion


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
    voiced = tuple(_speak_reference(voice, one) for one in real)
    if all(one is None for one in voiced):
        raise InputError("own durations need recordings whose words are known; add transcripts")
    return voiced


def _speak_reference(voice: Voice, one: ReferenceUtterance) -> VoicedUtterance | None:
    words = one.observation.words
    if not words or one.observation.is_recognised:
        return None
    speech = voice.speak(normalize(" ".join(word.text for word in words)))
    if len(speech.words) != len(words):
        return None
    return map_word_times(speech, one.observation.phones, words, one.observation.fps)


def map_word_times(speech: Speech, phones: PhoneSequence, words: Sequence[WordSpan], fps: float) -> VoicedUtterance:
    """One utterance spoken by the voice, with the map of its word edges to those of the recording."""
    synthesised, real = _word_edges(speech.phones, speech.words), _word_edges(phones, words)
    outside = np.array([-EXTRAPOLATION_S, EXTRAPOLATION_S])
    synthesised, real = (
        np.concatenate([each[:1] + outside[:1], each, each[-1:] + outside[1:]]) for each in (synthesised, real)
    )
    return VoicedUtterance(speech.phones, frame_count(speech.waveform.duration, fps), synthesised, real)


def _word_edges(phones: PhoneSequence, words: Sequence[WordSpan]) -> NDArray[np.float64]:
    """(2 W,) strictly increasing seconds at which words begin and end."""
    begins = np.array([phones.edges[word.first] for word in words])
    ends = np.array([phones.edges[word.last] for word in words])
    ends[:-1] = np.minimum(ends[:-1], begins[1:] - MIN_WORD_GAP_S)
    return np.stack([begins, ends], axis=1).ravel()


def compare_own_durations(
    method: SynthesisMethod, one: ReferenceUtterance, voiced: VoicedUtterance, model: ShapeModel
) -> UtteranceComparison:
    """Comparison of a method's motion for the voice's phones with the real utterance."""
    fps, n_fine = one.observation.fps, OVERSAMPLING * (voiced.n_frames - 1) + 1
    synthesised = method(voiced.phones, n_fine, OVERSAMPLING * fps)
    wanted = voiced.times(np.arange(len(one.parameters)) / fps)
    there = interpolate_columns(synthesised, np.arange(n_fine) / (OVERSAMPLING * fps), wanted).astype(np.float32)
    ours = synthesised[::OVERSAMPLING]
    own = OwnDurationMotion(
        voiced.phones, speech_frames(voiced.phones, voiced.n_frames, fps), ours, LipCurves.of(model.shapes(ours))
    )
    return UtteranceComparison(one, there, LipCurves.of(model.shapes(there)), speech_spread(model), own)
