"""Landmark tracks of a speaker without sound: 68 points of dlib, and phones whose times are approximate.

Lip features that two landmark schemes share: 478 landmarks in mm, and the 68 of dlib in pixels.

Distances are divided by that of the outer eye corners; y points down.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.linear_audio_map import fit_ridge
from lexicon.dictionary import cmudict_lookup
from lexicon.errors import DataError, InputError
from lexicon.phones import arpabet_to_ipa
from lexicon.sequence import SILENCE
from lexicon.values.tables import parse_cell
from tts2face.models.landmarks import CHIN, EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.models.talker import ShapeModel

FEATURES = (
    "opening", "width", "lip height", "chin", "upper lip", "lower lip", "inner width", "corner height",
)  # fmt: skip
LANDMARKS = (0, 13, 14, 17, 61, 78, 82, 87, 291, 308, 312, 317, CHIN)  # that `landmark_features` reads
DRIFT_S = 8.0  # slower changes are posture and camera, not speech
DRIFT_SIGMA = 0.4  # standard deviation of the Gaussian of the drift, of `DRIFT_S`
EYE_SIGMA_S = 0.4  # smoothing of the eye distance: dlib's landmarks jitter by 1.3 px
ROLL_SIGMA_S = 0.04  # of the roll of the head
POSE_SIGMA_S = 0.12  # of the terms of the head pose
JITTER_SIGMA_S = 0.024  # of the features, against the same jitter; lips move below 8 Hz in these recordings
Floats = NDArray[np.float64]


def landmark_features(landmarks: NDArray[np.floating], neutral: NDArray[np.floating]) -> Floats:
    """(T, 8) `FEATURES` of pose-free landmarks (T, 478, 3); heights are relative to the head, not to the nose.

    ``neutral`` (478, 3) gives the distance of the eyes.
    """
    eyes = float(np.sqrt(np.square(neutral[EYE_OUTER_RIGHT] - neutral[EYE_OUTER_LEFT], dtype=np.float64).sum()))
    y = -landmarks[..., 1].astype(np.float64) / eyes

    def distance(one: int, other: int) -> Floats:
        return np.asarray(np.linalg.norm(landmarks[:, one] - landmarks[:, other], axis=1) / eyes, np.float64)

    opening = (y[:, 14] - y[:, 13] + y[:, 87] - y[:, 82] + y[:, 317] - y[:, 312]) / 3
    corners = (y[:, 61] + y[:, 291]) / 2
    columns = (
        opening, distance(61, 291), y[:, 17] - y[:, 0], y[:, CHIN], y[:, 0], y[:, 17], distance(78, 308), corners,
    )  # fmt: skip
    return np.stack(columns, axis=1)


def parameter_features(parameters: NDArray[np.floating], model: ShapeModel) -> Floats:
    """(T, 8) `FEATURES` of shape parameters (T, m) of the first m modes of a model.

    Summed mode by mode instead of with BLAS, so that networks learnt from them have the same bytes with any number of
    threads.
    """
    seen = list(LANDMARKS)
    points = np.zeros((len(parameters), *model.mean.shape))
    points[:, seen] = model.mean[seen]
    for values, mode in zip(parameters.T.astype(np.float64), model.basis, strict=False):
        points[:, seen] += values[:, None, None] * mode[seen]
    return landmark_features(points, model.mean)


def track_features(points: NDArray[np.floating], fps: float) -> Floats:
    """(T, 8) `FEATURES` of dlib's points (T, 68, 2) without roll, head pose, jitter and slow drift; means are about 0.

    Head pose is removed by a regression on the positions of nose, cheeks and eyes, which speech hardly moves.
    """
    placed, eyes = _upright_points(points.astype(np.float64), fps)
    nose, chin = placed[:, 33], placed[:, 7:10].mean(axis=1)
    opening = sum((placed[:, low] - placed[:, up])[:, 1] for up, low in ((61, 67), (62, 66), (63, 65))) / 3
    upper, lower = (placed[:, 51] - nose)[:, 1], (placed[:, 57] - nose)[:, 1]
    corners = ((placed[:, 48] + placed[:, 54]) / 2 - nose)[:, 1]
    width, inner = (np.hypot(*(placed[:, one] - placed[:, other]).T) for one, other in ((54, 48), (64, 60)))
    chin_height = chin[:, 1] - placed[:, 27:31, 1].mean(axis=1)
    features = np.stack([opening, width, lower - upper, chin_height, upper, lower, inner, corners], axis=1)
    terms = _pose_terms(placed, eyes, fps)
    fit = fit_ridge(terms, features - features.mean(axis=0))
    steady = features - features.mean(axis=0) - (terms - fit.mean) @ fit.weights
    steady = _smooth(steady, JITTER_SIGMA_S * fps)
    return steady - _smooth(steady, DRIFT_SIGMA * DRIFT_S * fps)


def _upright_points(points: Floats, fps: float) -> tuple[Floats, Floats]:
    """(T, 68, 2) points about the eyes in units of their distance, eyes level; (T,) distances in pixels."""
    from scipy.ndimage import median_filter

    between = points[:, 45] - points[:, 36]
    eyes = _smooth(median_filter(np.hypot(*between.T), 5), EYE_SIGMA_S * fps)
    roll = _smooth(np.unwrap(np.arctan2(between[:, 1], between[:, 0])), ROLL_SIGMA_S * fps)
    cos, sin = np.cos(roll)[:, None], np.sin(roll)[:, None]
    x, y = np.moveaxis(points - ((points[:, 45] + points[:, 36]) / 2)[:, None], 2, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=2) / eyes[:, None, None], eyes


def _pose_terms(placed: Floats, eyes: Floats, fps: float) -> Floats:
    bridge = placed[:, 30] - placed[:, 27]
    cheeks = placed[:, 16, 0] + placed[:, 0, 0]
    terms = np.stack([*placed[:, 33].T, *bridge.T, cheeks, np.log(eyes)], axis=1)
    terms = _smooth(terms, POSE_SIGMA_S * fps)
    terms = (terms - terms.mean(axis=0)) / np.maximum(terms.std(axis=0), 1e-9)
    return np.concatenate([terms, terms**2, terms[:, :1] * terms[:, 1:2]], axis=1)


def _smooth(values: Floats, sigma: float) -> Floats:
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, sigma, axis=0))


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
