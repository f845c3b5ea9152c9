"""Training of audio maps from observations: features, context and hidden units."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.training.linear_audio_map import (
    TrainingUtterance,
    learn_linear_map,
)
from corpus_tools.training.network_audio_map import NetworkMapOptions, learn_network_map
from tts2face.models.audio_map import AudioMap
from tts2face.models.talker import ShapeModel, Talker
from tts2face.sound.features import FEATURE_RATE, speech_features
from tts2face.sound.pauses import speech_level
from tts2face.types import Progress, StageCallback, Waveform, ignore_progress, ignore_stage
from tts2face.video.media import read_sound

# Chosen by inner cross-validation on the training utterances of GRID s1 (docs/accuracy.md, "Speech-driven").
AUDIO_MAP_FEATURES = "mfcc+lsf"
TALKER_NETWORK_OPTIONS = NetworkMapOptions(n_hidden=40)
MIN_UTTERANCES = 20  # a tenth of them is the validation set
MIN_FRAMES = 1000  # with fewer, canonical correlations are spurious (docs/accuracy.md)
UtteranceFeatures = Mapping[str, NDArray[np.float32]]  # features of each utterance by its name


def sound_features(
    observations: Sequence[Observation], kinds: Sequence[str], *, on_progress: Progress = ignore_progress
) -> dict[str, UtteranceFeatures]:
    """For each kind of feature, the (T, D) features of every utterance on the frames of its landmarks."""
    found: dict[str, dict[str, NDArray[np.float32]]] = {kind: {} for kind in kinds}
    for done, (observation, sound) in enumerate(_read_sounds(observations)):
        for kind in kinds:
            found[kind][observation.name] = utterance_features(observation, sound, kind)
        on_progress(done + 1, len(observations))
    return dict(found)


def utterance_features(observation: Observation, sound: Waveform, kind: str) -> NDArray[np.float32]:
    """(T, D) features of the sound of a video on the frames of one utterance in it."""
    start = observation.quality.cut + observation.quality.lag
    n_frames = len(observation.landmarks)
    return speech_features(sound, kind, fps=observation.fps, n_frames=n_frames, start=start).values


def build_training_utterances(
    observations: Sequence[Observation], model: ShapeModel, features: UtteranceFeatures
) -> list[TrainingUtterance]:
    """Training utterances: features of the sound and speech parameters of the landmarks."""
    return [
        TrainingUtterance(features[observation.name], model.parameters(observation.landmarks)[:, : model.n_speech])
        for observation in observations
    ]


def learn_audio_maps(
    observations: Sequence[Observation],
    talker: Talker,
    *,
    network: NetworkMapOptions = TALKER_NETWORK_OPTIONS,
    stages: StageCallback = ignore_stage,
) -> dict[str, AudioMap]:
    """The linear and the network audio map of a talker; empty if there are too few recordings.

    Raises
    ------
    DataError
        A recording holds no sound.
    """
    if (
        len(observations) < MIN_UTTERANCES
        or sum(len(observation.landmarks) for observation in observations) < MIN_FRAMES
    ):
        return {}
    features = sound_features(
        observations, (AUDIO_MAP_FEATURES, "level"), on_progress=stages("computing sound features")
    )
    utterances = build_training_utterances(observations, talker.model, features[AUDIO_MAP_FEATURES])
    loudness = speech_level(np.concatenate(list(features["level"].values())), 1.0 / talker.fps, is_recording=True)
    on_map = stages("learning audio maps")
    linear = learn_linear_map(utterances, feature=AUDIO_MAP_FEATURES)
    on_map(1, 2)
    nonlinear = learn_network_map(utterances, feature=AUDIO_MAP_FEATURES, options=network)
    on_map(2, 2)
    maps = {"linear": linear, "network": nonlinear}
    return {name: replace(each_map, loudness=loudness, fps=talker.fps) for name, each_map in maps.items()}


def _read_sounds(observations: Sequence[Observation]) -> Iterator[tuple[Observation, Waveform]]:
    """Each utterance with the sound of its video; each video is read once."""
    last: tuple[object, Waveform] | None = None
    # by video: the sound of one is read once
    for observation in sorted(observations, key=lambda recorded: str(recorded.video)):
        if last is None or last[0] != observation.video:
            last = observation.video, read_sound(observation.video, FEATURE_RATE)
        yield observation, last[1]
