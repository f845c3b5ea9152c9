"""Landmark tracks of a speaker without sound: 68 points of dlib, and phones whose times are approximate."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.pooling.lip_features import track_features
from lexicon.dictionary import cmudict_lookup
from lexicon.errors import DataError, InputError
from lexicon.phones import arpabet_to_ipa
from lexicon.sequence import SILENCE
from lexicon.values.tables import parse_cell

N_POINTS = 68
PHONE_COLUMNS = ["start_s", "end_s", "phone", "word"]
ARPABET_SILENCE = "SIL"
# ARPABET names without a stress digit do not tell reduced vowels from full ones.
UNREDUCED = {arpabet_to_ipa("AH0"): arpabet_to_ipa("AH"), arpabet_to_ipa("ER0"): arpabet_to_ipa("ER")}
MAX_VARIANTS = 9  # pronunciations of a word in CMUdict; the most has 5


@dataclass(frozen=True, slots=True, eq=False)
class SpokenPhone:
    """A phone of a text: label, and the approximate time of its end in seconds; optional if it may be skipped."""

    label: str
    end: float
    is_optional: bool


@dataclass(frozen=True, slots=True, eq=False)
class LipTrack:
    """Lip features (T, 8) of one recording, and its phones with an optional silence after every word."""

    name: str
    fps: float
    features: NDArray[np.float64]
    phones: tuple[SpokenPhone, ...]


def read_lip_tracks(folder: Path) -> tuple[LipTrack, ...]:
    """Tracks of a folder: ``NAME.npz`` (points (T, 68, 2) in pixels, fps) with ``NAME.phones.tsv`` beside it.

    Raises
    ------
    InputError
        There is no such folder, or it holds no tracks.
    DataError
        A file is damaged, or a phone is unknown.
    """
    files = sorted(folder.glob("*.npz")) if folder.is_dir() else []
    if not files:
        raise InputError(f"{folder} holds no lip tracks (.npz); check the path")
    return tuple(_read_track(path) for path in files)


def _read_track(path: Path) -> LipTrack:
    try:
        with np.load(path, allow_pickle=False) as stored:
            points, fps = stored["points"], float(stored["fps"])
    except (OSError, ValueError, EOFError, KeyError) as damaged:
        raise DataError(f"{path} holds no points and fps: {damaged}") from damaged
    if points.ndim != 3 or points.shape[1:] != (N_POINTS, 2) or not fps > 0:
        raise DataError(f"{path}: points must be (T, {N_POINTS}, 2) and fps above 0, not {points.shape} and {fps}")
    table = path.with_name(f"{path.stem}.phones.tsv")
    if not table.is_file():
        raise DataError(f"{path} has no phones; add {table.name}")
    head, *rows = [line.split("\t") for line in table.read_text(encoding="utf-8").splitlines()] or [[]]
    if head != PHONE_COLUMNS:
        raise DataError(f"{table} must have the columns {', '.join(PHONE_COLUMNS)}, not {', '.join(head)}")
    features = track_features(points, fps)
    return LipTrack(path.stem, fps, features, _spoken_phones(table, rows, len(points) / fps))


def _spoken_phones(table: Path, rows: Sequence[Sequence[str]], length_s: float) -> tuple[SpokenPhone, ...]:
    """The phones of the text: silence, then words, each followed by an optional silence."""
    found: list[SpokenPhone] = []
    for word, spoken in _group_words(table, rows):
        found.append(SpokenPhone(SILENCE, spoken[0][1], bool(found)))
        labels = _reduced_vowels(word, tuple(label for label, _, _ in spoken))
        found += [SpokenPhone(label, end, is_optional=False) for label, (_, _, end) in zip(labels, spoken, strict=True)]
    if not found:
        raise DataError(f"{table} holds no phones; add them")
    return (*found, SpokenPhone(SILENCE, length_s, is_optional=False))


def _group_words(table: Path, rows: Sequence[Sequence[str]]) -> list[tuple[str, list[tuple[str, float, float]]]]:
    """Words in order, each with the label, start and end of its phones."""
    words: list[tuple[str, list[tuple[str, float, float]]]] = []
    is_begun = False
    for number, row in enumerate(rows, start=2):
        if len(row) != len(PHONE_COLUMNS):
            raise DataError(f"{table}, line {number}: {len(row)} columns, not {len(PHONE_COLUMNS)}; correct the line")
        start, end = (parse_cell(cell, table, number, "seconds") for cell in row[:2])
        if row[2] == ARPABET_SILENCE:
            is_begun = False
            continue
        if not is_begun or row[3] != words[-1][0]:
            words.append((row[3], []))
        is_begun = True
        words[-1][1].append((_phone(table, number, row[2]), start, end))
    return words


def _reduced_vowels(word: str, phones: tuple[str, ...]) -> tuple[str, ...]:
    """The phones of a word with its unstressed vowels as such: the tracks carry no stress, CMUdict does."""
    key = "".join(letter for letter in word if letter.isalpha() or letter == "'")
    merged = tuple(UNREDUCED.get(label, label) for label in phones)
    for number in range(1, MAX_VARIANTS):
        variant = cmudict_lookup(key if number == 1 else f"{key}({number})")
        if variant is None:
            break
        labels = tuple(segment.phone for segment in variant)
        if tuple(UNREDUCED.get(label, label) for label in labels) == merged:
            return labels
    return phones


def _phone(table: Path, line: int, name: str) -> str:
    try:
        return arpabet_to_ipa(name)
    except InputError as unknown:
        raise DataError(f"{table}, line {line}: {unknown}") from unknown
