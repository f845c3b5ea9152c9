"""Synthesis methods that are compared, learnt from the training part."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import PhoneSequence
from tts2face.lips.exemplar import ExemplarModel, build_exemplar_model, speech_trajectory
from tts2face.lips.options import METHOD_OPTIONS, SynthesisOptions
from tts2face.lips.targets import build_targets
from tts2face.models.phone_network import PhoneNetwork
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import interpolate_columns

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
