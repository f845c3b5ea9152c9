"""A mesh face prepared for one talker; implements `tts2face.synthesis.animated_face.AnimatedFace`."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.exemplar.synthesis import ExemplarModel, TokenSelection, blend_trajectory
from tts2face.face.face_motion import moved_landmarks
from tts2face.face.gesture_transfer import GestureFace, gesture_face
from tts2face.models.face import Face
from tts2face.models.palette import Palette
from tts2face.models.talker import Talker
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.retargeting.articulation import DEFAULT_ARTICULATION, Articulator, build_articulator
from tts2face.retargeting.to_face import Retargeter, build_retargeter
from tts2face.synthesis.animated_face import NO_PALETTE, AnimatedFace, FaceMotion, Gestures
from tts2face.types import GiveWay, Trajectory, keep_on

if TYPE_CHECKING:
    from tts2face.video.livelink import FaceCapture
    from tts2face.video.take import Take


@dataclass(frozen=True, slots=True, eq=False)
class MeshFace:
    """A mesh to whose shapes the talker's motion is retargeted; `gestures` is None without a palette."""

    default_styles: ClassVar[Mapping[str, str]] = MappingProxyType({})
    face: Face
    exemplars: ExemplarModel
    retargeter: Retargeter
    articulator: Articulator
    gestures: GestureFace | None

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the face's own shapes, then of those that the palette adds."""
        return self.mesh.shape_names

    @property
    def limits(self) -> NDArray[np.float32]:
        """(K, 2) limits of the shapes."""
        return self.mesh.limits

    @property
    def mesh(self) -> Face:
        """Mesh with the shapes of all channels."""
        return self.face if self.gestures is None else self.gestures.face

    def motion_of_tokens(
        self, selection: TokenSelection, *, fps: float, n_frames: int, give_way: GiveWay = keep_on
    ) -> Trajectory:
        """Shape weights (`n_frames`, K) from selected tokens of the talker."""
        lips = blend_trajectory(selection, self.exemplars, fps=fps, n_frames=n_frames, give_way=give_way)
        weights, options = self.retargeter.retarget(lips), selection.options
        if not options.contacts and options.articulation is None:
            return weights
        give_way()
        factor = DEFAULT_ARTICULATION if options.articulation is None else options.articulation
        return self.articulator.articulate(weights, selection.phones, factor)

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Shape weights (T, K) from the talker's speech parameters (T, S)."""
        return self.retargeter.retarget(speech)

    def motion_of_take(self, take: "Take", *, gain: float = 1.0) -> Trajectory:
        """Shape weights (T, K) of a performer: lips by least squares on landmarks, eyes and brows from scores."""
        from tts2face.retargeting.performer import build_performer_retargeter

        retargeter = build_performer_retargeter(take.landmarks, take.scores, self.face)
        return retargeter.weights(take.landmarks, take.scores, gain=gain)

    def motion_of_capture(self, capture: "FaceCapture", *, gain: float = 1.0) -> Trajectory:
        """Shape weights (T, K) of an ARKit capture, matched by name; the gain does not apply to the gaze."""
        from tts2face.retargeting.performer import match_shapes

        return match_shapes(capture.weights, self.face, gain=gain)

    def with_motion_of(self, take: "Take") -> "AnimatedFace":
        """Raise InputError: the shapes of a mesh are fixed."""
        del take
        raise InputError("missing motion can be appended to a talker's own face only; choose --face self")

    def landmarks(self, motion: Trajectory) -> NDArray[np.float32]:
        """Landmarks (T, 478, 3) of the mesh, mm, for weights of its first or all shapes."""
        return moved_landmarks(self.mesh, motion)

    def check_articulation(self, factor: float | None) -> None:
        """Accept all factors: a mesh can round and spread further than the talker."""

    def check_gains(self, gains: Mapping[str, float]) -> None:
        """Accept all gains: a mesh can move every feature."""

    def with_gestures_of(self, palette: Palette) -> "MeshFace":
        """The face with the shapes that a palette's gestures need."""
        return replace(self, gestures=gesture_face(self.face, palette))

    def add_gestures(self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float]) -> FaceMotion:
        """Add gestures to speech motion; closed lips stay closed."""
        if self.gestures is None:
            raise InputError(NO_PALETTE)
        performance = self.gestures.perform(speech, gestures, gains)
        return FaceMotion(performance.motion, performance.head)

    def renderer(self, picture: Picture) -> FrameRenderer:
        """Create the renderer of the mesh."""
        from tts2face.render.draw import mesh_renderer  # exports draw nothing
        from tts2face.render.visible_mark import marked

        return marked(mesh_renderer(self.mesh, picture))


def mesh_face(talker: Talker, exemplars: ExemplarModel, face: Face) -> MeshFace:
    """Prepare a mesh for a talker, without gestures.

    Raises
    ------
    DataError
        The face lacks landmarks of the lips or eyes, or shapes that speech can move.
    """
    return MeshFace(face, exemplars, build_retargeter(talker, face), build_articulator(face), None)
