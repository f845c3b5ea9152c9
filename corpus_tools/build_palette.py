"""Recordings of one person in one mood become a style of a palette."""

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.build_talker import PROVENANCE, PROVENANCE_FIELDS, UNSTATED, read_provenance
from corpus_tools.decomposition.basis_expressions import Basis, captured_basis, carried_basis
from corpus_tools.decomposition.blend_weights import MOST_SLACK, Estimator, least_squares, nearest_samples
from corpus_tools.decomposition.capture import Captured
from corpus_tools.decomposition.capture_files import CAPTURE_SUFFIXES, Worn, captured_file
from corpus_tools.decomposition.decompose import Parts, as_counted, taken_apart
from corpus_tools.decomposition.derived_styles import derived_styles
from corpus_tools.decomposition.face_motion import rest_landmarks
from corpus_tools.decomposition.marker_set import read_marker_set
from corpus_tools.decomposition.markers import marker_face
from corpus_tools.decomposition.stills import NEUTRAL, PictureReader, Still, marker_reader
from corpus_tools.decomposition.style import with_style
from corpus_tools.decomposition.video import captured_video
from corpus_tools.process_pool import each_done
from corpus_tools.recordings.corpus_video import Eyes
from corpus_tools.recordings.folder import MANIFEST, VIDEO_SUFFIXES
from corpus_tools.recordings.observe import Refusal
from corpus_tools.run_options import Effort, Progress, Stages, no_stages
from corpus_tools.training.pose_correction import pose_leak
from lexicon.errors import DataError, InputError
from lexicon.inputs import check_regular_file
from tts2face.face.expressions import expression_landmarks
from tts2face.face.mouth_model import MIDDLE_PAIR
from tts2face.models.face import Face
from tts2face.models.face_file import load_face
from tts2face.models.palette import Palette, write_palette
from tts2face.retargeting.performer import CLOSED_SHARE, aperture, lip_gaps
from tts2face.video.landmark_models import find_bundle

ESTIMATORS = ("least-squares", "samples")
SAMPLES_SEED = 2008
AWAKE = 0.85  # of the usual opening of the lids: frames with less show a blink
RESTING_FRAMES = 3000  # are enough to know a face at rest
CONTENT = "expression, brows, lids, cheeks, gaze, head pose, loudness and pitch; no image, no sound, no lips"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """What a style is learnt from.

    Parameters
    ----------
    recordings
        A folder of videos, Live Link tables (.csv) or marker captures (.c3d, .csv); or one of these files.
    stills
        Captured basis expressions; the default head's, carried to the person, where there is none.
    worn
        How markers are read.
    provenance
        JSON file as `corpus_tools.build_talker.read_provenance` reads it; ``provenance.json`` in the folder when None.
    """

    recordings: Path
    stills: Mapping[str, Still] = field(default_factory=dict)
    worn: Worn = Worn()  # noqa: RUF009 - frozen
    provenance: Path | None = None


@dataclass(frozen=True, slots=True)
class Made:
    """What a build gave: recordings kept, minutes of them, what was refused, notes, and the share of motion kept."""

    n_kept: int
    minutes: float
    refused: tuple[Refusal, ...]
    notes: tuple[str, ...]
    kept: Mapping[str, float]


def build_style(  # noqa: PLR0913 - the effort changes no motion
    recorded: Recorded,
    style: str,
    out: Path,
    *,
    base: Palette | None,
    estimator: str = ESTIMATORS[0],
    epsilon: float = 0.0,
    effort: Effort | None = None,
    stages: Stages = no_stages,
) -> Made:
    """Learn a style from recordings and write a palette: `base` with it, or it alone with the styles derived from it.

    Weights of expressions lie within ``-epsilon`` and ``1 + epsilon`` (Ju and Lee 2008, section 4.1).

    Raises
    ------
    InputError
        There is nothing to learn from, the palette has the style, or an estimator or epsilon that there is not.
    DataError
        No recording could be used, or a still cannot.
    BackendError
        A package or the landmark models are missing, or a file cannot be written.
    """
    if estimator not in ESTIMATORS:
        raise InputError(f"there is no estimator {estimator!r}; choose {' or '.join(ESTIMATORS)}")
    if not 0.0 <= epsilon <= MOST_SLACK:
        raise InputError(f"epsilon must lie between 0 and {MOST_SLACK:g}, not {epsilon:g}")
    if base is not None and style in base.names:
        raise InputError(f"the palette has a style {style} already; choose another name")
    stated = read_provenance(
        recorded.provenance or recorded.recordings / PROVENANCE, must_exist=recorded.provenance is not None
    )
    face = load_face("head")
    captured, refused = captured_all(recorded, face, effort or Effort(), stages("watching recordings"))
    if not captured:
        raise DataError(f"no recording could be used; the first: {refused[0].name}: {refused[0].reason}")
    basis = basis_of(recorded, captured, face)
    parts = parts_of(captured, basis, estimator_of(estimator, basis, epsilon), stages("taking them apart"))
    words = _words(recorded, style, out, base is None, epsilon)
    learnt = with_style(base, style, parts, basis.rest, _metadata(recorded, stated, words))
    palette = learnt.palette
    if base is None:
        palette = replace(palette, derivations=derived_styles(style))
    write_palette(out, palette)
    minutes = learnt.palette.styles[style].seconds / 60
    notes = tuple(f"{one.name}: {note}" for one in captured for note in one.notes)
    return Made(len(captured), minutes, tuple(refused), notes, learnt.kept)


def parts_of(
    captured: Sequence[Captured], basis: Basis, estimator: Estimator, on_progress: Progress | None = None
) -> list[Parts]:
    """Recordings of one person taken apart, without what turning the head does to landmarks."""
    leak = pose_leak(captured)
    parts = []
    for number, one in enumerate(captured, start=1):
        parts.append(taken_apart(leak.removed(one), basis, estimator))
        if on_progress:
            on_progress(number, len(captured))
    return parts


def estimator_of(name: str, basis: Basis, epsilon: float = 0.0) -> Estimator:
    """One of `ESTIMATORS` for a basis, of weights within ``-epsilon`` and ``1 + epsilon``."""
    expressions = as_counted(basis.expressions)
    if name == "least-squares":
        return least_squares(expressions, epsilon)
    return nearest_samples(expressions, np.random.default_rng(SAMPLES_SEED), slack=epsilon)


def basis_of(recorded: Recorded, captured: Sequence[Captured], face: Face) -> Basis:
    """The person's basis expressions: as captured, or the default head's, carried over.

    Raises
    ------
    InputError, DataError
        A still is missing or cannot be read.
    """
    rest = rest_of(captured)
    if recorded.stills:
        known = None if NEUTRAL in recorded.stills else rest
        return captured_basis(recorded.stills, reader_of(recorded, face), rest=known)
    return carried_basis(expression_landmarks(face), rest_landmarks(face), rest)


def reader_of(recorded: Recorded, face: Face) -> Callable[[Still], NDArray[np.float64]]:
    """What reads the stills: the tracker, or for markers the person's markers at rest.

    Raises
    ------
    InputError
        Some stills are markers and some are not, or no markers at rest are known.
    """
    are_markers = {still.is_markers for still in recorded.stills.values()}
    if are_markers == {False}:
        return PictureReader()
    at_rest = recorded.worn.neutral or (recorded.stills[NEUTRAL].path if NEUTRAL in recorded.stills else None)
    if are_markers != {True} or at_rest is None:
        raise InputError("stills of markers need each other and the person at rest; give all as markers, with neutral")
    worn = read_marker_set(recorded.worn.markers)
    return marker_reader(marker_face(at_rest, face, worn, fps=recorded.worn.fps))


def rest_of(captured: Sequence[Captured]) -> NDArray[np.float64]:
    """(478, 3) landmarks of the person at rest: as captured, or the median of frames with closed lips and open lids."""
    known = next((one.rest for one in captured if one.rest is not None), None)
    if known is not None:
        return np.asarray(known, np.float64)
    frames = np.concatenate([one.landmarks for one in captured])
    frames = frames[:: max(1, len(frames) // RESTING_FRAMES)]
    opened = np.minimum(aperture(frames, "Left"), aperture(frames, "Right"))
    awake = opened >= AWAKE * np.median(opened)
    gaps = lip_gaps(frames)[:, MIDDLE_PAIR]
    closed = gaps <= np.quantile(gaps[awake], CLOSED_SHARE)
    return np.asarray(np.median(frames[awake & closed], axis=0), np.float64)


def captured_all(
    recorded: Recorded, face: Face, effort: Effort, on_progress: Progress | None
) -> tuple[list[Captured], list[Refusal]]:
    """Every recording, or why it cannot serve; both by name.

    Raises
    ------
    InputError
        There is no recording.
    BackendError
        The landmark models are missing, the cache cannot be written, or a process died.
    """
    files = files_in(recorded.recordings)
    jobs = min(effort.processes(), len(files))
    model = find_bundle(effort.model) if any(file.suffix.lower() in VIDEO_SUFFIXES for file in files) else None
    ready = (effort.folder(), model, face, recorded.worn)
    captured: list[Captured] = []
    refused: list[Refusal] = []
    for number, outcome in enumerate(_outcomes(files, ready, jobs), start=1):
        if isinstance(outcome, Refusal):
            refused.append(outcome)
        else:
            captured.append(outcome)
        if on_progress:
            on_progress(number, len(files))
    return sorted(captured, key=lambda one: one.name), sorted(refused, key=lambda one: one.name)


def files_in(recordings: Path) -> list[Path]:
    """Videos and captures of a folder and of its folder ``clips``; or the file that is given.

    Raises
    ------
    InputError
        There is none.
    """
    known = VIDEO_SUFFIXES | CAPTURE_SUFFIXES
    if recordings.is_file() and recordings.suffix.lower() in known:
        return [recordings]
    folders = [recordings, recordings / "clips"]
    found = [file for folder in folders if folder.is_dir() for file in folder.iterdir() if file.suffix.lower() in known]
    if not found:
        raise InputError(
            f"{recordings} holds no video and no capture ({', '.join(sorted(known))}); give a folder of them"
        )
    return sorted(file for file in found if file.name != MANIFEST)


Ready = tuple[Path, Path | None, Face, Worn]
Outcome = Captured | Refusal


def _outcomes(files: Sequence[Path], ready: Ready, jobs: int) -> Iterator[Outcome]:
    if jobs > 1:
        yield from (outcome for _, outcome in each_done(files, _work, _start, ready, jobs))
        return
    worker = _Worker(*ready)
    for file in files:
        yield worker.outcome(file)


class _Worker:
    def __init__(self, cache: Path, model: Path | None, face: Face, worn: Worn) -> None:
        self._eyes = Eyes(cache, model) if model is not None else None
        self._face, self._worn = face, worn

    def outcome(self, file: Path) -> Outcome:
        """A recording, or why it cannot serve."""
        try:
            check_regular_file(file)
            if self._eyes is not None and file.suffix.lower() in VIDEO_SUFFIXES:
                return captured_video(file, self._eyes)
            return captured_file(file, self._face, worn=self._worn)
        except DataError as reason:
            return Refusal(file.stem, str(reason), file, 0.0)


_worker: list[_Worker] = []  # of this process; filled once by the pool


def _start(*ready: Any) -> None:
    _worker.append(_Worker(*ready))


def _work(file: Path) -> Outcome:
    return _worker[0].outcome(file)


def _words(recorded: Recorded, style: str, out: Path, is_alone: bool, epsilon: float) -> list[str]:
    """The command that makes the style again."""
    words = ["tts2face", "corpus", "gestures", recorded.recordings.name, "--style", style, *["--alone"] * is_alone]
    words += ["--provenance", recorded.provenance.name] if recorded.provenance else []
    words += ["--epsilon", f"{epsilon:g}"] if epsilon else []
    return [*words, "--out", out.name]


def _metadata(recorded: Recorded, stated: Mapping[str, Any], words: Sequence[str]) -> dict[str, Any]:
    return {
        **dict.fromkeys(PROVENANCE_FIELDS, UNSTATED),
        **stated,
        "command": shlex.join(words),
        "created": datetime.now(UTC).date().isoformat(),
        "content": CONTENT,
    }
