"""Moods of a palette as an independent network sees them: blendshape scores of rendered clips, and a classifier.

Every style speaks sentences with several seeds; the face tracker reads frames of the rendered clips. A nearest-mean
classifier is trained on the clips of one half of the seeds and tested on the clips of the other half.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.gestures.blinks import find_blinks
from lexicon.errors import BackendError, InputError
from lexicon.values.fields import check_fields
from tts2face.models.palette import Palette
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.options import Picture
from tts2face.session.session import Session
from tts2face.types import Progress, ignore_progress
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.tracking import FaceTracker

SENTENCES = (
    "Thank you for calling. Your order was sent on Tuesday, and it should reach you within three days.",
    "When the rain finally stopped, the children ran out into the garden, and jumped into every puddle.",
    "Photosynthesis turns light into sugar. Plants take in water, and they release the oxygen that we breathe.",
    "No, that is simply not true. You promised to fix the roof, and now it is leaking again.",
)
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
    scores : (F, 52)
        Blendshape scores of the frames in which a face was found.
    smile : (T,)
        Weight of the smile shapes, mean of both sides.
    blinks_per_minute, yaw_spread_deg
        Rate of blinks, and standard deviation of the head's yaw in degrees.
    frames : (F', H, W, 3)
        Three frames of the clip.
    """

    scores: FloatArray
    smile: FloatArray
    blinks_per_minute: float
    yaw_spread_deg: float
    frames: NDArray[np.uint8]

    @property
    def features(self) -> FloatArray:
        """(104,) mean and standard deviation of each score over the clip."""
        return np.concatenate([self.scores.mean(axis=0), self.scores.std(axis=0)])


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

    def read(self, mood: str, seed: int) -> MoodClip:
        options = self._options
        text = options.sentences[seed % len(options.sentences)]
        clip = self._session.clip(text, style=mood, seed=options.first_seed + seed)
        numbers = np.linspace(0, len(clip.motion) - 1, options.frames + 2).round().astype(int)[1:-1]
        pictures = [np.asarray(self._renderer.frame(clip, int(number)))[..., :3] for number in numbers]
        read = [self._tracker.read(np.ascontiguousarray(picture)) for picture in pictures]
        scores = [self._scores.blendshape_scores(points) for points, found in read if found > 0]
        if not scores:
            raise BackendError(f"the tracker finds no face in a clip of {mood}; choose a larger picture")
        kept = np.linspace(0, len(pictures) - 1, 3).round().astype(int)
        shut = clip.motion.columns(SHUT_SHAPES).astype(np.float64)
        return MoodClip(
            np.array(scores, np.float64),
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
    training_frames = [np.concatenate([clip.scores for clip in mood[:n_training]]) for mood in clips.values()]
    testing_frames = [np.concatenate([clip.scores for clip in mood[n_training:]]) for mood in clips.values()]
    return confusion_matrix(training, testing), confusion_matrix(training_frames, testing_frames)


def confusion_matrix(training: Sequence[FloatArray], testing: Sequence[FloatArray]) -> NDArray[np.int64]:
    """Confusion (M, M) of a nearest-mean classifier of M classes.

    Parameters
    ----------
    training, testing
        Features (n, d) of each class. Distances are in units of the spread within the classes of `training`.
    """
    means = np.stack([features.mean(axis=0) for features in training])
    within = np.concatenate([features - mean for features, mean in zip(training, means, strict=True)])
    scaled = means / (spread := np.sqrt(np.square(within).mean(axis=0)) + LEAST_SPREAD)
    confusion = np.zeros((len(means), len(means)), np.int64)
    for row, features in enumerate(testing):
        distances = np.square((features / spread)[:, None] - scaled).sum(axis=2)
        np.add.at(confusion, (row, distances.argmin(axis=1)), 1)
    return confusion
