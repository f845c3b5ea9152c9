"""What can be animated and shown: one protocol, a mesh face and a talker's own face.

An animated face belongs to one talker: it turns that talker's lip motion into motion of its own channels, lays gestures
over it, and makes the renderer that draws its frames. No code outside this module asks which of the two it is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.cloning.parameter_transfer import build_parameter_transfer, extend_talker
from tts2face.exemplar.appearance_trajectory import (
    AppearanceExemplars,
    appearance_trajectory,
    build_appearance_exemplars,
)
from tts2face.exemplar.synthesis import ExemplarModel, TokenSelection, blend_trajectory
from tts2face.face.gesture_transfer import SPEECH_GAINS, GestureFace, gesture_face
from tts2face.models.face import Face
from tts2face.models.palette import Palette
from tts2face.models.talker import Talker
from tts2face.own_face.appearance_regression import AppearanceRegression, fit_appearance_regression
from tts2face.own_face.gestures import OwnFaceGestures, build_own_face_gestures
from tts2face.render.draw import mesh_renderer
from tts2face.render.own_face import own_face_renderer
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.retargeting.performer import build_performer_retargeter, lip_model, match_shapes
from tts2face.retargeting.to_face import Retargeter, build_retargeter
from tts2face.types import HEAD_CHANNELS, Trajectory
from tts2face.video.livelink import FaceCapture
from tts2face.video.take import Take

FIXED_FEATURES = ("gaze", "head", *SPEECH_GAINS)  # on a talker's own video they cannot be moved

Gestures = Mapping[str, NDArray[np.float32]]


@dataclass(frozen=True, slots=True, eq=False)
class FaceMotion:
    """Motion (T, K) of a face's channels and of its head (T, 6), on one clock."""

    face: Trajectory
    head: Trajectory


class AnimatedFace(Protocol):
    """A face made ready for one talker; serves any number of clips and threads."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels that it can move. The motion of a clip is in all of them, or in the first ones."""

    @property
    def mesh(self) -> Face:
        """The mesh with the shapes of all channels; InputError where the face has none."""

    def motion_of_tokens(self, selection: TokenSelection, *, fps: float, n_frames: int) -> Trajectory:
        """Motion of speech from selected tokens of the talker."""

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Motion of speech from the talker's speech parameters (T, S)."""

    def motion_of_take(self, take: Take, *, gain: float = 1.0) -> Trajectory:
        """Motion of a performer in a video.

        Raises
        ------
        DataError
            The take is too short, or the face lacks landmarks or shapes.
        """

    def motion_of_capture(self, capture: FaceCapture, *, gain: float = 1.0) -> Trajectory:
        """Motion of an ARKit capture: shapes of the same name take its weights, within their limits.

        Raises
        ------
        InputError
            The face has no such shapes.
        """

    def with_motion_of(self, take: Take) -> "AnimatedFace":
        """The face with the motion of lips that a take shows and its talker's recordings lack (T07, section 3.1).

        Raises
        ------
        InputError
            The face cannot be extended.
        """

    def check_gains(self, gains: Mapping[str, float]) -> None:
        """Refuse gains of features that this face cannot move (InputError)."""

    def add_gestures(self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float]) -> FaceMotion:
        """Motion of speech with gestures.

        Parameters
        ----------
        gestures
            (T, k) values of features of the palette, in its units.
        gains
            Factors on the motion of features.

        Raises
        ------
        InputError
            The speech is not in the channels of this face, or a feature does not fit its frames.
        """

    def renderer(self, picture: Picture) -> FrameRenderer:
        """What draws this face.

        Raises
        ------
        InputError, BackendError
            The face cannot be drawn in this way, or the machine lacks the renderer.
        """


@dataclass(frozen=True, slots=True, eq=False)
class MeshFace:
    """A mesh face: the talker's motion is retargeted to its shapes. Without a palette it has no gestures."""

    face: Face
    voice: ExemplarModel
    retargeter: Retargeter
    gestures: GestureFace | None

    @property
    def channels(self) -> tuple[str, ...]:
        """The face's own shapes, then those that a palette adds."""
        return self.mesh.shape_names

    @property
    def mesh(self) -> Face:
        """The face with the shapes of all channels."""
        return self.face if self.gestures is None else self.gestures.face

    def motion_of_tokens(self, selection: TokenSelection, *, fps: float, n_frames: int) -> Trajectory:
        """Motion of speech from selected tokens of the talker."""
        return self.retargeter.retarget(blend_trajectory(selection, self.voice, fps=fps, n_frames=n_frames))

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Motion of speech from the talker's speech parameters."""
        return self.retargeter.retarget(speech)

    def motion_of_take(self, take: Take, *, gain: float = 1.0) -> Trajectory:
        """Motion of a performer in a video: lips by least squares on landmarks, eyes and brows by their scores."""
        return build_performer_retargeter(take.landmarks, take.scores, self.face).weights(
            take.landmarks, take.scores, gain=gain
        )

    def motion_of_capture(self, capture: FaceCapture, *, gain: float = 1.0) -> Trajectory:
        """Motion of an ARKit capture, by the names of shapes; eyes turn as captured, whatever the gain."""
        return match_shapes(capture.weights, self.face, gain=gain)

    def with_motion_of(self, take: Take) -> "AnimatedFace":
        """A mesh has the shapes that its file holds (InputError)."""
        del take
        raise InputError("missing motion can be appended to a talker's own face only; choose --face self")

    def check_gains(self, gains: Mapping[str, float]) -> None:
        """All features of a mesh can be moved."""

    def add_gestures(self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float]) -> FaceMotion:
        """Motion of speech with gestures; closed lips stay closed."""
        if self.gestures is None:
            raise InputError("this face was made without a palette, so it has no gestures; make it with one")
        performance = self.gestures.perform(speech, gestures, gains)
        return FaceMotion(performance.motion, performance.head)

    def renderer(self, picture: Picture) -> FrameRenderer:
        """What draws the mesh."""
        return mesh_renderer(self.mesh, picture)


@dataclass(frozen=True, slots=True, eq=False)
class OwnAppearanceFace:
    """A talker's own face, drawn on the talker's own video; gaze and head move as in that video."""

    talker: Talker
    voice: ExemplarModel
    looks: AppearanceExemplars
    regression: AppearanceRegression
    gestures: OwnFaceGestures | None

    @property
    def channels(self) -> tuple[str, ...]:
        """Speech parameters, appearance parameters, and those of the gestures of a palette."""
        added = () if self.gestures is None else self.gestures.channels
        return self.regression.speech + self.regression.looks + added

    @property
    def mesh(self) -> Face:
        """A talker's own face is drawn from pictures and has no mesh (InputError)."""
        raise InputError("a talker's own face has no mesh; choose --face head, cartoon or a .face file")

    def motion_of_tokens(self, selection: TokenSelection, *, fps: float, n_frames: int) -> Trajectory:
        """Motion of speech, and the appearance of the very tokens that move the lips."""
        lips = blend_trajectory(selection, self.voice, fps=fps, n_frames=n_frames)
        looks = appearance_trajectory(selection, self.looks, fps=fps, n_frames=n_frames)
        return Trajectory(lips.channels + looks.channels, np.concatenate([lips.values, looks.values], axis=1), fps)

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Motion of speech, with the appearance that goes with such lips in the recordings."""
        return self.regression.motion(speech)

    def motion_of_take(self, take: Take, *, gain: float = 1.0) -> Trajectory:
        """Motion of a performer, cloned by inner products (Theobald et al. 2007, eq. 5)."""
        model = lip_model(take.landmarks)
        names = tuple(f"shape{i}" for i in range(model.n_speech))
        speech = Trajectory(names, model.parameters(take.landmarks), take.fps)
        return self.regression.motion(build_parameter_transfer(model, self.talker.model, gain=gain).clone(speech))

    def motion_of_capture(self, capture: FaceCapture, *, gain: float = 1.0) -> Trajectory:
        """A capture has no landmarks to clone (InputError)."""
        del capture, gain
        raise InputError(
            "a Live Link Face capture holds no landmarks, which a talker's own face needs; choose --face head, cartoon "
            "or a .face file"
        )

    def with_motion_of(self, take: Take) -> "AnimatedFace":
        """The talker's own face, with more modes of its shape model."""
        talker = extend_talker(lip_model(take.landmarks), self.talker)
        return replace(self, talker=talker, regression=fit_appearance_regression(talker))

    def check_gains(self, gains: Mapping[str, float]) -> None:
        """Refuse gains of what the talker's video shows as it is."""
        for name in gains:
            if name in FIXED_FEATURES:
                raise InputError(
                    f"a talker's own face is drawn on the talker's video, whose {name} cannot be changed; remove the "
                    f"gain of {name}"
                )

    def add_gestures(self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float]) -> FaceMotion:
        """Motion of speech with gestures of lids, brows, cheeks and expression; the head's channels stay 0."""
        if self.gestures is None:
            raise InputError("this face was made without a palette, so it has no gestures; make it with one")
        return FaceMotion(self.gestures.motion(speech, gestures, gains), resting_head(len(speech), speech.fps))

    def renderer(self, picture: Picture) -> FrameRenderer:
        """What draws the face on the talker's video."""
        return own_face_renderer(self.talker, picture, self.gestures)


def mesh_face(talker: Talker, voice: ExemplarModel, face: Face, palette: Palette | None) -> MeshFace:
    """Prepare a mesh face for a talker, and for the gestures of a palette.

    Raises
    ------
    DataError
        The face lacks landmarks of the lips or eyes, or shapes that speech could move.
    """
    gestures = None if palette is None else gesture_face(face, palette)
    return MeshFace(face, voice, build_retargeter(talker, face), gestures)


def own_appearance_face(talker: Talker, voice: ExemplarModel, palette: Palette | None) -> OwnAppearanceFace:
    """Prepare a talker's own face, and for the gestures of a palette.

    Raises
    ------
    InputError
        The talker has motion only.
    """
    gestures = None if palette is None else build_own_face_gestures(talker, palette)
    return OwnAppearanceFace(
        talker, voice, build_appearance_exemplars(talker, voice), fit_appearance_regression(talker), gestures
    )


def resting_head(n_frames: int, fps: float) -> Trajectory:
    """A head that does not move."""
    return Trajectory(HEAD_CHANNELS, np.zeros((n_frames, len(HEAD_CHANNELS)), np.float32), fps)
