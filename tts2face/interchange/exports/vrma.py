"""Animation of a clip for VRM avatars: vowels, blinks, head and gaze (VRM Animation 1.0).

A face that was imported from a VRM gives weights of that file's own expressions; any other face the vowels aa, ih, ou,
ee, oh, of whose mouths that of the clip is like, and blinks.
"""

from pathlib import Path

import numpy as np

from tts2face.face.deformation import rotation_matrix
from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.face.mouth import CORNERS_LEFT, CORNERS_RIGHT, mouth_products
from tts2face.face.shape_transfer import default_head
from tts2face.face.stand_in import viseme_table
from tts2face.interchange.characters.animation import ANIMATION, expression_motion, held
from tts2face.interchange.characters.binding import has_binding
from tts2face.interchange.characters.bone_tracks import quaternions
from tts2face.interchange.characters.vrm_motion import gaze_turns, head_turns
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, build_arkit_projection
from tts2face.interchange.exports.livelink import eye_angles
from tts2face.interchange.exports.parts import Part, Target
from tts2face.interchange.exports.spooled_frames import SpooledFrames
from tts2face.interchange.gltf.container import key_times
from tts2face.interchange.gltf.fields import Fields
from tts2face.interchange.gltf.reader import GltfFile
from tts2face.interchange.gltf.vrm_animation import VrmMotion, add_vrm_animation
from tts2face.interchange.gltf.writer import GlbWriter
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Trajectory

UNROUNDED, ROUNDED = ("aa", "ih", "ee", "oh"), "ou"
OPEN_ROUND = 0.5  # of what an oh as open as the lips narrows them, which is then no ou
LIKE = 0.05  # difference of two cosines of motion at which one vowel has e times the share of the other


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
        asset = {"version": "2.0", "generator": ANIMATION, "extras": {"fps": fps, "sound": self._target.sound_name}}
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
        return VrmMotion(_vowels(weights) | _blinks(weights), head_turns(head, with_neck=False), gaze)


def _vowels(weights: FloatArray) -> dict[str, FloatArray]:
    """Weights (T,) of vowels whose mouth is like that of weights (T, 52) of ARKit's shapes.

    Lips that narrow more than they open are ou. The rest is divided by the likeness of the mouth's motion to the other
    vowels, and opens the lips as far; closed lips are no vowel. Least squares on the motion would add ou to ih, whose
    widths cancel.
    """
    head, table = default_head(), viseme_table()
    names = [name for name in ARKIT_SHAPES if name.startswith(SPEECH_SHAPE_PREFIXES) and name in head.shape_names]
    rows = np.array([head.shape_names.index(name) for name in names])
    shown = weights[:, [ARKIT_SHAPES.index(name) for name in names]]
    made = np.array([[table[vowel].get(name, 0.0) for name in names] for vowel in (*UNROUNDED, ROUNDED)])
    motion = scatter_landmarks(head, landmark_motion(head, rows))
    opening = (motion[list(INNER_LIP_UPPER), 1] - motion[list(INNER_LIP_LOWER), 1]).mean(axis=0)
    width = motion[list(CORNERS_LEFT), 0].mean(axis=0) - motion[list(CORNERS_RIGHT), 0].mean(axis=0)
    gap = np.maximum(shown @ opening, 0.0)
    ajar = np.clip(gap / (made[-1] @ opening), 0.0, 1.0)
    open_round = made[UNROUNDED.index("oh")]
    narrowed = shown @ width - OPEN_ROUND * gap / (open_round @ opening) * (open_round @ width)
    rounded = ajar * np.clip(narrowed / (made[-1] @ width), 0.0, 1.0)
    products = mouth_products(head, rows)
    length = np.sqrt(np.einsum("ti,ij,tj->t", shown, products, shown))
    lengths = np.sqrt(np.einsum("ni,ij,nj->n", made[:-1], products, made[:-1]))
    likeness = shown @ products @ made[:-1].T / np.maximum(np.outer(length, lengths), 1e-9)
    shares = np.exp((likeness - likeness.max(axis=1, keepdims=True)) / LIKE)
    shares /= shares.sum(axis=1, keepdims=True)
    opened = np.clip(gap / (shares @ made[:-1] @ opening), 0.0, 1.0)
    unrounded = ((1.0 - rounded) * opened)[:, None] * shares
    return {**dict(zip(UNROUNDED, unrounded.T, strict=True)), ROUNDED: rounded}


def _blinks(weights: FloatArray) -> dict[str, FloatArray]:
    """Weights (T,) of blinks: what both lids do, and what one does beyond it, so that no lid closes twice."""
    left, right = (weights[:, ARKIT_SHAPES.index(f"eyeBlink{side}")] for side in ("Left", "Right"))
    both = np.minimum(left, right)
    return {"blink": both, "blinkLeft": left - both, "blinkRight": right - both}
