"""Light of a face that a path tracer has baked: its colours at rest, and how they change with its poses and the camera.

Colours are those of a display, 0 to 255, and are added to each other; those of eyeballs are linear light. Source:
Theobald et al. 2007, equation 2 (an appearance is a mean and a sum of modes), with the modes predicted from the pose.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

N_PAGES = 2
TABLE_SIDE = 33  # entries of the view transform along each colour
N_LAMP_NUMBERS = 17
OPENING_LANDMARKS = (13, 14, 61, 291)  # inner lips, upper and lower, and corners of the mouth
PRODUCTS = (
    ("jawOpen", "jawOpen"),
    ("jawOpen", "mouthFunnel"),
    ("jawOpen", "mouthLowerDown"),
    ("mouthSmile", "jawOpen"),
    ("eyeBlinkLeft", "eyeBlinkLeft"),
    ("eyeBlinkRight", "eyeBlinkRight"),
    ("eyeBlinkLeft", "browDownLeft"),
    ("eyeBlinkRight", "browDownRight"),
)  # of weights, the mean of both sides where a name has none: light falls off faster than shapes move
BLACK_SHARE = 64  # of a page's height lies below both, black: the texels of parts without a page
LEAST_SIDE = 2 * BLACK_SHARE  # of a page: two rows of black, of which one is read


@dataclass(frozen=True, slots=True, eq=False)
class BakedLight:
    """Light of a face.

    Attributes
    ----------
    page_of
        Page of each part that has its colours in texels, by the part's name: 0 for skin, 1 for what does not speak.
    pages : (2, S, S, 3)
        Colours at rest.
    triangles : (D,)
        Triangles of the face that are drawn, outermost first; ``~t`` for the back of one.
    is_inside : (D,)
        Whether the back of one lies in the dark of the mouth.
    rows : (N,)
        Vertices whose light changes with the expression.
    base : (N, 3)
        Their light at rest; 0 on pages.
    modes : (C, N, 3)
        Change of the light of the rows; weights hold the size of a step.
    mode_weights : (F, C)
        Weights of the modes by `tts2face.render.film.pose_features.features`.
    mouth_rows : (M,)
        Vertices of teeth, gums and tongue.
    openings : (J, 5)
        Shapes of the mouth's opening (`tts2face.render.film.pose_features.Opening`).
    mouth : (J, M, 3)
        Light of the mouth's vertices in these openings.
    turns_deg : (T, 2)
        Turns of the head, yaw and pitch.
    turn_weights : (T, A)
        Share of the modes of change in texels in each turn.
    turn_modes : (A, 3, n)
        Change of the colours of both pages, of sides s, one above the other and 1/64 of a page below them.
    camera_yaws_deg : (Y,)
        Cameras at rest.
    camera_modes : (Y, 3, p s s)
        Change of both pages, or of the second alone, from them, over ``camera_sizes`` (Y,).
    ball_rows : (B,)
        Vertices of the eyeballs that are ever seen.
    ball_base : (B, 3)
        Light on white eyeballs at rest.
    ball_modes : (E, B, 3)
    ball_weights : (F, E)
        As ``mode_weights``.
    lamps : (L, 17)
        Rectangles that eyes mirror, mm: centre, two axes, normal, half width, half height, radiance.
    head_lamps
        How many of the lamps, the last ones, turn twice as far as the head: their mirror images keep their places.
    sky : (3,)
        Radiance that eyes mirror elsewhere.
    eye_gain
        Factor of the texture of the eyes.
    eye_edges : (2,)
        Angles from the gaze, rad, at which pupil and iris end in that texture.
    view : (33, 33, 33, 3)
        Colours of linear light at `tts2face.render.film.view_transform.table_levels`.
    backdrop : (H, W, 3)
        The wall behind, from in front.
    """

    page_of: Mapping[str, int]
    pages: NDArray[np.uint8]
    triangles: NDArray[np.int32]
    is_inside: NDArray[np.bool_]
    rows: NDArray[np.int32]
    base: NDArray[np.uint8]
    modes: NDArray[np.int8]
    mode_weights: NDArray[np.float32]
    mouth_rows: NDArray[np.int32]
    openings: NDArray[np.float32]
    mouth: NDArray[np.uint8]
    turns_deg: NDArray[np.float32]
    turn_weights: NDArray[np.float32]
    turn_modes: NDArray[np.int8]
    camera_yaws_deg: NDArray[np.float32]
    camera_modes: NDArray[np.int8]
    camera_sizes: NDArray[np.float32]
    ball_rows: NDArray[np.int32]
    ball_base: NDArray[np.float32]
    ball_modes: NDArray[np.float32]
    ball_weights: NDArray[np.float32]
    lamps: NDArray[np.float32]
    head_lamps: int
    sky: NDArray[np.float32]
    eye_gain: float
    eye_edges: NDArray[np.float32]
    view: NDArray[np.uint8]
    backdrop: NDArray[np.uint8]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for one in fields(self):
            if isinstance(array := getattr(self, one.name), np.ndarray):
                array.setflags(write=False)

    @property
    def triangle_numbers(self) -> NDArray[np.int32]:
        """(D,) triangle of the face of which each drawn one shows the front or the back."""
        return np.where(self.triangles < 0, ~self.triangles, self.triangles)

    @property
    def n_shapes(self) -> int:
        """Number of the face's own shapes, the first ones; those that a palette adds do not change its light."""
        return len(self.mode_weights) - len(PRODUCTS) - len(self.turns_deg)

    @property
    def turn_side(self) -> int:
        """Side of a page of the texels of change."""
        return round(float(np.sqrt(self.n_texels / (N_PAGES + 1 / BLACK_SHARE))))

    @property
    def n_texels(self) -> int:
        """Number of the texels of change."""
        return int(self.turn_modes.shape[2])

    @property
    def has_whole_pages(self) -> bool:
        """Whether the texels of change are those of square pages and of the black below them."""
        side = self.turn_side
        whole = N_PAGES * side**2 + side * (side // BLACK_SHARE)
        return (
            side >= LEAST_SIDE
            and side % BLACK_SHARE == 0
            and self.camera_modes.shape[2] in (side**2, N_PAGES * side**2)
            and self.n_texels == whole
        )
