"""Step of edits by hand: offsets for channels of a face and of its head pose."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.gestures.elements import ChannelEdit, interpolate_keys
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.speech_stream import Piece
from tts2face.types import HEAD_CHANNELS, Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class ChannelEdits:
    """Step: offsets for channels of a face and of its head pose, clipped to the limits of the face's shapes."""

    edits: tuple[ChannelEdit, ...]
    face: AnimatedFace

    def __post_init__(self) -> None:
        """Refuse channels that the face does not have."""
        known = (*self.face.channels, *HEAD_CHANNELS)
        for edit in self.edits:
            if edit.channel not in known:
                raise InputError(f"this face has no channel {edit.channel!r} to edit; choose one of {', '.join(known)}")

    def __call__(self, piece: Piece) -> Piece:
        """The piece with the offsets added."""
        if not self.edits:
            return piece
        clip, limits = piece.clip, self.face.limits
        times = (round(piece.begin * clip.fps) + np.arange(len(clip.motion))) / clip.fps
        face, head = (_offset(motion, self.edits, times) for motion in (clip.motion, clip.head))
        clipped = np.clip(face.values, limits[: len(face.channels), 0], limits[: len(face.channels), 1])
        edited = [face.channels.index(edit.channel) for edit in self.edits if edit.channel in face.channels]
        values = face.values.copy()
        values[:, edited] = clipped[:, edited]
        return replace(piece, clip=replace(clip, motion=replace(face, values=values), head=head))


def _offset(motion: Trajectory, edits: Sequence[ChannelEdit], times: NDArray[np.float64]) -> Trajectory:
    values = motion.values.copy()
    for edit in edits:
        if edit.channel in motion.channels:
            values[:, motion.channels.index(edit.channel)] += interpolate_keys(times, edit.keys).astype(np.float32)
    return replace(motion, values=values)
