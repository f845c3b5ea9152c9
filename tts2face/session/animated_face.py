"""Faces prepared for animation: the protocol, which a mesh and a talker's own face implement.

An animated face is prepared for one talker. It converts the talker's lip motion to its own channels, adds gestures, and
creates the renderer of its frames. `mesh_face` and `own_appearance_face` make the two kinds; all other code depends on
the protocol only.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.articulation import NATURAL
from tts2face.face.appearance_regression import AppearanceRegression, fit_appearance_regression
from tts2face.face.gestures import SPEECH_GAINS, GestureFace, gesture_face, smile_unevenness
from tts2face.face.landmarks import moved_landmarks
from tts2face.face.own_face import OwnFaceGestures, build_own_face_gestures
from tts2face.face.stand_in import stand_in
from tts2face.lips.articulation import DEFAULT_ARTICULATION, Articulator, build_articulator
from tts2face.lips.cloning import build_parameter_transfer, extend_talker
from tts2face.lips.exemplar import (
    AppearanceExemplars,
    ExemplarModel,
    TokenSelection,
    appearance_trajectory,
    blend_trajectory,
    build_appearance_exemplars,
)
from tts2face.lips.performer import build_performer_retargeter, lip_model, match_shapes
from tts2face.lips.retargeting import Retargeter, build_retargeter
from tts2face.models.face import Face
from tts2face.models.palette import MEASURED_STYLE, Palette
from tts2face.models.talker import Talker
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.options import Picture
from tts2face.picture.renderer import marked, mesh_renderer
from tts2face.processes.shared import shared
from tts2face.types import Trajectory, YieldTurn, keep_on, resting_head

if TYPE_CHECKING:
    from tts2face.video.livelink import FaceCapture
    from tts2face.video.take import Take


NO_PALETTE = "this face was prepared without a palette and has no gestures; prepare it with a palette"

Gestures = Mapping[str, NDArray[np.float32]]
FIXED_FEATURES = ("gaze", "head", *SPEECH_GAINS)  # features that a talker's own video fixes


@dataclass(frozen=True, slots=True, eq=False)
class FaceMotion:
    """Motion (T, K) of a face's channels and (T, 6) of its head, at the same frames."""

    face: Trajectory
    head: Trajectory


class AnimatedFace(Protocol):
    """A face prepared for one talker; immutable, for any number of clips and threads."""

    default_styles: ClassVar[Mapping[str, str]]  # of features that do not have the palette's default style

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all channels. The motion of a clip has all of them, or the first ones."""

    @property
    def limits(self) -> NDArray[np.float32]:
        """(K, 2) least and largest values of all channels; infinite where nothing limits them."""

    @property
    def mesh(self) -> Face:
        """Mesh with the shapes of all channels.

        Raises
        ------
        InputError
            The face has no mesh.
        """

    def motion_of_tokens(
        self, selection: TokenSelection, *, fps: float, n_frames: int, yield_turn: YieldTurn = keep_on
    ) -> Trajectory:
        """Speech motion (`n_frames`, K) from selected tokens; `yield_turn` is called between its steps."""

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Speech motion (T, K) from the talker's speech parameters (T, S)."""

    def motion_of_take(self, take: "Take", *, gain: float = 1.0) -> Trajectory:
        """Motion (T, K) of a performer tracked in a video; `gain` multiplies it."""

    def motion_of_capture(self, capture: "FaceCapture", *, gain: float = 1.0) -> Trajectory:
        """Motion (T, K) of an ARKit capture: shapes of the same name take its weights, clipped to their limits.

        Raises
        ------
        InputError
            The face has no such shapes.
        """

    def with_motion_of(self, take: "Take") -> "AnimatedFace":
        """Extend the face by the lip motion of a take that the talker's recordings lack (T07, section 3.1)."""

    def landmarks(self, motion: Trajectory) -> NDArray[np.float32]:
        """Landmarks (T, 478, 3) of the face, mm, moved by the first or all of its channels.

        Raises
        ------
        DataError
            The face lacks landmarks, or the motion is not of its channels.
        """

    def check_articulation(self, factor: float | None) -> None:
        """Reject a factor of articulation that this face cannot show; None is its own."""

    def check_gains(self, gains: Mapping[str, float]) -> None:
        """Reject gains of features that this face cannot move."""

    def with_gestures_of(self, palette: Palette) -> "AnimatedFace":
        """The face with the channels that the gestures of a palette need."""

    def add_gestures(
        self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float], seed: int = 0
    ) -> FaceMotion:
        """Add gestures to speech motion.

        Parameters
        ----------
        speech : (T, K)
            Speech motion in channels of this face.
        gestures
            (T, k) values of each feature of the palette, in the palette's units.
        gains
            Factors of the speech motion by feature (jaw, lips).
        seed
            Of the clip, by which a smile is uneven.
        """

    def renderer(self, picture: Picture) -> FrameRenderer:
        """Create the renderer of this face.

        Raises
        ------
        InputError, BackendError
            The face cannot be drawn with these options, or the renderer is not installed.
        """


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class MeshFace:
    """A mesh to whose shapes the talker's motion is retargeted; `gestures` is None without a palette.

    `model` is the face whose landmarks are moved: the mesh itself, or the stand-in of one without landmarks.
    """

    default_styles: ClassVar[Mapping[str, str]] = MappingProxyType({})
    face: Face
    model: Face
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
        self, selection: TokenSelection, *, fps: float, n_frames: int, yield_turn: YieldTurn = keep_on
    ) -> Trajectory:
        """Shape weights (`n_frames`, K) from selected tokens of the talker."""
        lips = blend_trajectory(selection, self.exemplars, fps=fps, n_frames=n_frames, yield_turn=yield_turn)
        weights, options = self.retargeter.retarget(lips), selection.options
        if not options.contacts and options.articulation is None:
            return weights
        yield_turn()
        factor = DEFAULT_ARTICULATION if options.articulation is None else options.articulation
        return self.articulator.articulate(weights, selection.phones, factor)

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Shape weights (T, K) from the talker's speech parameters (T, S)."""
        return self.retargeter.retarget(speech)

    def motion_of_take(self, take: "Take", *, gain: float = 1.0) -> Trajectory:
        """Shape weights (T, K) of a performer: lips, lids and brows from landmarks, gaze from scores."""
        retargeter = build_performer_retargeter(take.landmarks, take.scores, self.model)
        return retargeter.weights(take.landmarks, take.scores, gain=gain)

    def motion_of_capture(self, capture: "FaceCapture", *, gain: float = 1.0) -> Trajectory:
        """Shape weights (T, K) of an ARKit capture, matched by name; the gain does not apply to the gaze."""
        return match_shapes(capture.weights, self.face, gain=gain)

    def with_motion_of(self, take: "Take") -> "AnimatedFace":
        """Raise InputError: the shapes of a mesh are fixed."""
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

    def add_gestures(
        self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float], seed: int = 0
    ) -> FaceMotion:
        """Add gestures to speech motion; closed lips stay closed."""
        if self.gestures is None:
            raise InputError(NO_PALETTE)
        uneven = smile_unevenness(str(self.face.metadata.get("name", "")), seed)
        performance = self.gestures.perform(speech, gestures, gains, uneven)
        return FaceMotion(performance.motion, performance.head)

    def renderer(self, picture: Picture) -> FrameRenderer:
        """Create the renderer of the mesh."""
        return marked(mesh_renderer(self.mesh, picture))


@shared
def mesh_face(talker: Talker, exemplars: ExemplarModel, face: Face) -> MeshFace:
    """Prepare a mesh for a talker, without gestures."""
    model = stand_in(face)
    return MeshFace(face, model, exemplars, build_retargeter(talker, model), build_articulator(model), None)


@dataclass(frozen=True, slots=True, eq=False)
class OwnAppearanceFace:
    """A talker's own face, drawn over the talker's video, which fixes the gaze and the head pose."""

    default_styles: ClassVar[Mapping[str, str]] = MappingProxyType({"expression": MEASURED_STYLE})  # its video's
    talker: Talker
    exemplars: ExemplarModel
    appearance: AppearanceExemplars
    regression: AppearanceRegression
    gestures: OwnFaceGestures | None

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the speech parameters, the appearance parameters, and the gesture parameters of the palette."""
        added = () if self.gestures is None else self.gestures.channels
        return self.regression.speech_channels + self.regression.appearance_channels + added

    @property
    def limits(self) -> NDArray[np.float32]:
        """(K, 2) infinite limits: the parameters of a talker's own face have none."""
        return np.tile(np.array([-np.inf, np.inf], np.float32), (len(self.channels), 1))

    @property
    def mesh(self) -> Face:
        """Raise InputError: a talker's own face is drawn from pictures and has no mesh."""
        raise InputError("a talker's own face has no mesh; choose --face head, ada or a .face file")

    def motion_of_tokens(
        self, selection: TokenSelection, *, fps: float, n_frames: int, yield_turn: YieldTurn = keep_on
    ) -> Trajectory:
        """Speech and appearance parameters (`n_frames`, K), both blended from the same selected tokens."""
        lips = blend_trajectory(selection, self.exemplars, fps=fps, n_frames=n_frames, yield_turn=yield_turn)
        yield_turn()
        appearance = appearance_trajectory(selection, self.appearance, fps=fps, n_frames=n_frames)
        values = np.concatenate([lips.values, appearance.values], axis=1)
        return Trajectory(lips.channels + appearance.channels, values, fps)

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Speech parameters with appearance parameters regressed on them, (T, K)."""
        return self.regression.motion(speech)

    def motion_of_take(self, take: "Take", *, gain: float = 1.0) -> Trajectory:
        """Motion (T, K) of a performer, cloned by inner products (Theobald et al. 2007, eq. 5)."""
        model = lip_model(take.landmarks)
        names = tuple(f"shape{i}" for i in range(model.n_speech))
        speech = Trajectory(names, model.parameters(take.landmarks), take.fps)
        return self.regression.motion(build_parameter_transfer(model, self.talker.model, gain=gain).clone(speech))

    def motion_of_capture(self, capture: "FaceCapture", *, gain: float = 1.0) -> Trajectory:
        """Raise InputError: a capture has no landmarks to clone."""
        raise InputError(
            "a Live Link Face capture has no landmarks, which a talker's own face needs; choose --face head, ada "
            "or a .face file"
        )

    def with_motion_of(self, take: "Take") -> "AnimatedFace":
        """Add the modes of a take that the shape model lacks."""
        talker = extend_talker(lip_model(take.landmarks), self.talker)
        return replace(self, talker=talker, regression=fit_appearance_regression(talker))

    def landmarks(self, motion: Trajectory) -> NDArray[np.float32]:
        """Landmarks (T, 478, 3) of the talker, mm, of the speech parameters in the motion."""
        return self.talker.model.shapes(motion.values[:, : len(self.regression.speech_channels)])

    def check_articulation(self, factor: float | None) -> None:
        """Reject factors other than natural (InputError): there are pictures of recorded mouths only."""
        if factor not in (None, NATURAL):
            raise InputError(
                "a talker's own face is made of recorded pictures and articulates as recorded; choose --articulation "
                "natural, or another face"
            )

    def check_gains(self, gains: Mapping[str, float]) -> None:
        """Reject gains of the features that the talker's video fixes (InputError)."""
        for name in gains:
            if name in FIXED_FEATURES:
                raise InputError(
                    f"a talker's own face is drawn on the talker's video, whose {name} cannot be changed; remove the "
                    f"gain of {name}"
                )

    def with_gestures_of(self, palette: Palette) -> "OwnAppearanceFace":
        """The face with the parameters of lids, brows, cheeks and expression that a palette's gestures need."""
        return replace(self, gestures=build_own_face_gestures(self.talker, palette))

    def add_gestures(
        self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float], seed: int = 0
    ) -> FaceMotion:
        """Add gestures of lids, brows, cheeks and expression; all head channels are 0."""
        if self.gestures is None:
            raise InputError(NO_PALETTE)
        return FaceMotion(self.gestures.motion(speech, gestures, gains), resting_head(len(speech), speech.fps))

    def renderer(self, picture: Picture) -> FrameRenderer:
        """Create the renderer that draws the face over the talker's video."""
        # imported here: exports draw nothing
        from tts2face.picture.own_face import own_face_renderer  # exports draw nothing

        return marked(own_face_renderer(self.talker, picture, self.gestures))


def own_appearance_face(talker: Talker, exemplars: ExemplarModel) -> OwnAppearanceFace:
    """Prepare a talker's own face, without gestures."""
    appearance = build_appearance_exemplars(talker, exemplars)
    return OwnAppearanceFace(talker, exemplars, appearance, fit_appearance_regression(talker), None)
