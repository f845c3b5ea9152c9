"""Landmark tracks of test people, read from folders of .npz files, one for each utterance."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import TRACK_SUFFIX, Observation, Quality
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.models.landmarks import N_LANDMARKS

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
