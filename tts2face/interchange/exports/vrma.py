"""Animation of a clip for VRM avatars: vowels, blinks, head and gaze (VRM Animation 1.0).

A face that was imported from a VRM gives weights of that file's own expressions; any other face the vowels aa, ih, ou,
ee, oh, of whose mouths that of the clip is like, and blinks.
"""

from pathlib import Path

import numpy as np

from tts2face.face.deformation import rotation_matrix
from tts2face.interchange.characters.animation import ANIMATION, expression_motion, held
from tts2face.interchange.characters.binding import has_binding
from tts2face.interchange.characters.bone_tracks import quaternions
from tts2face.interchange.characters.vrm_motion import gaze_turns, head_turns
from tts2face.interchange.exports.arkit import build_arkit_projection
from tts2face.interchange.exports.livelink import eye_angles
from tts2face.interchange.exports.parts import Part, Target
from tts2face.interchange.exports.spooled_frames import SpooledFrames
from tts2face.interchange.exports.vowels import blinks, vowel_projection
from tts2face.interchange.gltf.container import key_times
from tts2face.interchange.gltf.fields import Fields
from tts2face.interchange.gltf.reader import GltfFile
from tts2face.interchange.gltf.vrm_animation import VrmMotion, add_vrm_animation
from tts2face.interchange.gltf.writer import GlbWriter
from tts2face.storage.marks import PROGRAM, mark_fields
from tts2face.types import Trajectory


class VrmaWriter:
    """Keeps frames in temporary files, and writes the animation when their number is known."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self._projection = build_arkit_projection(target)
        self._frames = SpooledFrames(target.channels)

    def add(self, part: Part) -> None:
        """Append frames."""
        self._frames.add(part)

    def finish(self) -> None:
        """Write the file."""
        fps = float(self._target.fps)
        times = key_times(self._frames.n_frames, fps, self._frames.end_s)
        motion, head = (held(frames, len(times)) for frames in self._frames.trajectories(fps))
        scene = {"scene": 0, "scenes": [{"nodes": []}]}
        extras = {"fps": fps, "sound": self._target.sound_name, **mark_fields(self._target.mark)}
        asset = {"version": "2.0", "generator": PROGRAM, "extras": extras}
        name = self._target.name
        writer = GlbWriter(GltfFile(Path(name), Fields({"asset": asset, **scene}, name), None))
        tracks = add_vrm_animation(writer.root, self._vrm_motion(motion, head))
        writer.add_animation(ANIMATION, times, tracks)
        self._target.path.write_bytes(writer.content())

    def close(self) -> None:
        """Remove the temporary files."""
        self._frames.close()

    def _vrm_motion(self, motion: Trajectory, head: Trajectory) -> VrmMotion:
        face = self._target.face
        if face is not None and has_binding(face):
            own = expression_motion(motion, head, face)
            if own is not None:
                return own
        shown = self._projection.weights(motion.values)
        weights = shown.astype(np.float64)
        gaze = None if face is None else gaze_turns(motion, face)
        if gaze is None:
            # yaw to the right and pitch down, as Live Link counts them
            angles = (eye_angles(shown, "Left").astype(np.float64) + eye_angles(shown, "Right")) / 2
            turned = np.column_stack([angles[:, 1], -angles[:, 0], angles[:, 2]])
            gaze = quaternions(np.stack([rotation_matrix(vector) for vector in turned]))
        return VrmMotion(vowel_projection().weights(weights) | blinks(weights), head_turns(head, with_neck=False), gaze)
