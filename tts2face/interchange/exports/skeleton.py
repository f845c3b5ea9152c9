"""Skeleton of an exported head: a root that stays still, the head, and the eyeballs.

A vertex follows the head with its share of `tts2face.face.deformation.head_share`, and an eyeball its own joint, so
that linear blend skinning gives the same vertices as the renderer.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import head_share
from tts2face.models.face import Face
from tts2face.numeric.arrays import Float32Array, quaternion_product, rotation_quaternions
from tts2face.types import HEAD_CHANNELS

ROOT, HEAD = 0, 1  # the first two joints; the eyes follow


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """Joints of a face.

    Parameters
    ----------
    names, places : (J,), (J, 3)
        Joints and their places at rest in mm.
    joints, weights : (V, 2)
        Joints that each vertex follows, and their weights, which add up to 1.
    eye_turns : (J - 2, K, 3)
        Rotation vector per weight of each channel, radians.
    """

    names: tuple[str, ...]
    places: NDArray[np.float64]
    joints: NDArray[np.uint8]
    weights: NDArray[np.float32]
    eye_turns: NDArray[np.float64]

    def head_rotations(self, head: Float32Array) -> NDArray[np.float64]:
        """Quaternions (T, 4) x, y, z, w of the head joint: roll first, then pitch, then yaw."""
        pitch, yaw, roll = (head[:, HEAD_CHANNELS.index(name)].astype(np.float64) for name in ("pitch", "yaw", "roll"))
        still = np.zeros(len(head))
        about_x = rotation_quaternions(np.column_stack([pitch, still, still]))
        about_y = rotation_quaternions(np.column_stack([still, yaw, still]))
        about_z = rotation_quaternions(np.column_stack([still, still, roll]))
        return quaternion_product(about_y, quaternion_product(about_x, about_z))

    def head_places(self, head: Float32Array) -> NDArray[np.float64]:
        """Places (T, 3) of the head joint in mm."""
        places: NDArray[np.float64] = self.places[HEAD] + head[:, [HEAD_CHANNELS.index(axis) for axis in "xyz"]]
        return places

    def eye_rotations(self, motion: Float32Array, eye: int) -> NDArray[np.float64]:
        """Quaternions (T, 4) of an eyeball."""
        turns = self.eye_turns[eye]
        used = np.flatnonzero(turns.any(axis=1))
        return rotation_quaternions(motion[:, used].astype(np.float64) @ turns[used])


def build_skeleton(face: Face, n_channels: int) -> Skeleton:
    """Skeleton of a face for the motion of its first channels."""
    follow = head_share(face)
    joints = np.tile(np.array([[ROOT, HEAD]], np.uint8), (len(follow), 1))
    turns = np.zeros((len(face.eyes), n_channels, 3))
    for number, eye in enumerate(face.eyes):
        joints[eye.first : eye.first + eye.count, 1] = HEAD + 1 + number
        for name, turn in eye.turns.items():
            at = face.shape_names.index(name)
            if at < n_channels:
                turns[number, at] = turn
    weights = np.column_stack([1 - follow, follow])
    names = ["root", "head", *_eye_names(face)]
    places = np.array([np.zeros(3), face.pivot, *(eye.centre for eye in face.eyes)], np.float64)
    return Skeleton(tuple(names), places, np.where(weights > 0, joints, ROOT).astype(np.uint8), weights, turns)


def _eye_names(face: Face) -> list[str]:
    sides = ["leftEye" if eye.centre[0] > 0 else "rightEye" for eye in face.eyes]
    return sides if len(set(sides)) == len(sides) else [f"eye{number}" for number in range(len(sides))]
