"""A talker's own face prepared for animation; implements `tts2face.synthesis.animated_face.AnimatedFace`."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

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
from tts2face.face.gesture_transfer import SPEECH_GAINS
from tts2face.models.face import Face
from tts2face.models.palette import MEASURED_STYLE, Palette
from tts2face.models.talker import Talker
from tts2face.own_face.appearance_regression import AppearanceRegression, fit_appearance_regression
from tts2face.own_face.gestures import OwnFaceGestures, build_own_face_gestures
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.request import NATURAL
from tts2face.retargeting.performer import lip_model
from tts2face.synthesis.animated_face import NO_PALETTE, AnimatedFace, FaceMotion, Gestures
from tts2face.types import GiveWay, Trajectory, keep_on, resting_head

if TYPE_CHECKING:
    from tts2face.video.livelink import FaceCapture
    from tts2face.video.take import Take

FIXED_FEATURES = ("gaze", "head", *SPEECH_GAINS)  # features that a talker's own video fixes


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
        self, selection: TokenSelection, *, fps: float, n_frames: int, give_way: GiveWay = keep_on
    ) -> Trajectory:
        """Speech and appearance parameters (`n_frames`, K), both blended from the same selected tokens."""
        lips = blend_trajectory(selection, self.exemplars, fps=fps, n_frames=n_frames, give_way=give_way)
        give_way()
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
        del capture, gain
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

    def add_gestures(self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float]) -> FaceMotion:
        """Add gestures of lids, brows, cheeks and expression; all head channels are 0."""
        if self.gestures is None:
            raise InputError(NO_PALETTE)
        return FaceMotion(self.gestures.motion(speech, gestures, gains), resting_head(len(speech), speech.fps))

    def renderer(self, picture: Picture) -> FrameRenderer:
        """Create the renderer that draws the face over the talker's video."""
        from tts2face.render.own_face import own_face_renderer  # exports draw nothing
        from tts2face.render.visible_mark import marked

        return marked(own_face_renderer(self.talker, picture, self.gestures))


def own_appearance_face(talker: Talker, exemplars: ExemplarModel) -> OwnAppearanceFace:
    """Prepare a talker's own face, without gestures.

    Raises
    ------
    InputError
        The talker has no appearance model.
    """
    appearance = build_appearance_exemplars(talker, exemplars)
    return OwnAppearanceFace(talker, exemplars, appearance, fit_appearance_regression(talker), None)
