"""Build a style of a palette from recordings of one person in one mood."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.basis import ExpressionBasis, basis_from_stills, transfer_basis
from corpus_tools.decomposition.blend_weights import (
    MAX_SLACK,
    Estimator,
    build_least_squares_estimator,
    build_nearest_samples_estimator,
)
from corpus_tools.decomposition.capture import FaceRecording
from corpus_tools.decomposition.capture_files import MarkerOptions
from corpus_tools.decomposition.decompose import LEAST_PIECE_S, Decomposition, decompose, weight_displacements
from corpus_tools.decomposition.derived_styles import read_derived_styles
from corpus_tools.decomposition.learnt_style import add_style
from corpus_tools.decomposition.marker_sets import read_marker_set
from corpus_tools.decomposition.markers import read_marker_face
from corpus_tools.decomposition.recordings import read_recordings
from corpus_tools.decomposition.stills import NEUTRAL, PictureReader, Still, build_marker_reader
from corpus_tools.recordings.observe import Refusal
from corpus_tools.recordings.provenance import PROVENANCE, PROVENANCE_FIELDS, read_provenance
from corpus_tools.run_options import RunOptions
from corpus_tools.training.pose_correction import fit_pose_correction
from lexicon.errors import DataError, InputError
from lexicon.values.fields import check_fields
from tts2face.face.expressions import expression_landmarks
from tts2face.face.landmarks import rest_landmarks
from tts2face.face.lip_constraints import MIDDLE_PAIR
from tts2face.lips.performer import CLOSED_FRAME_SHARE
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import eye_aperture, inner_lip_gaps
from tts2face.models.palette import Palette
from tts2face.models.palette_file import write_palette
from tts2face.models.talker import NOT_STATED
from tts2face.types import Progress, StageCallback, ignore_progress, ignore_stage

ESTIMATORS = ("least-squares", "samples")
SAMPLES_SEED = 2008
MIN_OPEN_LIDS = 0.85  # of the median lid opening; frames with less are blinks
N_REST_FRAMES = 3000  # used to estimate the face at rest
CONTENT = "expression, brows, lids, cheeks, gaze, head pose, loudness and pitch; no image, no sound, no lips"


@dataclass(frozen=True, slots=True, kw_only=True)
class StyleSource:
    """Recordings and options from which a style is learnt.

    Parameters
    ----------
    recordings
        A folder of videos, Live Link tables (.csv, .tsv) or marker captures (.c3d, .trc, .csv); or one of these files.
    stills
        Captured basis expressions; by default those of the default head, transferred to the person.
    marker_options
        Options of marker files.
    provenance
        JSON file as `recordings.provenance.read_provenance` reads it; ``provenance.json`` in the folder when None.
    """

    recordings: Path
    stills: Mapping[str, Still] = field(default_factory=dict)
    marker_options: MarkerOptions = MarkerOptions()  # noqa: RUF009 - frozen
    provenance: Path | None = None

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)


@dataclass(frozen=True, slots=True)
class BuiltStyle:
    """Result of a build: number and minutes of kept recordings, refusals, notes, and the share of motion kept."""

    n_kept: int
    minutes: float
    refused: tuple[Refusal, ...]
    notes: tuple[str, ...]
    kept: Mapping[str, float]


def build_style(  # noqa: PLR0913 - run options change no motion
    recorded: StyleSource,
    style: str,
    out: Path,
    *,
    base: Palette | None,
    estimator: str = ESTIMATORS[0],
    epsilon: float = 0.0,
    run_options: RunOptions | None = None,
    stages: StageCallback = ignore_stage,
) -> BuiltStyle:
    """Learn a style from recordings and write a palette: `base` with the style, or the style and its derived styles.

    Weights of expressions lie within ``-epsilon`` and ``1 + epsilon`` (Ju and Lee 2008, section 4.1).

    Raises
    ------
    InputError
        There are no recordings, the palette has the style already, or the estimator or epsilon is invalid.
    DataError
        No recording or a still could not be used.
    BackendError
        A package or the landmark models are missing, or a file cannot be written.
    """
    if estimator not in ESTIMATORS:
        raise InputError(f"there is no estimator {estimator!r}; choose {' or '.join(ESTIMATORS)}")
    if not 0.0 <= epsilon <= MAX_SLACK:
        raise InputError(f"epsilon must lie between 0 and {MAX_SLACK:g}, not {epsilon:g}")
    if base is not None and style in base.names:
        raise InputError(f"the palette has a style {style} already; choose another name")
    stated = read_provenance(
        recorded.provenance or recorded.recordings / PROVENANCE, must_exist=recorded.provenance is not None
    )
    face = load_face("head")
    captured, refused = read_recordings(
        recorded.recordings, face, recorded.marker_options, run_options or RunOptions(), stages("reading recordings")
    )
    if not captured:
        raise DataError(f"no recording could be used; the first: {refused[0].name}: {refused[0].reason}")
    basis = build_basis(recorded, captured, face)
    parts = decompose_recordings(
        captured, basis, build_estimator(estimator, basis, epsilon), stages("decomposing recordings")
    )
    words = _command_words(recorded, style, out, base is None, epsilon)
    learnt = add_style(
        base,
        style,
        parts,
        basis.rest,
        {
            **dict.fromkeys(PROVENANCE_FIELDS, NOT_STATED),
            **stated,
            "command": shlex.join(words),
            "created": datetime.now(UTC).date().isoformat(),
            "content": CONTENT,
        },
    )
    palette = learnt.palette
    if base is None:
        palette = replace(palette, derivations=read_derived_styles(style))
    write_palette(out, palette)
    minutes = learnt.palette.styles[style].seconds / 60
    notes = tuple(f"{recording.name}: {note}" for recording in captured for note in recording.notes)
    return BuiltStyle(len(captured), minutes, tuple(refused), notes, learnt.kept)


def decompose_recordings(
    captured: Sequence[FaceRecording],
    basis: ExpressionBasis,
    estimator: Estimator,
    on_progress: Progress = ignore_progress,
) -> list[Decomposition]:
    """Decompositions of recordings of one person, between long gaps, after correction of pose-dependent errors."""
    leak = fit_pose_correction(captured)
    parts = list[Decomposition]()
    for number, recording in enumerate(captured, start=1):
        parts += decompose(leak.apply(recording), basis, estimator).measured_pieces()
        on_progress(number, len(captured))
    if not parts:
        raise DataError(f"no recording shows the face for {LEAST_PIECE_S:g} s without a long gap; capture it again")
    return parts


def build_estimator(name: str, basis: ExpressionBasis, epsilon: float = 0.0) -> Estimator:
    """One of the `ESTIMATORS` for a basis, with weights between ``-epsilon`` and ``1 + epsilon``."""
    expressions = weight_displacements(basis.expressions)
    if name == "least-squares":
        return build_least_squares_estimator(expressions, epsilon)
    return build_nearest_samples_estimator(expressions, np.random.default_rng(SAMPLES_SEED), slack=epsilon)


def build_basis(recorded: StyleSource, captured: Sequence[FaceRecording], face: Face) -> ExpressionBasis:
    """The person's basis expressions: captured, or transferred from the default head."""
    rest = person_at_rest(captured)
    if recorded.stills:
        known = None if NEUTRAL in recorded.stills else rest
        return basis_from_stills(recorded.stills, build_still_reader(recorded, face), rest=known)
    return transfer_basis(expression_landmarks(face), rest_landmarks(face), rest)


def build_still_reader(recorded: StyleSource, face: Face) -> Callable[[Still], NDArray[np.float64]]:
    """The reader of the stills: the tracker for pictures, or a reader of markers."""
    are_markers = {still.is_markers for still in recorded.stills.values()}
    if are_markers == {False}:
        return PictureReader()
    at_rest = recorded.marker_options.neutral or (recorded.stills[NEUTRAL].path if NEUTRAL in recorded.stills else None)
    if are_markers != {True} or at_rest is None:
        raise InputError(
            "marker stills cannot be mixed with pictures and need the person at rest; give all as markers, with neutral"
        )
    marker_set = read_marker_set(recorded.marker_options.marker_table)
    return build_marker_reader(read_marker_face(at_rest, face, marker_set, fps=recorded.marker_options.fps))


def person_at_rest(captured: Sequence[FaceRecording]) -> NDArray[np.float64]:
    """(478, 3) landmarks of the person at rest: as captured, or the median of frames with closed lips and open lids."""
    given = next((recording.rest for recording in captured if recording.rest is not None), None)
    if given is not None:
        return np.asarray(given, np.float64)
    frames = np.concatenate([recording.landmarks for recording in captured])
    frames = frames[:: max(1, len(frames) // N_REST_FRAMES)]
    opened = np.minimum(eye_aperture(frames, "Left"), eye_aperture(frames, "Right"))
    is_open = opened >= MIN_OPEN_LIDS * np.median(opened)
    gaps = inner_lip_gaps(frames)[:, MIDDLE_PAIR]
    closed = gaps <= np.quantile(gaps[is_open], CLOSED_FRAME_SHARE)
    return np.asarray(np.median(frames[is_open & closed], axis=0), np.float64)


def _command_words(recorded: StyleSource, style: str, out: Path, is_alone: bool, epsilon: float) -> list[str]:
    """The command that builds the style."""
    words = ["tts2face", "corpus", "gestures", recorded.recordings.name, "--style", style, *["--alone"] * is_alone]
    words += ["--provenance", recorded.provenance.name] if recorded.provenance else []
    words += ["--epsilon", f"{epsilon:g}"] if epsilon else []
    return [*words, "--out", out.name]
