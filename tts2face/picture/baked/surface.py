"""Surface of a face with baked light in the arrays that the kernels take."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.deformation import FaceRig, build_rig
from tts2face.models.baked_light import BLACK_SHARE, N_PAGES, BakedLight
from tts2face.models.face import Face
from tts2face.models.light import Lit
from tts2face.numeric.arrays import connected_pieces, decode_srgb
from tts2face.picture.baked.closed_mouth import close_mouth, wall_colours
from tts2face.picture.baked.mouth_colours import MouthColours
from tts2face.picture.baked.response import LightTerms, light_terms
from tts2face.picture.baked.visibility import MAX_TRIANGLES, N_COLUMNS, RED, U, V
from tts2face.picture.kernels.eyes import EyeGeometry, eye_geometry
from tts2face.processes.shared import shared

OPAQUE, COVER_SHIFT = 255, 24  # cover of pages without any, and its bits in a texel
TEXELS_A_PIXEL = 1.0  # beyond which the next smaller texels are read


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class LitSurface:
    """Constant arrays for drawing a face with baked light.

    Rows of the table of projected vertices: those of ``light.rows``, ``light.mouth_rows`` and ``light.ball_rows``, then
    vertices with constant light.

    Attributes
    ----------
    source : (V,)
        Vertex of the face of each row.
    behind : (V,)
        Rows of what lies in openings of a photographed skin, which hides them wherever it is.
    template : (V, 8)
        Texture coordinates, and the light that is constant.
    triangles : (D, 3)
        Rows of the table, counter-clockwise as they are drawn.
    piece_of, eye_of : (D,)
        Connected piece of each triangle, such as a lock of hair; its eye, -1 of none.
    of_eyes : (E,)
        Triangles of the eyes.
    eye_texture : (S, S, 3)
        Linear light.
    terms
        Of the vertices that are lit.
    eyes
        For their catchlights.
    mouth
        Colours of those of the mouth, of a head; None of a photograph, whose light is that of the picture.
    """

    face: Face
    light: BakedLight
    rig: FaceRig
    terms: LightTerms
    mouth: MouthColours | None
    source: NDArray[np.int32]
    behind: NDArray[np.bool_]
    template: NDArray[np.float32]
    triangles: NDArray[np.int32]
    piece_of: NDArray[np.int32]
    eye_of: NDArray[np.int32]
    of_eyes: NDArray[np.intp]
    eye_texture: NDArray[np.float32]
    eyes: EyeGeometry


@shared
def build_surface(face: Face, own: Lit) -> LitSurface:
    """Surface of a face with light of its own.

    Raises
    ------
    DataError
        The face has more triangles than a picture can tell apart.
    """
    part_of = np.repeat(np.arange(len(face.parts), dtype=np.int32), [part.count for part in face.parts])
    # a photograph has walls of its own, behind whose skin everything lies
    whole = own.baked if own.is_flat else close_mouth(face, own.baked, part_of)
    light, rig = whole.of_drawn(face.triangles), build_rig(face)
    if len(light.triangles) > MAX_TRIANGLES:
        raise DataError(f"a face with light may have {MAX_TRIANGLES} triangles, not {len(light.triangles)}")
    terms = light_terms(face, rig, light)
    backs = light.triangles < 0
    numbers = light.triangle_numbers
    corners = face.triangles[numbers]
    corners[backs] = corners[backs][:, ::-1]
    part_of = part_of[numbers]
    pages = np.array([light.page_of.get(part.name, N_PAGES) for part in face.parts])
    n_vertices = len(face.vertices)
    dark = (pages[part_of] == 0) & light.is_inside
    keys = corners + np.where(dark, n_vertices, 0)[:, None]  # a vertex of the dark is another row
    lit = np.concatenate([light.rows, light.mouth_rows, light.ball_rows])
    others = np.setdiff1d(keys, lit)
    order = np.concatenate([lit, others])
    row_of = np.zeros(2 * n_vertices, np.int32)
    row_of[order] = np.arange(len(order))
    page_of = np.full(2 * n_vertices, N_PAGES)
    page_of[keys] = np.where(dark, N_PAGES, pages[part_of])[:, None]
    is_behind = np.zeros(2 * n_vertices, bool)
    is_behind[keys] = np.array([own.is_in_opening(part.name) for part in face.parts])[part_of][:, None]
    source = (order % n_vertices).astype(np.int32)
    uv = np.zeros((n_vertices, 2)) if face.uv is None else face.uv
    template = np.zeros((len(order), N_COLUMNS), np.float32)
    template[:, U : V + 1] = page_places(uv[source].astype(np.float64), page_of[order], light.turn_side)
    template[order >= n_vertices, RED:] = wall_colours(face)[source[order >= n_vertices]]
    eye_of = np.full(len(corners), -1, np.int32)
    for number, eye in enumerate(face.eyes):
        eye_of[((corners >= eye.first) & (corners < eye.first + eye.count)).all(axis=1)] = number
    iris = next((part for part in face.parts if part.name == "iris"), None)
    picture = face.textures[iris.texture].pixels if iris is not None else np.full((2, 2, 3), 255, np.uint8)
    return LitSurface(
        face=face,
        light=light,
        rig=rig,
        terms=terms,
        mouth=None if own.is_flat else MouthColours.of(face, light.mouth_rows, terms.ring_of(rig.rest)),
        source=source,
        behind=is_behind[order],
        template=template,
        triangles=np.ascontiguousarray(row_of[keys]),
        piece_of=connected_pieces(corners, n_vertices)[corners[:, 0]],  # edges of a part's pieces lie over each other
        eye_of=eye_of,
        of_eyes=np.flatnonzero(eye_of >= 0),
        eye_texture=(decode_srgb(picture / 255.0) * light.eye_gain).astype(np.float32),
        eyes=eye_geometry(face, rig),
    )


def page_places(uv: NDArray[np.float64], page: NDArray[np.int64], least_side: int) -> NDArray[np.float64]:
    """(N, 2) places in both pages, one above the other, of places (N, 2) in a page (N,); `N_PAGES` is the black below.

    Half a texel of pages of `least_side` is kept from their edges.
    """
    half = 0.5 / least_side
    inside = np.clip(uv[:, 1], half, 1 - half)
    down = np.where(page < N_PAGES, page + inside, N_PAGES + 0.5 / BLACK_SHARE)
    return np.column_stack([np.where(page < N_PAGES, uv[:, 0], 0.5), down / (N_PAGES + 1 / BLACK_SHARE)])


def stack_pages(
    pages: NDArray[np.uint8], level: int, covers: NDArray[np.uint8] | None = None
) -> tuple[NDArray[np.int32], tuple[int, int]]:
    """Texels (N,) of 8 bits a number, of pages (2, H, W, 3) halved `level` times; and (width, height).

    The fourth number is the cover (2, H, W), if there is one.
    """
    height, width = (side >> level for side in pages.shape[1:3])
    stacked = np.zeros((2 * height + height // BLACK_SHARE, width, 4), np.uint8)
    stacked[: 2 * height, :, :3] = _halved(pages, level).reshape(-1, width, 3)
    if covers is not None:
        stacked[: 2 * height, :, 3] = _halved(covers, level).reshape(-1, width)
        stacked[2 * height :, :, 3] = OPAQUE
    return stacked.view("<i4").astype(np.int32, copy=False).ravel(), (width, len(stacked))


def _halved(pages: NDArray[np.uint8], level: int) -> NDArray[np.uint8]:
    """Pages (2, H, W, ...) halved `level` times."""
    if level == 0:
        return pages
    shrunk = pages.astype(np.float32)
    for _ in range(level):
        shrunk = shrunk[:, ::2, ::2] + shrunk[:, 1::2, ::2] + shrunk[:, ::2, 1::2] + shrunk[:, 1::2, 1::2]
        shrunk *= np.float32(0.25)
    return np.rint(shrunk).astype(np.uint8)
