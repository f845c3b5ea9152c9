"""Drives learnt from observations and their sound: which features, how much context, how many hidden units."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.run_options import Progress, Stages, no_stages
from corpus_tools.training.linear_audio_map import Lesson, learn_linear
from corpus_tools.training.network_audio_map import NetworkOptions, learn_network
from tts2face.models.audio_map import Drive
from tts2face.models.talker import ShapeModel, Talker
from tts2face.speech.features import FEATURE_RATE, speech_features, speech_level
from tts2face.types import Waveform
from tts2face.video.media import read_sound

# Chosen by inner cross-validation on the training utterances of GRID s1 (docs/accuracy.md, "Speech-driven").
FEATURE = "mfcc+lsf"
NETWORK = NetworkOptions(n_hidden=40)
LEAST_UTTERANCES = 20  # a network sets a tenth of them aside
LEAST_FRAMES = 1000  # below, canonical correlation feigns ties (docs/accuracy.md)

Heard = Mapping[str, NDArray[np.float32]]  # features of each utterance by its name


def heard_features(
    observations: Sequence[Observation], kinds: Sequence[str], *, on_progress: Progress | None = None
) -> dict[str, Heard]:
    """For each kind of feature, the (T, D) features of every utterance on the frames of its landmarks.

    Raises
    ------
    DataError
        A recording holds no sound.
    """
    found: dict[str, dict[str, NDArray[np.float32]]] = {kind: {} for kind in kinds}
    for done, (observation, sound) in enumerate(_with_sound(observations)):
        for kind in kinds:
            found[kind][observation.name] = heard_in(observation, sound, kind)
        if on_progress:
            on_progress(done + 1, len(observations))
    return dict(found)


def heard_in(observation: Observation, sound: Waveform, kind: str) -> NDArray[np.float32]:
    """(T, D) features of the sound of a video on the frames of one utterance in it."""
    start = observation.quality.cut + observation.quality.lag
    n_frames = len(observation.landmarks)
    return speech_features(sound, kind, fps=observation.fps, n_frames=n_frames, start=start).values


def lessons_of(observations: Sequence[Observation], model: ShapeModel, heard: Heard) -> list[Lesson]:
    """What a drive learns from: features of utterances, and the speech parameters of their landmarks."""
    return [Lesson(heard[one.name], model.parameters(one.landmarks)[:, : model.n_speech]) for one in observations]


def learn_drives(
    observations: Sequence[Observation],
    talker: Talker,
    *,
    network: NetworkOptions = NETWORK,
    stages: Stages = no_stages,
) -> dict[str, Drive]:
    """The linear and the network drive of a talker; none where the recordings are too few to learn them.

    Raises
    ------
    DataError
        A recording holds no sound.
    """
    if len(observations) < LEAST_UTTERANCES or sum(len(one.landmarks) for one in observations) < LEAST_FRAMES:
        return {}
    heard = heard_features(observations, (FEATURE, "level"), on_progress=stages("listening"))
    lessons = lessons_of(observations, talker.model, heard[FEATURE])
    loudness = speech_level(np.concatenate(list(heard["level"].values())))
    told = stages("learning drives")
    linear = learn_linear(lessons, feature=FEATURE)
    told(1, 2)
    bent = learn_network(lessons, feature=FEATURE, options=network)
    told(2, 2)
    return {"linear": replace(linear, loudness=loudness), "network": replace(bent, loudness=loudness)}


def _with_sound(observations: Sequence[Observation]) -> Iterator[tuple[Observation, Waveform]]:
    """Each utterance with the sound of its video; a video with many is read once."""
    last: tuple[object, Waveform] | None = None
    for observation in sorted(observations, key=lambda one: str(one.video)):
        if last is None or last[0] != observation.video:
            last = observation.video, read_sound(observation.video, FEATURE_RATE)
        yield observation, last[1]
