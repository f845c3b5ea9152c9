"""Light of a face that a path tracer has baked: its colours at rest, and how they change with its poses and the camera.

Colours are those of a display, 0 to 255, and are added to each other; those of eyeballs are linear light. Source:
Theobald et al. 2007, equation 2 (an appearance is a mean and a sum of changes), with changes that each vertex finds in
the shape of its pose.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from tts2face.models.codec import Stored, StoredModel
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.models.view_transform import TABLE_SIDE
from tts2face.numeric.arrays import make_read_only
from tts2face.storage.model_pictures import encode_colours
from tts2face.storage.schema import MAX_MM, Tensor

# one above the other in the texture
N_PAGES = 2
N_LAMP_NUMBERS = 17
LIP_RING = (
    *INNER_LIP_UPPER,
    *INNER_LIP_LOWER[::-1][1:-1],
)  # landmarks round the opening, against the clock as the face sees it
N_TERMS, N_MOUTH_TERMS, N_BALL_TERMS = 10, 6, 3  # of `tts2face.picture.baked.response`
LIMIT_STEP = 2.0  # of 255
BLACK_SHARE = 64  # of a page's height lies below both, black: the texels of parts without a page
LEAST_SIDE = 2 * BLACK_SHARE  # of a page: two rows of black, of which one is read
HAIR_QUALITY = 85  # of the JPEG pictures of haircuts; 92 takes 100 kB more of each
MAX_FACTOR = 1e3  # of any weight or light
LAMPS = Tensor("float32", ("lamps", N_LAMP_NUMBERS), -MAX_MM, MAX_MM, may_be_empty=True)


def _factors(*shape: int | str, low: float = -MAX_FACTOR) -> Tensor:
    return Tensor("float32", shape, low, MAX_FACTOR, may_be_empty=True)


def _steps(*shape: int | str) -> Tensor:
    return Tensor("int8", shape, may_be_empty=True)


def _numbers(*shape: int | str) -> Tensor:
    return Tensor("int32", shape, may_be_empty=True)


@dataclass(frozen=True, slots=True, eq=False)
class HairTint:
    """Hair in other colours, between which and its own it is drawn in any.

    Attributes
    ----------
    colours : (1 + C, 3)
        Its own and the others, sRGB.
    pages : (C, h, s, 3)
        The first rows of the second page at rest with the others; their side s may be smaller.
    vertices : (C, N, 3)
        Colours of the face's last N vertices, those of the hair, with the others.
    """

    colours: NDArray[np.float32]
    pages: NDArray[np.uint8]
    vertices: NDArray[np.uint8]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        make_read_only(self)


def _tint_picture(tint: HairTint) -> NDArray[np.uint8]:
    return encode_colours(np.concatenate(list(tint.pages)), HAIR_QUALITY)


TINT = Stored(Tensor("uint8", ("bytes of tint",), is_optional=True), encode=_tint_picture)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class HairLight(StoredModel):
    """Part of a face's light that depends on its haircut.

    Attributes
    ----------
    pages : (2, S, S, 3)
        Colours at rest.
    triangles : (D,)
        Triangles of the face that are drawn, outermost first; ``~t`` for the back of one.
    is_inside : (D,)
        Whether the back of one lies in the dark of the mouth.
    base : (N, 3)
        Light of ``rows`` at rest; 0 on pages.
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
    tint
        The hair in another colour; None for a face whose hair has one.
    """

    pages: NDArray[np.uint8]
    triangles: NDArray[np.int32]
    is_inside: Annotated[NDArray[np.bool_], Tensor("bool", ("drawn triangles",))]
    base: Annotated[NDArray[np.uint8], Tensor("uint8", ("lit vertices", 3), may_be_empty=True)]
    turns_deg: Annotated[NDArray[np.float32], Tensor("float32", ("turns", 2), -90.0, 90.0, may_be_empty=True)]
    turn_weights: Annotated[NDArray[np.float32], _factors("turns", "turn modes")]
    turn_modes: Annotated[NDArray[np.int8], _steps("turn modes", 3, "texels of change")]
    camera_yaws_deg: Annotated[NDArray[np.float32], Tensor("float32", ("cameras",), -180.0, 180.0, may_be_empty=True)]
    camera_modes: Annotated[NDArray[np.int8], _steps("cameras", 3, "texels from cameras")]
    camera_sizes: Annotated[NDArray[np.float32], _factors("cameras")]
    tint: Annotated[HairTint | None, TINT] = None

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        make_read_only(self)

    @property
    def triangle_numbers(self) -> NDArray[np.int32]:
        """(D,) triangle of the face of which each drawn one shows the front or the back."""
        return np.where(self.triangles < 0, ~self.triangles, self.triangles)

    @property
    def changes_in_texels(self) -> bool:
        """Whether colours in texels change with turns of the head or the camera."""
        return len(self.turn_modes) + len(self.camera_modes) > 0

    @property
    def turn_side(self) -> int:
        """Side of a page of the texels of change."""
        return side_of(self.n_texels)

    @property
    def n_texels(self) -> int:
        """Number of the texels of change."""
        return int(self.turn_modes.shape[2])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BakedLight(HairLight):
    """Light of a face.

    Attributes
    ----------
    page_of
        Page of each part that has its colours in texels, by the part's name: 0 for skin, 1 for what does not speak.
    rows : (N,)
        Vertices whose light changes with the expression.
    responses : (10, 3, N)
        Change of their light by terms of the pose (`tts2face.picture.baked.response`), over ``response_sizes`` (10,).
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
    ball_rows : (B,)
        Vertices of the eyeballs that are ever seen.
    ball_base : (B, 3)
        Light on white eyeballs at rest.
    ball_responses : (3, 3, B)
        Its change by the last three terms, over ``ball_sizes`` (3,).
    lamps : (L, 17)
        Rectangles that shine, mm: centre, two axes, normal, half width, half height, radiance. On the side of the first
        lie the catchlights of eyes, in its colour; without lamps there are none.
    head_lamps
        How many of the lamps, the last ones, shine on eyes alone; they are not drawn.
    sky : (3,)
        Radiance that eyes mirror elsewhere.
    eye_gain
        Factor of the texture of the eyes.
    eye_edges : (2,)
        Angles from the gaze, rad, at which pupil and iris end in that texture.
    view : (33, 33, 33, 3)
        Colours of linear light at `tts2face.models.view_transform.table_levels`.
    backdrop : (H, W, 3)
        The wall behind, from in front.
    """

    page_of: Mapping[str, int]
    rows: Annotated[NDArray[np.int32], _numbers("lit vertices")]
    responses: Annotated[NDArray[np.int8], _steps(N_TERMS, 3, "lit vertices")]
    response_sizes: Annotated[NDArray[np.float32], _factors(N_TERMS)]
    limits: Annotated[NDArray[np.int8], _steps(2, 3, "lit vertices")]
    partners: Annotated[NDArray[np.int32], _numbers("partners")]
    mouth_rows: Annotated[NDArray[np.int32], _numbers("vertices of the mouth")]
    mouth_base: Annotated[NDArray[np.uint8], Tensor("uint8", ("vertices of the mouth", 3), may_be_empty=True)]
    mouth_responses: Annotated[NDArray[np.int8], _steps(N_MOUTH_TERMS, 3, "vertices of the mouth")]
    mouth_sizes: Annotated[NDArray[np.float32], _factors(N_MOUTH_TERMS)]
    mouth_limits: Annotated[NDArray[np.int8], _steps(2, 3, "vertices of the mouth")]
    ball_rows: Annotated[NDArray[np.int32], _numbers("lit vertices of eyes")]
    ball_base: Annotated[NDArray[np.float32], _factors("lit vertices of eyes", 3)]
    ball_responses: Annotated[NDArray[np.int8], _steps(N_BALL_TERMS, 3, "lit vertices of eyes")]
    ball_sizes: Annotated[NDArray[np.float32], _factors(N_BALL_TERMS)]
    lamps: Annotated[NDArray[np.float32], LAMPS]
    head_lamps: int
    sky: Annotated[NDArray[np.float32], _factors(3, low=0.0)]
    eye_gain: float
    eye_edges: Annotated[NDArray[np.float32], Tensor("float32", (2,), 0.01, 1.5)]
    view: Annotated[NDArray[np.uint8], Tensor("uint8", (TABLE_SIDE, TABLE_SIDE, TABLE_SIDE, 3))]
    backdrop: NDArray[np.uint8]

    def of_drawn(self, triangles: NDArray[np.int32]) -> "BakedLight":
        """Light of those vertices alone that the drawn ones of a face's triangles (F, 3) have."""
        drawn = np.unique(triangles[self.triangle_numbers])
        rows, mouth, balls = (np.isin(rows, drawn) for rows in (self.rows, self.mouth_rows, self.ball_rows))
        return replace(
            self,
            rows=self.rows[rows],
            base=self.base[rows],
            responses=self.responses.compress(rows, axis=2),  # in C order, which an index of the last axis is not
            limits=self.limits.compress(rows, axis=2),
            partners=self.partners[np.concatenate([rows, balls])],
            mouth_rows=self.mouth_rows[mouth],
            mouth_base=self.mouth_base[mouth],
            mouth_responses=self.mouth_responses.compress(mouth, axis=2),
            mouth_limits=self.mouth_limits.compress(mouth, axis=2),
            ball_rows=self.ball_rows[balls],
            ball_base=self.ball_base[balls],
            ball_responses=self.ball_responses.compress(balls, axis=2),
        )

    def with_hair(self, worn: HairLight) -> "BakedLight":
        """Light of the face with another haircut, of which the skin's change from cameras is beside this one's."""
        new = {field.name: getattr(worn, field.name) for field in fields(HairLight)}
        n = worn.turn_side**2
        if n < min(self.camera_modes.shape[2], worn.camera_modes.shape[2]):
            own = (self.camera_sizes / worn.camera_sizes)[:, None, None] * self.camera_modes[:, :, :n]
            cameras = worn.camera_modes.copy()
            # 8 bits without -128, so that both directions are alike
            cameras[:, :, :n] = np.clip(np.rint(cameras[:, :, :n] + own), -127, 127)
            new["camera_modes"] = cameras
        return replace(self, **new)


def side_of(n_texels: int) -> int:
    """Side of a page of so many texels of change."""
    return round(float(np.sqrt(n_texels / (N_PAGES + 1 / BLACK_SHARE))))


def fills_pages(n_texels: int, n_from_cameras: int) -> bool:
    """Whether so many texels of change are those of square pages and of the black below them."""
    side = side_of(n_texels)
    whole = N_PAGES * side**2 + side * (side // BLACK_SHARE)
    return (
        side >= LEAST_SIDE
        and side % BLACK_SHARE == 0
        and n_from_cameras in (side**2, N_PAGES * side**2)
        and n_texels == whole
    )


def quantised(
    values: NDArray[np.float64], share: float = 100.0, least: float | NDArray[np.float64] = 1e-9
) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Rows (C, ...) in 8 bits, and the size (C,) of a step of each, at least `least`, of all or of each (C,).

    Those above a share in per cent are cut off.
    """
    flat = values.reshape(len(values), -1)
    # a row of zeros has no size
    sizes = np.maximum(np.percentile(np.abs(flat), share, axis=1) / 127, least)
    steps = np.clip(np.rint(flat / sizes[:, None]), -127, 127).astype(np.int8)
    return steps.reshape(values.shape), sizes.astype(np.float32)


def equal_limits(most: float, n: int) -> NDArray[np.int8]:
    """(2, 3, n) limits of a change of light by `most` of 255; none is reached from 254 on."""
    steps = min(round(most / LIMIT_STEP), 127)
    limits: NDArray[np.int8] = np.tile(np.array([-steps, steps], np.int8)[:, None, None], (1, 3, n))
    limits.setflags(write=False)  # as other limits are, so that kernels are compiled once
    return limits
