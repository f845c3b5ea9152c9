"""The audio map of any voice: a network that has learnt what lips a talker has for the phones of damaged speech.

Its sounds are those of `shipped.training.spoken_material`, as other people, rooms, microphones and lines would
have them; its lips are those that the talker makes for their phones. Widths, depths and rates were chosen on a voice
that was not learnt (docs/decisions/195-live-voices.md).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corpus_tools.shipped.training.damage import damaged_copies
from corpus_tools.shipped.training.epochs import fit_epochs
from corpus_tools.shipped.training.spoken_material import KnownSpeech, spoken_material
from corpus_tools.training.linear_audio_map import standardised_windows
from tts2face.lips.exemplar import build_exemplar_model, speech_trajectory
from tts2face.models.audio_map import AudioMap
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import Float32Array
from tts2face.sound.alignment import Aligner
from tts2face.sound.features import speech_features
from tts2face.types import Progress, Waveform

NAME, FEATURE = "voices", "mel"
BEFORE, AFTER = 10, 5  # frames of 40 ms; with the window of a frame, lips are known 0.24 s after their sound
N_UNITS, N_EPOCHS, BATCH = (256, 128), 8, 512
LEARNING_RATES = (1.5e-3, 5e-5)  # in the first and the last epoch
WEIGHT_DECAY, LEAST_SPREAD = 1e-3, 0.05
SPREAD_EXPONENT = 0.5  # as `corpus_tools.training.network_audio_map.NetworkMapOptions` has it
N_DAMAGED = 8  # times that each sound is learnt
GAINS_DB = (-18.0, 6.0)
TEST_SHARE = 20  # every twentieth sound measures the error


@dataclass(frozen=True, slots=True, eq=False)
class _Lesson:
    """Features (T, D) of damaged speech and the lips (T, S) of its phones."""

    features: Float32Array
    lips: Float32Array
    is_test: bool


def learn_voices_map(
    talker: Talker, recordings: Path, *, on_progress: Progress, report: Callable[[str], None]
) -> AudioMap:
    """Audio map of a talker for any voice; `report` receives its correlation on sounds that it has not learnt.

    Parameters
    ----------
    recordings
        As for `corpus_tools.shipped.training.spoken_material.spoken_material`.
    """
    rng, aligner = np.random.default_rng(0), Aligner()
    known, others = spoken_material(recordings, rng)
    for other in others:
        if phones := other.align(aligner):
            known.append(KnownSpeech(other.sound, phones))
    lessons = _lessons(talker, known, rng, on_progress)
    audio_map = replace(_fit([lesson for lesson in lessons if not lesson.is_test]), fps=talker.fps)
    tests = [lesson for lesson in lessons if lesson.is_test]
    made = np.concatenate([audio_map.parameters(test.features) for test in tests])
    real = np.concatenate([test.lips for test in tests])
    first = np.corrcoef(made[:, 0], real[:, 0])[0, 1]
    report(f"{len(lessons)} sounds; r of the first parameter of lips of others {first:.3f}")
    return audio_map


def _lessons(
    talker: Talker, known: Sequence[KnownSpeech], rng: np.random.Generator, on_progress: Progress
) -> list[_Lesson]:
    """Each sound several times, damaged in several ways and at several levels."""
    model, sounds, found = build_exemplar_model(talker), [recording.sound for recording in known], []
    for at, (number, damaged) in enumerate(damaged_copies(sounds, N_DAMAGED, rng)):
        gain = 10.0 ** (float(rng.uniform(*GAINS_DB)) / 20.0)
        sound = Waveform(np.clip(damaged.sound.samples * np.float32(gain), -1.0, 1.0), damaged.sound.rate)
        n_frames = int(sound.duration * talker.fps)
        phones = damaged.phones(known[number].phones)
        lips = speech_trajectory(phones, model, fps=talker.fps, n_frames=n_frames).values
        features = speech_features(sound, FEATURE, fps=talker.fps, n_frames=n_frames).values
        found.append(_Lesson(features, lips, number % TEST_SHARE == 0))
        on_progress(at + 1, N_DAMAGED * len(known))
    return found


def _fit(lessons: Sequence[_Lesson]) -> AudioMap:
    from sklearn.neural_network import MLPRegressor

    features, lips = (np.concatenate([getattr(lesson, part) for lesson in lessons]) for part in ("features", "lips"))
    mean, spread = features.mean(axis=0), np.maximum(features.std(axis=0), LEAST_SPREAD)
    centre, range_of_motion = lips.mean(axis=0), np.maximum(lips.std(axis=0), 1e-6)
    weight = range_of_motion**SPREAD_EXPONENT / np.sqrt(np.mean(range_of_motion ** (2 * SPREAD_EXPONENT)))
    inputs = np.concatenate(
        [standardised_windows(lesson.features, (mean, spread), BEFORE, AFTER) for lesson in lessons]
    )
    targets = ((lips - centre) / range_of_motion * weight).astype(np.float32)
    model = MLPRegressor(hidden_layer_sizes=N_UNITS, batch_size=BATCH, alpha=WEIGHT_DECAY)
    fit_epochs(model, inputs, targets, LEARNING_RATES, N_EPOCHS)
    back = range_of_motion / weight
    weights = [*model.coefs_[:-1], model.coefs_[-1] * back]
    biases = [*model.intercepts_[:-1], model.intercepts_[-1] * back + centre]
    return AudioMap(
        FEATURE,
        BEFORE,
        AFTER,
        mean.astype(np.float32),
        spread.astype(np.float32),
        tuple(layer.T.astype(np.float32) for layer in weights),
        tuple(bias.astype(np.float32) for bias in biases),
        "rectified",
    )
