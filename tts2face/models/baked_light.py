"""Light of a face that a path tracer has baked: its colours at rest, and how they change with its poses and the camera.

Colours are those of a display, 0 to 255, and are added to each other; those of eyeballs are linear light. Source:
Theobald et al. 2007, equation 2 (an appearance is a mean and a sum of changes), with changes that each vertex finds in
the shape of its pose.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER

N_PAGES = 2
TABLE_SIDE = 33  # entries of the view transform along each colour
N_LAMP_NUMBERS = 17
LIP_RING = (
    *INNER_LIP_UPPER,
    *INNER_LIP_LOWER[::-1][1:-1],
)  # landmarks round the opening, against the clock as the face sees it
N_TERMS, N_MOUTH_TERMS, N_BALL_TERMS = 10, 6, 3  # of `tts2face.render.film.response`
LIMIT_STEP = 2.0  # of 255
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
    responses : (10, 3, N)
        Change of their light by terms of the pose (`tts2face.render.film.response`), over ``response_sizes`` (10,).
    limits : (2, 3, N)
        Least and most change that the baked poses showed, in steps of `LIMIT_STEP`.
    partners : (N + B,)
        Vertex across the lips or lids from each of ``rows`` and ``ball_rows``; itself where there is none.
    mouth_rows : (M,)
        Vertices of teeth, gums and tongue.
    mouth_base : (M, 3)
    mouth_responses : (6, 3, M)
        Of their light, over ``mouth_sizes`` (6,).
    mouth_limits : (2, 3, M)
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
    ball_responses : (3, 3, B)
        Its change by the last three terms, over ``ball_sizes`` (3,).
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
    responses: NDArray[np.int8]
    response_sizes: NDArray[np.float32]
    limits: NDArray[np.int8]
    partners: NDArray[np.int32]
    mouth_rows: NDArray[np.int32]
    mouth_base: NDArray[np.uint8]
    mouth_responses: NDArray[np.int8]
    mouth_sizes: NDArray[np.float32]
    mouth_limits: NDArray[np.int8]
    turns_deg: NDArray[np.float32]
    turn_weights: NDArray[np.float32]
    turn_modes: NDArray[np.int8]
    camera_yaws_deg: NDArray[np.float32]
    camera_modes: NDArray[np.int8]
    camera_sizes: NDArray[np.float32]
    ball_rows: NDArray[np.int32]
    ball_base: NDArray[np.float32]
    ball_responses: NDArray[np.int8]
    ball_sizes: NDArray[np.float32]
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
