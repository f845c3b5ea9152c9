"""Corrections of finished motion by hand: offsets of single channels through key points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lexicon.errors import InputError
from tts2face.gesture.elements import ChannelEdit, interpolate_keys
from tts2face.synthesis.animated_face import AnimatedFace, FaceMotion
from tts2face.types import HEAD_CHANNELS, Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class ChannelEdits:
    """Offsets for channels of a face and of its head pose, clipped to the limits of the face's shapes."""

    edits: tuple[ChannelEdit, ...]
    face: AnimatedFace

    def __post_init__(self) -> None:
        """Refuse channels that the face does not have.

        Raises
        ------
        InputError
            There is no such channel.
        """
        known = (*self.face.channels, *HEAD_CHANNELS)
        for edit in self.edits:
            if edit.channel not in known:
                raise InputError(f"this face has no channel {edit.channel!r} to edit; choose one of {', '.join(known)}")

    def apply(self, motion: FaceMotion, first_frame: int) -> FaceMotion:
        """Motion with the offsets added; its first frame is frame `first_frame` of the clip."""
        if not self.edits:
            return motion
        times = (first_frame + np.arange(len(motion.face))) / motion.face.fps
        limits = self.face.limits
        face = _offset(motion.face, self.edits, times)
        clipped = np.clip(face.values, limits[: len(face.channels), 0], limits[: len(face.channels), 1])
        edited = [face.channels.index(edit.channel) for edit in self.edits if edit.channel in face.channels]
        values = face.values.copy()
        values[:, edited] = clipped[:, edited]
        return FaceMotion(replace(face, values=values), _offset(motion.head, self.edits, times))


def _offset(motion: Trajectory, edits: Sequence[ChannelEdit], times: np.ndarray) -> Trajectory:
    values = motion.values.copy()
    for edit in edits:
        if edit.channel in motion.channels:
            values[:, motion.channels.index(edit.channel)] += interpolate_keys(times, edit.keys).astype(np.float32)
    return replace(motion, values=values)
