"""External tracks of facial motion, mapped to speech parameters by a linear map fitted on training utterances."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.reference import ReferenceUtterance
from corpus_tools.training.ridge import fit_ridge
from lexicon.errors import DataError, InputError
from lexicon.values.tables import parse_cell, read_table
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import interpolate_columns

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
    """Speech parameters (T, S) of the held-out utterances, by a ridge regression fitted on the training ones."""
    if missing := [reference.observation.name for reference in real if reference.observation.name not in tracks]:
        raise InputError(f"the tracks lack {missing[0]} ({len(missing)} of {len(real)} held-out utterances); add them")
    known = [utterance for utterance in talker.utterances if utterance.name in tracks]
    if len(known) < MIN_TRAINING_UTTERANCES:
        raise InputError(
            f"the tracks hold {len(known)} training utterances; their linear map needs {MIN_TRAINING_UTTERANCES}"
        )
    n_speech = talker.model.n_speech
    terms = np.concatenate(
        [tracks[recording.name].at(np.arange(len(recording.shape)) / talker.fps) for recording in known]
    )
    targets = np.concatenate([recording.shape[:, :n_speech] for recording in known]).astype(np.float64)
    # a channel that is constant in training has no spread to divide by
    spread = np.maximum(terms.std(axis=0), 1e-9)
    middle = targets.mean(axis=0)
    fit = fit_ridge(terms / spread, targets - middle)

    def mapped_parameters(utterance: ReferenceUtterance) -> NDArray[np.float32]:
        times = np.arange(len(utterance.parameters)) / utterance.observation.fps
        seen = tracks[utterance.observation.name].at(times) / spread
        return np.asarray(middle + (seen - fit.mean) @ fit.weights, np.float32)

    return tuple(mapped_parameters(reference) for reference in real)
