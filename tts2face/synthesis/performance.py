"""A performer's take becomes a clip of any face, or of a talker's own; the original sound is kept."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.clock import exact_rate, first_sample
from tts2face.cloning.parameter_transfer import cloning, with_missing
from tts2face.models.face import Face
from tts2face.models.talker import Talker
from tts2face.own_face.appearance_regression import own_face
from tts2face.retargeting.performer import lip_model, performer
from tts2face.types import Clip, Speech, Trajectory, Waveform
from tts2face.video.livelink import Capture
from tts2face.video.take import Take

PIECE_FRAMES = 300  # of the clips that a long take is given on in


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What a face and its head do, on one clock."""

    face: Trajectory
    head: Trajectory


def motion_of_take(take: Take, face: Face, *, gain: float = 1.0) -> Motion:
    """A take carried to a face.

    Raises
    ------
    DataError
        The take is too short, or the face lacks landmarks or shapes.
    """
    ready = performer(take.landmarks, take.scores, face)
    return Motion(ready.weights(take.landmarks, take.scores, gain=gain), take.head)


def able_to_follow(take: Take, talker: Talker) -> Talker:
    """The talker with the motion of lips that the take shows and she never made (T07, section 3.1)."""
    return with_missing(lip_model(take.landmarks), talker)


def motion_of_own(take: Take, talker: Talker, *, gain: float = 1.0) -> Motion:
    """A take carried to a talker's own face: cloned by inner products (T07 eq. 5), with the looks of her lips.

    Raises
    ------
    InputError
        The talker has motion only.
    """
    model = lip_model(take.landmarks)
    speech = Trajectory(tuple(f"shape{i}" for i in range(model.n_speech)), model.parameters(take.landmarks), take.fps)
    hers = cloning(model, talker.model, gain=gain).clone(speech)
    return Motion(own_face(talker).motion(hers), take.head)


def motion_of_capture(capture: Capture, face: Face, *, gain: float = 1.0) -> Motion:
    """An ARKit capture on a face: shapes of the same name take its weights, within their limits."""
    weights = np.zeros((len(capture.weights), len(face.shape_names)), np.float32)
    for column, name in enumerate(face.shape_names):
        if name in capture.weights.channels:
            moved = capture.weights.values[:, capture.weights.channels.index(name)]
            size = 1.0 if name.startswith("eye") else gain
            weights[:, column] = np.clip(size * moved, *face.limits[column])
    return Motion(Trajectory(face.shape_names, weights, capture.weights.fps), capture.head)


def at_rate(motion: Motion, fps: float) -> Motion:
    """Motion read at another frame rate, straight between its frames."""
    old = motion.face.fps
    if exact_rate(fps) == exact_rate(old):
        return motion
    n_frames = max(1, int(np.floor((len(motion.face) - 1) / old * fps + 1e-6)) + 1)
    at = np.minimum(np.arange(n_frames) / fps * old, len(motion.face) - 1)

    def read(trajectory: Trajectory) -> Trajectory:
        low = at.astype(int)
        high = np.minimum(low + 1, len(trajectory) - 1)
        share = (at - low)[:, None].astype(np.float32)
        return Trajectory(
            trajectory.channels, (1 - share) * trajectory.values[low] + share * trajectory.values[high], fps
        )

    return Motion(read(motion.face), read(motion.head))


def clips_of(motion: Motion, sound: Waveform) -> Iterator[Clip]:
    """Motion and its sound as clips of at most `PIECE_FRAMES` frames; sound that is too short ends in silence."""
    fps = exact_rate(motion.face.fps)
    for first in range(0, len(motion.face), PIECE_FRAMES):
        last = min(first + PIECE_FRAMES, len(motion.face))
        begin, end = (first_sample(frame, sound.rate, fps) for frame in (first, last))
        samples = np.zeros(end - begin, np.float32)
        heard = sound.samples[begin:end]
        samples[: len(heard)] = heard
        speech = Speech(Waveform(samples, sound.rate), PhoneSequence([SILENCE], [0.0, len(samples) / sound.rate]), ())
        here = slice(first, last)
        yield Clip(_part(motion.face, here), _part(motion.head, here), speech)


def _part(trajectory: Trajectory, frames: slice) -> Trajectory:
    return Trajectory(trajectory.channels, trajectory.values[frames], trajectory.fps)
