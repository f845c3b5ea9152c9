"""Rotations of the neck, head and eye bones of a character's file, as tracks of an animation."""

import numpy as np

from tts2face.face.deformation import head_rotation, rotation_matrix
from tts2face.interchange.characters.binding import CharacterBinding
from tts2face.interchange.characters.character import Character
from tts2face.interchange.gltf.nodes import NodeTree
from tts2face.interchange.gltf.reader import GltfFile
from tts2face.interchange.gltf.writer import GlbWriter
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, continuous_quaternions, matrix_quaternion
from tts2face.types import Trajectory

Track = tuple[int, str, FloatArray]  # node, path and rows of an animation
HEAD_NODE = "tts2face_head"
# Share of the head's rotation that the neck bone takes, a convention of character rigs. The spine below the second
# vertebra takes 19 % (standard deviation 7 %) of a turn to the side, and more of a nod (In vivo primary and coupled
# segmental motions of the healthy female head-neck complex during dynamic head axial rotation, 2021, C2 to T1).
# between the 19 % of turns that the lower spine takes and its larger share of nods (decision 080)
NECK_SHARE = 0.4
MAX_OFFSET_MM = 2.0  # between the origin of an eye bone and the centre of its eyeball, up to which it only rotates


class BoneTracks:
    """Tracks of the rotations of eye and head bones."""

    def __init__(
        self, face: Face, binding: CharacterBinding, character: Character, tree: NodeTree, writer: GlbWriter
    ) -> None:
        self._face = face
        self._character = character
        self._tree = tree
        self._writer = writer
        self._binding = binding
        turn = float(np.radians(binding.yaw_deg))
        self._turn = head_rotation(0.0, turn, 0.0)  # from the file's axes to the face's
        self._names: dict[int, str] = {}

    def name_of(self, node: int) -> str:
        """Name of an animated bone."""
        return self._names.get(node, HEAD_NODE)

    def eye_tracks(self, motion: Trajectory) -> list[Track]:
        """Rotations of the bones of the eyeballs, which gaze shapes turn."""
        places = {
            bone: self._turn @ place for bone, place in self._character.bone_places.items() if bone.endswith("Eye")
        }
        if len(places) < 2:
            return []
        left, right = sorted(places, key=lambda name: (-float(places[name][0].round(9)), name))
        tracks = []
        for eye in self._face.eyes:
            vectors = np.zeros((len(motion), 3))
            for name, turn in eye.turns.items():
                if name in motion.channels:
                    vectors += motion.values[:, motion.channels.index(name), None] * turn
            rotations = np.stack([rotation_matrix(vector) for vector in vectors])
            bone = left if eye.centre[0] > 0 else right
            centre = self._turn.T @ (eye.centre.astype(np.float64) / self._binding.scale + self._binding.origin)
            tracks += [self._rotation_track(bone, rotations), *self._shift_tracks(bone, rotations, centre)]
        return tracks

    def head_tracks(self, head: Trajectory, file: GltfFile) -> list[Track]:
        """Rotations of the neck's and head's bones; without a head bone, the motion of a node above the scene.

        The head's orientation is that of the pose; the neck takes `NECK_SHARE` of it where it is a parent of the head.
        """
        rotations = np.stack([head_rotation(*(float(x) for x in pose[:3])) for pose in head.values])
        # a neck beside the head's bone would not carry it
        if "head" in self._character.bones and self._has_neck():
            neck = np.stack([share_of_rotation(rotation, NECK_SHARE) for rotation in rotations])
            rest = np.einsum("tji,tjk->tik", neck, rotations)
            return [self._rotation_track("neck", neck), self._rotation_track("head", rest)]
        if "head" in self._character.bones:
            return [self._rotation_track("head", rotations)]
        scenes = file.entries("scenes")
        if not scenes:
            return []
        node = self._writer.add_node_above(HEAD_NODE, file.root.index("scene", len(scenes), "scenes") or 0)
        scale = self._binding.scale
        pivot = np.array(self._binding.origin) + self._face.pivot.astype(np.float64) / scale
        shift = head.values[:, 3:].astype(np.float64) / scale
        moved = (pivot - np.einsum("tij,j->ti", rotations, pivot) + shift) @ self._turn
        turned = np.einsum("ji,tjk,kl->til", self._turn, rotations, self._turn)
        return [(node, "rotation", quaternions(turned)), (node, "translation", moved)]

    def _has_neck(self) -> bool:
        """Whether the neck's bone is above the head's."""
        parents, node = self._character.parents, self._character.bones["head"]
        while node in parents:
            node = parents[node]
            if node == self._character.bones.get("neck"):
                return True
        return False

    def _shift_tracks(self, bone: str, rotations: FloatArray, centre: FloatArray) -> list[Track]:
        """Local translation (T, 3) of a node whose origin is not the centre (3,) that it turns about, in file units."""
        node = self._character.bones[bone]
        place = self._tree.world[node][:3, 3]
        if np.linalg.norm(place - centre) * self._binding.scale < MAX_OFFSET_MM:
            return []
        turned = np.einsum("ji,tjk,kl->til", self._turn, rotations, self._turn)
        moved = centre + turned @ (place - centre)
        parent = self._character.parents.get(node)
        above = np.eye(4) if parent is None else self._tree.world[parent]
        inverse = np.linalg.pinv(above)
        return [(node, "translation", moved @ inverse[:3, :3].T + inverse[:3, 3])]

    def _rotation_track(self, bone: str, rotations: FloatArray) -> Track:
        """Local rotations (T, 4) of a bone turned by rotations (T, 3, 3) in the face's axes."""
        node = self._character.bones[bone]
        self._writer.divide_matrix(node)
        self._names[node] = bone
        world = _orthonormal(self._tree.world[node])
        parent = self._character.parents.get(node)
        above = np.eye(3) if parent is None else _orthonormal(self._tree.world[parent])
        turned = np.einsum("ji,tjk,kl->til", self._turn, rotations, self._turn)
        return node, "rotation", quaternions(np.einsum("ji,tjk,kl->til", above, turned, world))


def share_of_rotation(rotation: FloatArray, share: float) -> FloatArray:
    """Rotation matrix (3, 3) about the axis of another one, by a share of its angle."""
    x, y, z, w = matrix_quaternion(rotation)
    vector = np.array([x, y, z]) * (1.0 if w >= 0 else -1.0)
    sine = float(np.linalg.norm(vector))
    angle = 2.0 * np.arctan2(sine, abs(w))
    return rotation_matrix(vector * (share * angle / sine) if sine > 0 else vector)


def quaternions(rotations: FloatArray) -> FloatArray:
    """Quaternions (T, 4) of rotation matrices (T, 3, 3), each with the sign nearest to the one before."""
    return continuous_quaternions(np.stack([matrix_quaternion(rotation) for rotation in rotations]), None)


def _orthonormal(matrix: FloatArray) -> FloatArray:
    scaled = matrix[:3, :3] / np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-12)
    return np.asarray(scaled, np.float64)
