"""Faces prepared for animation: the protocol, which a mesh and a talker's own face implement.

An animated face is prepared for one talker. It converts the talker's lip motion to its own channels, adds gestures, and
creates the renderer of its frames. `mesh_face` and `own_appearance_face` make the two kinds; all other code depends on
the protocol only.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from tts2face.exemplar.synthesis import TokenSelection
from tts2face.models.face import Face
from tts2face.models.palette import Palette
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.types import GiveWay, Trajectory, keep_on

if TYPE_CHECKING:
    from tts2face.video.livelink import FaceCapture
    from tts2face.video.take import Take

NO_PALETTE = "this face was prepared without a palette and has no gestures; prepare it with a palette"

Gestures = Mapping[str, NDArray[np.float32]]


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
        self, selection: TokenSelection, *, fps: float, n_frames: int, give_way: GiveWay = keep_on
    ) -> Trajectory:
        """Speech motion (`n_frames`, K) from selected tokens of the talker; `give_way` is called between its steps."""

    def motion_of_parameters(self, speech: Trajectory) -> Trajectory:
        """Speech motion (T, K) from the talker's speech parameters (T, S)."""

    def motion_of_take(self, take: "Take", *, gain: float = 1.0) -> Trajectory:
        """Motion (T, K) of a performer tracked in a video; `gain` multiplies it.

        Raises
        ------
        DataError
            The take is too short, or the face lacks landmarks or shapes.
        """

    def motion_of_capture(self, capture: "FaceCapture", *, gain: float = 1.0) -> Trajectory:
        """Motion (T, K) of an ARKit capture: shapes of the same name take its weights, clipped to their limits.

        Raises
        ------
        InputError
            The face has no such shapes.
        """

    def with_motion_of(self, take: "Take") -> "AnimatedFace":
        """Extend the face by the lip motion of a take that the talker's recordings lack (T07, section 3.1).

        Raises
        ------
        InputError
            The face cannot be extended.
        """

    def landmarks(self, motion: Trajectory) -> NDArray[np.float32]:
        """Landmarks (T, 478, 3) of the face, mm, moved by the first or all of its channels.

        Raises
        ------
        DataError
            The face lacks landmarks, or the motion is not of its channels.
        """

    def check_articulation(self, factor: float | None) -> None:
        """Reject a factor of articulation that this face cannot show; None is its own.

        Raises
        ------
        InputError
            The face has no other articulation than the recorded one.
        """

    def check_gains(self, gains: Mapping[str, float]) -> None:
        """Reject gains of features that this face cannot move.

        Raises
        ------
        InputError
            The face cannot move a feature of `gains`.
        """

    def with_gestures_of(self, palette: Palette) -> "AnimatedFace":
        """The face with the channels that the gestures of a palette need."""

    def add_gestures(self, speech: Trajectory, gestures: Gestures, gains: Mapping[str, float]) -> FaceMotion:
        """Add gestures to speech motion.

        Parameters
        ----------
        speech : (T, K)
            Speech motion in channels of this face.
        gestures
            (T, k) values of each feature of the palette, in the palette's units.
        gains
            Factors of the speech motion by feature (jaw, lips).

        Raises
        ------
        InputError
            The speech is not in the channels of this face, or a feature has another number of frames.
        """

    def renderer(self, picture: Picture) -> FrameRenderer:
        """Create the renderer of this face.

        Raises
        ------
        InputError, BackendError
            The face cannot be drawn with these options, or the renderer is not installed.
        """
