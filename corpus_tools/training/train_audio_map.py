"""Drives learnt from observations and their sound: which features, how much context, how many hidden units."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.run_options import Progress, StageCallback, ignore_stage
from corpus_tools.training.linear_audio_map import TrainingUtterance, learn_linear_map
from corpus_tools.training.network_audio_map import NetworkMapOptions, learn_network_map
from tts2face.models.audio_map import AudioMap
from tts2face.models.talker import ShapeModel, Talker
from tts2face.speech.features import FEATURE_RATE, speech_features, speech_level
from tts2face.types import Waveform
from tts2face.video.media import read_sound

# Chosen by inner cross-validation on the training utterances of GRID s1 (docs/accuracy.md, "Speech-driven").
AUDIO_MAP_FEATURES = "mfcc+lsf"
TALKER_NETWORK_OPTIONS = NetworkMapOptions(n_hidden=40)
MIN_UTTERANCES = 20  # a network sets a tenth of them aside
MIN_FRAMES = 1000  # below, canonical correlation feigns ties (docs/accuracy.md)

UtteranceFeatures = Mapping[str, NDArray[np.float32]]  # features of each utterance by its name


def sound_features(
    observations: Sequence[Observation], kinds: Sequence[str], *, on_progress: Progress | None = None
) -> dict[str, UtteranceFeatures]:
    """For each kind of feature, the (T, D) features of every utterance on the frames of its landmarks.

    Raises
    ------
    DataError
        A recording holds no sound.
    """
    found: dict[str, dict[str, NDArray[np.float32]]] = {kind: {} for kind in kinds}
    for done, (observation, sound) in enumerate(_read_sounds(observations)):
        for kind in kinds:
            found[kind][observation.name] = utterance_features(observation, sound, kind)
        if on_progress:
            on_progress(done + 1, len(observations))
    return dict(found)


def utterance_features(observation: Observation, sound: Waveform, kind: str) -> NDArray[np.float32]:
    """(T, D) features of the sound of a video on the frames of one utterance in it."""
    start = observation.quality.cut + observation.quality.lag
    n_frames = len(observation.landmarks)
    return speech_features(sound, kind, fps=observation.fps, n_frames=n_frames, start=start).values


def build_training_utterances(
    observations: Sequence[Observation], model: ShapeModel, heard: UtteranceFeatures
) -> list[TrainingUtterance]:
    """What a drive learns from: features of utterances, and the speech parameters of their landmarks."""
    return [
        TrainingUtterance(heard[one.name], model.parameters(one.landmarks)[:, : model.n_speech]) for one in observations
    ]


def learn_audio_maps(
    observations: Sequence[Observation],
    talker: Talker,
    *,
    network: NetworkMapOptions = TALKER_NETWORK_OPTIONS,
    stages: StageCallback = ignore_stage,
) -> dict[str, AudioMap]:
    """The linear and the network drive of a talker; none where the recordings are too few to learn them.

    Raises
    ------
    DataError
        A recording holds no sound.
    """
    if len(observations) < MIN_UTTERANCES or sum(len(one.landmarks) for one in observations) < MIN_FRAMES:
        return {}
    heard = sound_features(observations, (AUDIO_MAP_FEATURES, "level"), on_progress=stages("listening"))
    lessons = build_training_utterances(observations, talker.model, heard[AUDIO_MAP_FEATURES])
    loudness = speech_level(np.concatenate(list(heard["level"].values())))
    told = stages("learning drives")
    linear = learn_linear_map(lessons, feature=AUDIO_MAP_FEATURES)
    told(1, 2)
    bent = learn_network_map(lessons, feature=AUDIO_MAP_FEATURES, options=network)
    told(2, 2)
    return {"linear": replace(linear, loudness=loudness), "network": replace(bent, loudness=loudness)}


def _read_sounds(observations: Sequence[Observation]) -> Iterator[tuple[Observation, Waveform]]:
    """Each utterance with the sound of its video; a video with many is read once."""
    last: tuple[object, Waveform] | None = None
    for observation in sorted(observations, key=lambda one: str(one.video)):
        if last is None or last[0] != observation.video:
            last = observation.video, read_sound(observation.video, FEATURE_RATE)
        yield observation, last[1]
