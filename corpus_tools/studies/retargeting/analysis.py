"""Scores of the face tracker in recordings of a person, and in a face that mimics them frame by frame."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import check_any_kept, observe
from corpus_tools.run_options import RunOptions
from corpus_tools.training.score_map import read_scores
from lexicon.errors import DataError
from lexicon.sequence import SILENCE
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.lip_constraints import MIDDLE_PAIR
from tts2face.lips.motion_measures import correlation, range_ratio, speech_frames
from tts2face.lips.performer import build_performer_retargeter
from tts2face.lips.retargeting import BILABIALS
from tts2face.models.face import Face
from tts2face.models.landmarks import inner_lip_gaps, lip_opening, lip_width
from tts2face.models.score_map import SCORE_SHAPES, mouth_scores
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.types import Progress, StageCallback, Trajectory, ignore_stage
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.media import TimedFrame
from tts2face.video.networks import find_bundle
from tts2face.video.streaming import StreamingTracker

READING_STAGE, MIMICKING_STAGE = "reading recordings", "reading the face"
SIZE_PX = 256  # of the pictures of the face; the tracker's crop has as many pixels
LEAST_TOKENS = 5  # of a phone that is judged
TOLERANCE = 0.06  # largest difference of two mean scores that counts as equal
CLOSED_MM = 0.3  # largest gap of closed lips
SCORES = tuple(SCORE_SHAPES)


@dataclass(frozen=True, slots=True, eq=False)
class PhoneScores:
    """Mean scores (S,) of the person and of the face at the middle of the tokens of a phone."""

    phone: str
    n_tokens: int
    person: FloatArray
    face: FloatArray

    @property
    def is_judged(self) -> bool:
        """Whether there are enough tokens."""
        return self.n_tokens >= LEAST_TOKENS


@dataclass(frozen=True, slots=True)
class MouthMotion:
    """How the face's mouth follows the person's: means over recordings.

    Correlations of opening and width during speech, ratio of the ranges of the opening (each relative to the eyes), and
    share of the ``n_bilabials`` in which the lips close, in the frame where the person's are nearest.
    """

    r_opening: float
    r_width: float
    range_ratio: float
    closed: float
    n_bilabials: int


@dataclass(frozen=True, slots=True, eq=False)
class RetargetingStudy:
    """Result of a study: the scores of each phone, the most frequent first, and the motion of the mouth."""

    face: str
    n_recordings: int
    n_frames: int
    phones: tuple[PhoneScores, ...]
    motion: MouthMotion

    @property
    def differences(self) -> FloatArray:
        """Differences (P, S), face minus person, of the judged phones."""
        judged = [phone.face - phone.person for phone in self.phones if phone.is_judged]
        return np.array(judged, np.float64).reshape(len(judged), len(SCORES))

    @property
    def n_missed(self) -> int:
        """Number of differences of judged phones beyond `TOLERANCE`."""
        return int((np.abs(self.differences) > TOLERANCE).sum())


@dataclass(frozen=True, slots=True, eq=False)
class MimickedRecording:
    """A recording, and what a face that mimics it shows: scores (T, S) of both, the face's landmarks (T, 478, 3)."""

    observation: Observation
    person: FloatArray
    face: FloatArray
    landmarks: FloatArray


def study_retargeting(
    recordings: Path,
    face: Face,
    *,
    name: str,
    run_options: RunOptions | None = None,
    stages: StageCallback = ignore_stage,
) -> RetargetingStudy:
    """Compare what the face tracker reads in recordings and in a face that mimics them.

    Parameters
    ----------
    recordings
        A folder, or a video, as `tts2face corpus build` takes them; what is tracked in them is cached.
    name
        Name of the face.
    stages
        Called with the name of each stage at its start.
    """
    options = run_options or RunOptions()
    kept = check_any_kept(observe(recordings, run_options=options, on_progress=stages(READING_STAGE)))
    model = find_bundle(options.model)
    mimicked = list(mimic_recordings(kept, face, model, stages(MIMICKING_STAGE)))
    return RetargetingStudy(
        name,
        len(mimicked),
        sum(len(recording.person) for recording in mimicked),
        phone_scores(mimicked),
        mouth_motion(mimicked),
    )


def mimic_recordings(
    observations: Sequence[Observation], face: Face, model: Path, on_progress: Progress
) -> Iterator[MimickedRecording]:
    """Yield each recording with what the face shows that mimics it."""
    reader, tracker = BlendshapeReader(model), StreamingTracker(model)
    renderer = mesh_renderer(face, Picture(size=f"{SIZE_PX}x{SIZE_PX}"))
    rest = scatter_landmarks(face, landmark_positions(face))
    motion = scatter_landmarks(face, landmark_motion(face, np.arange(len(face.shape_names))))
    of = sum(len(each_observation.landmarks) for each_observation in observations)
    done = 0
    for observation in observations:
        fps = observation.fps
        person = read_scores(observation.landmarks, reader, fps)
        weights = (
            build_performer_retargeter(observation.landmarks, person, face)
            .weights(observation.landmarks, person)
            .values
        )
        head = observation.head - np.median(observation.head, axis=0)
        pictures = (
            TimedFrame(number / fps, renderer.draw(*pose))
            for number, pose in enumerate(zip(weights, head, strict=True))
        )
        read = []
        for frame in tracker.track(pictures, fps):
            if not np.isfinite(frame.points).all():
                raise DataError(f"the tracker finds no face in a picture of the face; check {observation.name} on it")
            read.append(reader.blendshape_scores(frame.points))
            done += 1
            on_progress(done, of)
        shown = mouth_scores(Trajectory(BLENDSHAPES, np.array(read), fps))
        yield MimickedRecording(
            observation, mouth_scores(person), shown, rest + np.tensordot(weights, motion, axes=(1, 2))
        )


def phone_scores(mimicked: Sequence[MimickedRecording]) -> tuple[PhoneScores, ...]:
    """Mean scores at the middle of each phone's tokens, the most frequent phone first."""
    tokens: dict[str, list[tuple[FloatArray, FloatArray]]] = {}
    for recording in mimicked:
        phones, edges = recording.observation.phones.phones, recording.observation.phones.edges
        middles = np.rint((edges[:-1] + edges[1:]) / 2 * recording.observation.fps).astype(int)
        for phone, at in zip(phones, np.minimum(middles, len(recording.person) - 1), strict=True):
            if phone != SILENCE:
                tokens.setdefault(phone, []).append((recording.person[at], recording.face[at]))
    rows = (PhoneScores(phone, len(found), *np.mean(found, axis=0)) for phone, found in tokens.items())
    return tuple(sorted(rows, key=lambda row: (-row.n_tokens, row.phone)))


def mouth_motion(mimicked: Sequence[MimickedRecording]) -> MouthMotion:
    """How the mouth of the face follows the person's."""
    rows, closed = [], []
    for recording in mimicked:
        own = recording.observation.landmarks
        here = speech_frames(recording.observation.phones, len(own), recording.observation.fps)
        opening, shown = lip_opening(own)[here], lip_opening(recording.landmarks)[here]
        width = correlation(lip_width(own)[here], lip_width(recording.landmarks)[here])
        rows.append((correlation(opening, shown), width, range_ratio(opening, shown)))
        closed += bilabial_gaps(recording)
    means = np.mean(rows, axis=0)
    share = float(np.mean(np.array(closed) < CLOSED_MM)) if closed else float("nan")
    return MouthMotion(float(means[0]), float(means[1]), float(means[2]), share, len(closed))


def bilabial_gaps(recording: MimickedRecording) -> list[float]:
    """Gap of the face's lips, mm, in each bilabial in the frame where the person's are nearest."""
    phones, fps = recording.observation.phones, recording.observation.fps
    person, face = (
        inner_lip_gaps(places)[:, MIDDLE_PAIR] for places in (recording.observation.landmarks, recording.landmarks)
    )
    found = []
    for phone, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        first, last = int(np.floor(start * fps)), int(np.ceil(end * fps)) + 1
        if phone in BILABIALS and len(person[first:last]):
            found.append(float(face[first + int(person[first:last].argmin())]))
    return found


def motion_figures(motion: MouthMotion) -> Mapping[str, str]:
    """Figures of the mouth's motion by name, as text."""
    closed = "none spoken" if not motion.n_bilabials else f"{motion.closed:.2f} of {motion.n_bilabials}"
    return {
        "r opening": f"{motion.r_opening:.3f}",
        "r width": f"{motion.r_width:.3f}",
        "range ratio": f"{motion.range_ratio:.2f}",
        "closed bilabials": closed,
    }
