"""External tracks of facial motion, mapped to speech parameters by a linear map fitted on the training utterances.

Landmark tracks of test people, read from folders of .npz files, one for each utterance.

Reference utterances from an ARKit capture: lips of the default head moved by it, phones from its sound.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import find_capture_sound
from corpus_tools.recordings.observation import Observation, Quality, trim_to_picture
from corpus_tools.recordings.sound import CachedAligner
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.evaluation.reference import ReferenceUtterance
from corpus_tools.training.linear_audio_map import fit_ridge
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from lexicon.values.tables import parse_cell, read_table
from tts2face.face.deformation import moved_landmarks
from tts2face.lips.performer import match_shapes
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import interpolate_columns
from tts2face.sound.features import intensity
from tts2face.sound.pauses import cut_at_pauses
from tts2face.video.take import read_livelink

UTTERANCE_COLUMN, TIME_COLUMN = "utterance", "time"
MIN_TRAINING_UTTERANCES = 10  # sentences from which a map is fitted


@dataclass(frozen=True, slots=True, eq=False)
class ExternalTrack:
    """Curves of one utterance: seconds (T,) on the clock of its first frame, and values (T, C)."""

    times: NDArray[np.float64]
    values: NDArray[np.float64]

    def at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, C) values at other instants, interpolated linearly and constant beyond the ends."""
        return interpolate_columns(self.values, self.times, times)


def read_tracks(path: Path) -> Mapping[str, ExternalTrack]:
    """Curves by utterance from a CSV file with the columns utterance, time (seconds), and one for each channel.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is too large, columns are missing, a value is no number, or times of an utterance do not increase.
    """
    if not path.is_file():
        raise InputError(f"there are no tracks {path}; check the path")
    rows: dict[str, list[list[float]]] = {}
    head, *lines = read_table(path) or [[]]
    if head[:2] != [UTTERANCE_COLUMN, TIME_COLUMN] or len(head) < 3:
        raise DataError(f"{path} must begin with the columns utterance, time and a channel, not {head[:3]}")
    for number, row in enumerate(lines, start=2):
        if len(row) != len(head):
            raise DataError(f"{path}, line {number}: {len(row)} columns, not {len(head)}; correct the line")
        rows.setdefault(row[0], []).append([parse_cell(value, path, number) for value in row[1:]])
    tracks = {name: np.array(values) for name, values in rows.items()}
    for name, values in tracks.items():
        if (np.diff(values[:, 0]) <= 0).any():
            raise DataError(f"{path}: the times of {name} do not increase; sort them")
    return {name: ExternalTrack(values[:, 0], values[:, 1:]) for name, values in tracks.items()}


def map_tracks(
    tracks: Mapping[str, ExternalTrack], talker: Talker, real: Sequence[ReferenceUtterance]
) -> tuple[NDArray[np.float32], ...]:
    """Speech parameters (T, S) of the held-out utterances, by a ridge regression fitted on the training ones.

    Raises
    ------
    InputError
        A held-out utterance has no track, or too few training ones have.
    """
    if missing := [one.observation.name for one in real if one.observation.name not in tracks]:
        raise InputError(f"the tracks lack {missing[0]} ({len(missing)} of {len(real)} held-out utterances); add them")
    known = [utterance for utterance in talker.utterances if utterance.name in tracks]
    if len(known) < MIN_TRAINING_UTTERANCES:
        raise InputError(
            f"the tracks hold {len(known)} training utterances; their linear map needs {MIN_TRAINING_UTTERANCES}"
        )
    n_speech = talker.model.n_speech
    terms = np.concatenate([tracks[one.name].at(np.arange(len(one.shape)) / talker.fps) for one in known])
    targets = np.concatenate([one.shape[:, :n_speech] for one in known]).astype(np.float64)
    spread = np.maximum(terms.std(axis=0), 1e-9)
    middle = targets.mean(axis=0)
    fit = fit_ridge(terms / spread, targets - middle)

    def mapped_parameters(one: ReferenceUtterance) -> NDArray[np.float32]:
        times = np.arange(len(one.parameters)) / one.observation.fps
        seen = tracks[one.observation.name].at(times) / spread
        return np.asarray(middle + (seen - fit.mean) @ fit.weights, np.float32)

    return tuple(mapped_parameters(one) for one in real)


TRACK_SUFFIX = ".npz"
SILENCE_NAMES = frozenset({"sil", "SIL", SILENCE})
ARRAYS = ("landmarks", "fps", "phones", "edges")  # required; head, words with word_first and word_last, intensity
TRACKED = Quality(fit=1.0, score=1.0, n_filled=0, cut=0.0)  # tracks carry no measures of their recording


def read_person(folder: Path) -> tuple[Observation, ...]:
    """Utterances of one person, in the order of their file names.

    Each file holds pose-free ``landmarks`` (T, 478, 3) in mm, ``fps``, ``phones`` (N,) in IPA with *sil* for silence,
    ``edges`` (N + 1,) in seconds, and optionally ``head`` (T, 6), ``intensity`` (T,), and ``words`` (W,) with
    ``word_first`` and ``word_last``.

    Raises
    ------
    InputError
        The folder does not exist or holds no tracks.
    DataError
        A file is damaged, an array is missing, or its shape does not fit.
    """
    files = sorted(folder.glob(f"*{TRACK_SUFFIX}")) if folder.is_dir() else []
    if not files:
        raise InputError(f"{folder} holds no tracks ({TRACK_SUFFIX} files); check the path")
    return tuple(_read_track(path) for path in files)


def _read_track(path: Path) -> Observation:
    arrays = _read_arrays(path)
    landmarks, edges = arrays["landmarks"], np.asarray(arrays["edges"], np.float64)
    if landmarks.ndim != 3 or landmarks.shape[1:] != (N_LANDMARKS, 3) or not np.isfinite(landmarks).all():
        raise DataError(f"{path}: landmarks must be finite numbers (T, {N_LANDMARKS}, 3), not {landmarks.shape}")
    n_frames, fps = len(landmarks), float(arrays["fps"])
    if not 0 < fps < np.inf:
        raise DataError(f"{path}: fps must be above 0, not {fps}")
    head = np.asarray(arrays.get("head", np.zeros((n_frames, 6))), np.float32)
    level = np.asarray(arrays.get("intensity", np.zeros(n_frames)), np.float32)
    if head.shape != (n_frames, 6) or level.shape != (n_frames,):
        raise DataError(f"{path}: head {head.shape} and intensity {level.shape} do not fit {n_frames} frames")
    labels = [SILENCE if label in SILENCE_NAMES else label for label in map(str, arrays["phones"])]
    if len(edges) != len(labels) + 1:
        raise DataError(f"{path}: {len(labels)} phones need {len(labels) + 1} edges, not {len(edges)}")
    try:
        phones = PhoneSequence(labels, edges)
    except ValueError as wrong:
        raise DataError(f"{path}: {wrong}") from wrong
    return Observation(
        path.stem, fps, np.asarray(landmarks, np.float32), head, phones, _read_words(arrays), level, TRACKED, path
    )


def _read_arrays(path: Path) -> Mapping[str, NDArray[Any]]:
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except (OSError, ValueError, EOFError, KeyError) as damaged:
        raise DataError(f"{path} is not a readable {TRACK_SUFFIX} file: {damaged}") from damaged
    if missing := [name for name in ARRAYS if name not in arrays]:
        raise DataError(f"{path} has no array {missing[0]}; tracks need {', '.join(ARRAYS)}")
    return arrays


def _read_words(arrays: Mapping[str, NDArray[Any]]) -> tuple[WordSpan, ...]:
    if not {"words", "word_first", "word_last"} <= arrays.keys():
        return ()
    rows = zip(arrays["words"], arrays["word_first"], arrays["word_last"], strict=True)
    return tuple(WordSpan(str(text), int(first), int(last)) for text, first, last in rows)


LIVELINK_SUFFIX = ".csv"
MAX_UTTERANCE_S = 6.0  # cut at pauses into utterances of about a sentence, which the bootstrap resamples


def observe_livelink(path: Path, run_options: RunOptions) -> tuple[Observation, ...]:
    """Utterances of a Live Link Face capture and the one sound file that lies beside it, in sync with it.

    Raises
    ------
    InputError
        There is no such capture, or no sound beside it, or several.
    DataError
        The capture or its sound cannot be read, or it contains no speech.
    BackendError
        No phone recogniser is installed.
    """
    capture = read_livelink(path)
    sound = find_capture_sound(path)
    if sound is None:
        raise InputError(f"there is no sound file beside {path.name}; put one there")
    face = load_face("head")
    motion = match_shapes(capture.weights, face)
    aligner = CachedAligner(run_options.folder())
    found = []
    for number, span in enumerate(cut_at_pauses(aligner.sound(sound), MAX_UTTERANCE_S), start=1):
        begin, end = (round(second * motion.fps) for second in span)
        landmarks = moved_landmarks(face, motion.part(begin, end))
        found.append(_build_observation(f"{path.stem}-{number:02d}", (aligner, sound), span, landmarks, motion.fps))
    return tuple(found)


def _build_observation(
    name: str,
    source: tuple[CachedAligner, Path],
    span: tuple[float, float],
    landmarks: NDArray[np.float32],
    fps: float,
) -> Observation:
    aligner, sound = source
    speech = aligner.align(sound, None, span)
    phones, words = trim_to_picture(speech, 0.0, len(landmarks) / fps)
    return Observation(
        name,
        fps,
        landmarks,
        np.zeros((len(landmarks), 6), np.float32),
        phones,
        words,
        intensity(speech.sound, np.arange(len(landmarks)) / fps),
        Quality(speech.fit, 1.0, 0, cut=span[0]),
        sound,
        is_recognised=True,
    )
