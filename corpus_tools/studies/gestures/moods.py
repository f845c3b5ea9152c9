"""Moods of a palette as an independent network sees them: what it reads in rendered clips, and a classifier.

Every style speaks sentences with several seeds; the face tracker reads blendshape scores and landmarks of frames of the
rendered clips, beside those of the face at rest. A classifier is trained on the clips of one half of the seeds and
tested on the clips of the other half.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.gestures.blinks import find_blinks
from lexicon.errors import BackendError, InputError
from lexicon.values.fields import check_fields
from tts2face.face.eyelids import LID_LANDMARK_PAIRS
from tts2face.face.mood_targets import BROW_ENDS, CORNERS, MIDDLE
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.models.palette import Palette
from tts2face.numeric.arrays import FloatArray, ordered_product
from tts2face.picture.options import Picture
from tts2face.session.session import Session
from tts2face.types import Clip, Progress, ignore_progress
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.pose import remove_pose
from tts2face.video.tracking import FaceTracker

SENTENCES = (
    "Thank you for calling. Your order was sent on Tuesday, and it should reach you within three days.",
    "When the rain finally stopped, the children ran out into the garden, and jumped into every puddle.",
    "Photosynthesis turns light into sugar. Plants take in water, and they release the oxygen that we breathe.",
    "No, that is simply not true. You promised to fix the roof, and now it is leaking again.",
)
COVARIANCE_SHARE = 0.7  # of the covariance within the moods, beside its diagonal, by which single frames are judged
MEASURE_SCALE = 10.0  # of measures, shares of the face, beside scores from 0 to 1
LEAST_SPREAD = 0.01  # added to the spread of scores within a mood, so that constant scores do not decide
SHUT_SHAPES, SMILE_SHAPES = ("eyeBlinkLeft", "eyeBlinkRight"), ("mouthSmileLeft", "mouthSmileRight")


@dataclass(frozen=True, slots=True)
class MoodOptions:
    """Options of a study of moods.

    Parameters
    ----------
    seeds
        Clips of each mood, an even number of 4 or more; the first half trains the classifier.
    first_seed
        Seed of the first clip.
    frames
        Frames of each clip that are rendered and read.
    size
        Width and height of the pictures in pixels.
    sentences
        Texts, one for each seed in turn.

    Raises
    ------
    InputError
        A number is too small, or there is no sentence.
    """

    seeds: int = 8
    first_seed: int = 0
    frames: int = 12
    size: int = 256
    sentences: tuple[str, ...] = SENTENCES

    def __post_init__(self) -> None:
        """Check the types and the numbers."""
        check_fields(self)
        # half of them train the classifier, half test it
        if self.seeds < 4 or self.seeds % 2:
            raise InputError(f"the seeds must be an even number of 4 or more, not {self.seeds}")
        if self.first_seed < 0:
            raise InputError(f"a seed is a whole number from 0, not {self.first_seed}")
        if self.frames < 2 or self.size < 160:
            raise InputError(
                f"a clip needs at least 2 frames of 160 pixels, not {self.frames} of {self.size}; the tracker finds no "
                "smaller face"
            )
        if not self.sentences:
            raise InputError("moods are compared on at least one sentence; give one")


@dataclass(frozen=True, slots=True, eq=False)
class MoodClip:
    """One clip of a mood.

    Parameters
    ----------
    scores, measures : (F, 52), (F, M)
        Blendshape scores of the frames in which a face was found, and `mood_measures` of their landmarks.
    smile : (T,)
        Weight of the smile shapes, mean of both sides.
    blinks_per_minute, yaw_spread_deg
        Rate of blinks, and standard deviation of the head's yaw in degrees.
    frames : (F', H, W, 3)
        Three frames of the clip.
    """

    scores: FloatArray
    measures: FloatArray
    smile: FloatArray
    blinks_per_minute: float
    yaw_spread_deg: float
    frames: NDArray[np.uint8]

    @property
    def frame_features(self) -> FloatArray:
        """(F, 52 + M) what is seen of each frame."""
        return np.column_stack([self.scores, MEASURE_SCALE * self.measures])

    @property
    def features(self) -> FloatArray:
        """(104 + 2 M,) mean and standard deviation of what is seen over the clip."""
        return np.concatenate([self.frame_features.mean(axis=0), self.frame_features.std(axis=0)])


@dataclass(frozen=True, slots=True, eq=False)
class MoodStudy:
    """Result of `study_moods`.

    Parameters
    ----------
    clips
        Clips of each mood in the order of the seeds.
    confusion, frame_confusion : (M, M)
        Number of test clips, and of their single frames, by mood (rows) and answer of the classifier (columns).
    """

    options: MoodOptions
    clips: Mapping[str, tuple[MoodClip, ...]]
    confusion: NDArray[np.int64]
    frame_confusion: NDArray[np.int64]

    @property
    def moods(self) -> tuple[str, ...]:
        """Names of the moods."""
        return tuple(self.clips)

    @property
    def accuracy(self) -> float:
        """Share of the test clips whose mood is recognised."""
        return float(np.trace(self.confusion) / self.confusion.sum())

    @property
    def frame_accuracy(self) -> float:
        """Share of the single frames of the test clips whose mood is recognised."""
        return float(np.trace(self.frame_confusion) / self.frame_confusion.sum())

    def mean_score(self, mood: str, *names: str) -> float:
        """Mean of some scores over all clips of a mood."""
        columns = [BLENDSHAPES.index(name) for name in names]
        return float(np.mean([clip.scores[:, columns].mean() for clip in self.clips[mood]]))

    def smile_range(self, mood: str) -> tuple[float, float, float]:
        """Fifth percentile, mean and 95th percentile of the smile's weight over all clips of a mood."""
        smile = np.concatenate([clip.smile for clip in self.clips[mood]])
        low, high = np.percentile(smile, [5, 95]).tolist()
        return low, float(smile.mean()), high


def study_moods(
    session: Session,
    options: MoodOptions,
    moods: Sequence[str] | None = None,
    on_progress: Progress = ignore_progress,
) -> MoodStudy:
    """Render clips of the moods of a session's palette, read them with the tracker, and tell them apart.

    Parameters
    ----------
    moods
        Names of styles; by default the derived styles of the palette.
    """
    names = tuple(moods) if moods is not None else _derived(session.palette)
    if len(names) < 2:
        raise InputError(f"at least two moods can be told apart, not {len(names)}; give a palette with derived styles")
    reader = _ClipReader(session, options)
    clips: dict[str, tuple[MoodClip, ...]] = {}
    for number, mood in enumerate(names):
        on_progress(number, len(names))
        clips[mood] = tuple(reader.read(mood, seed) for seed in range(options.seeds))
    on_progress(len(names), len(names))
    return MoodStudy(options, clips, *_confusions(clips, options.seeds // 2))


def _derived(palette: Palette | None) -> tuple[str, ...]:
    return () if palette is None else tuple(palette.derivations)


class _ClipReader:
    """Renders clips of a session and reads their frames."""

    def __init__(self, session: Session, options: MoodOptions) -> None:
        self._session, self._options = session, options
        self._renderer = session.renderer(Picture(size=f"{options.size}x{options.size}"))
        self._tracker, self._scores = FaceTracker(), BlendshapeReader()
        self._rest: FloatArray | None = None

    def _rest_landmarks(self, clip: Clip) -> FloatArray:
        """(478, 3) landmarks of the face at rest, as the tracker reads them; it is the same for all clips."""
        if self._rest is None:
            motion, head = (replace(track, values=np.zeros_like(track.values)) for track in (clip.motion, clip.head))
            still = np.asarray(self._renderer.frame(replace(clip, motion=motion, head=head), 0))[..., :3]
            points, found = self._tracker.read(np.ascontiguousarray(still))
            if not found > 0:
                raise BackendError(
                    "the tracker finds no face in a picture of the face at rest; choose a larger picture"
                )
            self._rest = remove_pose(points[None], 1.0).landmarks[0].astype(np.float64)
        return self._rest

    def read(self, mood: str, seed: int) -> MoodClip:
        options = self._options
        text = options.sentences[seed % len(options.sentences)]
        clip = self._session.clip(text, style=mood, seed=options.first_seed + seed)
        numbers = np.linspace(0, len(clip.motion) - 1, options.frames + 2).round().astype(int)[1:-1]
        pictures = [np.asarray(self._renderer.frame(clip, int(number)))[..., :3] for number in numbers]
        read = [self._tracker.read(np.ascontiguousarray(picture)) for picture in pictures]
        seen = [points for points, found in read if found > 0]
        if not seen:
            raise BackendError(f"the tracker finds no face in a clip of {mood}; choose a larger picture")
        scores = [self._scores.blendshape_scores(points) for points in seen]
        # one by one: the scale of frames that are far from each other is not smoothed
        landmarks = np.concatenate([remove_pose(points[None], clip.fps).landmarks for points in seen])
        measures = mood_measures(landmarks.astype(np.float64), self._rest_landmarks(clip))
        kept = np.linspace(0, len(pictures) - 1, 3).round().astype(int)
        shut = clip.motion.columns(SHUT_SHAPES).astype(np.float64)
        return MoodClip(
            np.array(scores, np.float64),
            measures,
            clip.motion.columns(SMILE_SHAPES).astype(np.float64).mean(axis=1),
            find_blinks(shut, np.array([len(clip.motion)], np.int32), clip.fps).per_minute,
            float(np.degrees(clip.head.values[:, 1].std())),
            np.stack([pictures[at] for at in kept]),
        )


def _confusions(
    clips: Mapping[str, tuple[MoodClip, ...]], n_training: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Confusion of the test clips, and of their frames, whose classifier is trained on the frames of training clips."""
    training = [np.stack([clip.features for clip in mood[:n_training]]) for mood in clips.values()]
    testing = [np.stack([clip.features for clip in mood[n_training:]]) for mood in clips.values()]
    training_frames = [np.concatenate([clip.frame_features for clip in mood[:n_training]]) for mood in clips.values()]
    testing_frames = [np.concatenate([clip.frame_features for clip in mood[n_training:]]) for mood in clips.values()]
    return confusion_matrix(training, testing), confusion_matrix(training_frames, testing_frames, COVARIANCE_SHARE)


def mood_measures(landmarks: FloatArray, rest: FloatArray) -> FloatArray:
    """Changes of a face that show its mood, (T, 11), left and right: corners of the mouth, its width, brows, and lids.

    Parameters
    ----------
    landmarks, rest : (T, 478, 3), (478, 3)
        Landmarks without head pose, of frames and of the same face at rest. Measures are shares of the distance of the
        eyes, beyond rest.
    """
    moved = (landmarks - rest) / np.linalg.norm(rest[EYE_OUTER_LEFT] - rest[EYE_OUTER_RIGHT])
    across, high = moved[..., 0], moved[..., 1]
    corners = high[:, list(CORNERS)] - high[:, list(MIDDLE)].mean(axis=1, keepdims=True)
    brows = [high[:, list(end)].mean(axis=1) for ends in BROW_ENDS.values() for end in ends]
    lids = [(high[:, list(up)] - high[:, list(low)]).mean(axis=1) for up, low in LID_LANDMARK_PAIRS]
    knitted = across[:, BROW_ENDS["brows_inner"][0][0]] - across[:, BROW_ENDS["brows_inner"][1][0]]
    opened = high[:, MIDDLE[0]] - high[:, MIDDLE[1]]
    width = across[:, CORNERS[0]] - across[:, CORNERS[1]]
    return np.column_stack([corners, width, opened, *brows, knitted, *lids])


def confusion_matrix(
    training: Sequence[FloatArray], testing: Sequence[FloatArray], covariance_share: float = 0.0
) -> NDArray[np.int64]:
    """Confusion (M, M) of a nearest-mean classifier of M classes.

    Parameters
    ----------
    training, testing
        Features (n, d) of each class. Distances are in units of the spread within the classes of `training`.
    covariance_share
        Of the covariance within the classes, beside its diagonal: what features say twice counts once.
    """
    means = np.stack([features.mean(axis=0) for features in training])
    within = np.concatenate([features - mean for features, mean in zip(training, means, strict=True)])
    scaled = means / (spread := np.sqrt(np.square(within).mean(axis=0)) + LEAST_SPREAD)
    alike = ordered_product((within / spread).T, within / spread) / len(within)
    precision = np.linalg.inv(covariance_share * alike + (1.0 - covariance_share) * np.eye(len(alike)))
    confusion = np.zeros((len(means), len(means)), np.int64)
    for row, features in enumerate(testing):
        apart = (features / spread)[:, None] - scaled
        distances = np.einsum("nmi,ij,nmj->nm", apart, precision, apart, optimize=True)
        np.add.at(confusion, (row, distances.argmin(axis=1)), 1)
    return confusion
