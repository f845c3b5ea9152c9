"""Light of a photograph: that of its skin, which turns with it, and that in the mouth, which comes through the lips."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from tts2face.colour import LUMINANCE, decode_srgb
from tts2face.models.baked_light import (
    BLACK_SHARE,
    LEAST_SIDE,
    N_BALL_TERMS,
    N_LAMP_NUMBERS,
    N_MOUTH_TERMS,
    N_PAGES,
    N_TERMS,
    TABLE_SIDE,
    BakedLight,
    equal_limits,
    quantised,
)
from tts2face.models.landmarks import LEFT_LIDS, OUTER_LIP_LOWER, OUTER_LIP_UPPER, RIGHT_LIDS
from tts2face.numeric import smoothstep, vertex_normals
from tts2face.photo.colours import colours_at
from tts2face.photo.mouth_inside import PICTURED
from tts2face.photo.photo_mesh import PhotoMesh
from tts2face.photo.photo_surface import EYES, LIDS, SKIN

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LIGHT_BLUR = 0.03  # of the width of the face
SMALL_SPREAD_PX = 3.0  # blur of the smaller picture in which that is done
NOSE_AND_BROWS = (46, 53, 52, 65, 55, 276, 283, 282, 295, 285, 1, 2, 98, 327)
USUAL_LIGHT = np.array([0.6, 0.0, 0.18, 0.4])  # constant, and from the left, above and in front, of the median
LIGHT_RIDGE = np.array([0.2, 1.0, 1.0, 1.0]) * 0.06
ROUNDS, LEAST_OFF = 6, 1e-4  # of the robust fit, and the least error by which others are weighed
CLEAR, WITHIN_OVAL = 0.06, 0.04  # of the width: from features and within the oval, where skin is measured
LIT_FADE = (-0.015, 0.08)  # of the width outside the oval, over which the light of the skin ends
GAMMA = 2.2  # of a display
LEAST_SHADE = 0.25  # of the median, of skin in the shade
MOST_TURNED = 30.0  # of 255, change of the skin's light
MOUTH_OPEN = 1.1  # of the colour in open light, where the lips are wide open
SHADE_TINT = np.array([0.8, 1.05, 1.1])  # of what wrinkles darken: light between them is redder
NO_EYES = np.array([0.2, 0.4], np.float32)  # edges of pupil and iris, of which a photographed face has none
TURN_TERMS, MOVE_TERMS = slice(1, 4), slice(4, 7)  # of `tts2face.render.film.response.write_terms`
LEAST_RESPONSE = 1e-6  # of 255, of a response
CURVE_TERM = 2  # of `tts2face.render.film.response.write_mouth_terms`


@dataclass(frozen=True, slots=True, eq=False)
class MouthRows:
    """Parts behind lips, each its vertices (N,) and their colours (N, 3) in open light.

    Those that a picture shows and those that are lit come from the dark, a share (3,) of the colours, as the lips open;
    the walls do not.
    """

    pictured: Sequence[tuple[Ints, Floats]]
    lit: Sequence[tuple[Ints, Floats]]
    walls: Sequence[tuple[Ints, Floats]]
    dark: Floats

    def light(self) -> tuple[Ints, Floats, Floats]:
        """Vertices (M,), their base (M, 3), which is added to that of a picture, and responses (6, 3, M)."""
        rows, bases, responses = [], [], []
        none, full = np.zeros(3), np.ones(3)
        for parts, base, dark, opened in (
            (self.pictured, none, self.dark - 1, MOUTH_OPEN - self.dark),
            (self.lit, self.dark, none, MOUTH_OPEN - self.dark),
            (self.walls, full, none, none),
        ):
            for numbers, colours in parts:
                answer = np.zeros((N_MOUTH_TERMS, 3, len(numbers)))
                answer[0], answer[CURVE_TERM] = (dark * colours).T, (opened * colours).T
                rows.append(numbers)
                bases.append(base * colours)
                responses.append(answer)
        return np.concatenate(rows), np.concatenate(bases), np.concatenate(responses, axis=2)


def skin_light(
    pixels: NDArray[np.uint8], mesh: PhotoMesh, vertices: Floats, by_movement: Floats
) -> tuple[Ints, Floats]:
    """Vertices (N,) whose colour follows their normal and movement, and (10, 3, N) its responses.

    Light of first order (Basri and Jacobs 2003) is fitted to the skin's luminance. `by_movement` (3, V) is the change
    of the light of all vertices by their movement, of their colour.
    """
    points = vertices[: len(mesh.places)]
    normals = vertex_normals(points, mesh.triangles)
    wide = float(np.ptp(mesh.places[mesh.landmark_vertices, 0]))
    soft = _blurred(pixels, LIGHT_BLUR * wide, mesh.places)
    colours = decode_srgb(soft / 255.0)
    luminance = colours @ LUMINANCE
    avoided = {
        *OUTER_LIP_UPPER,
        *OUTER_LIP_LOWER,
        *NOSE_AND_BROWS,
        *(n for lids in (RIGHT_LIDS, LEFT_LIDS) for n in (*lids[0], *lids[1])),
    }
    is_near = np.isin(mesh.landmarks, list(avoided))
    places = mesh.places[mesh.landmark_vertices]
    away = np.linalg.norm(places[:, None] - places[is_near][None], axis=2).min(axis=1)
    used = mesh.landmark_vertices[(away > CLEAR * wide) & (mesh.outside[mesh.landmark_vertices] < -WITHIN_OVAL * wide)]
    terms = np.column_stack([np.ones(len(used)), normals[used]])
    light = _fit(terms, luminance[used])
    shade = np.maximum(light[0] + normals @ light[1:], LEAST_SHADE * float(np.median(luminance[used])))
    lit = 1 - smoothstep(mesh.outside / wide, *LIT_FADE)
    rows = np.flatnonzero(lit > 0)
    per_turn = light[1:, None] * (lit[rows] / (GAMMA * shade[rows]))
    responses = np.zeros((N_TERMS, 3, len(rows)))
    responses[TURN_TERMS] = per_turn[:, None] * soft[rows].T
    responses[MOVE_TERMS] = (by_movement[:, rows] * lit[rows])[:, None] * (SHADE_TINT * soft[rows]).T
    return rows, responses


def _fit(terms: Floats, values: Floats) -> Floats:
    usual = float(np.median(values)) * USUAL_LIGHT
    ridge = np.diag(LIGHT_RIDGE) * len(values)
    weights = np.ones(len(values))
    for _ in range(ROUNDS):
        weighted = terms * weights[:, None]
        light = np.linalg.solve(weighted.T @ terms + ridge, weighted.T @ values + ridge @ usual)
        off = np.abs(values - terms @ light)
        weights = 1 / (1 + (off / (np.median(off) + LEAST_OFF)) ** 2)
    return np.asarray(light)


def _blurred(pixels: NDArray[np.uint8], spread: float, places: Floats) -> Floats:
    """Colours (N, 3) of a blurred picture (H, W, 3) at places (N, 2): of a smaller one, which shows the same."""
    from PIL import Image

    shrink = max(1.0, spread / SMALL_SPREAD_PX)
    size = tuple(max(1, round(side / shrink)) for side in pixels.shape[1::-1])
    small = np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BOX), np.float64)
    per_pixel = np.array(size) / np.array(pixels.shape[1::-1])
    at = (places + 0.5) * per_pixel - 0.5
    soft = gaussian_filter(small, (spread / shrink, spread / shrink, 0))
    return colours_at(soft, at)


def picture_light(
    pixels: NDArray[np.uint8],
    pages: NDArray[np.uint8],
    skin: tuple[PhotoMesh, Floats, Floats],
    drawn: Ints,
    mouth: MouthRows,
) -> BakedLight:
    """Light of a face in a picture (H, W, 3): that of the skin turns with it, that of the mouth comes through the lips.

    Parameters
    ----------
    pages : (2, H, W, 3)
        As the face's parts show them.
    skin
        Mesh of the picture, its vertices (V, 3), mm, and the change of their light by movement (3, V).
    drawn : (D,)
        Triangles that move.
    mouth
        Vertices behind the lips.
    """
    rows, responses = skin_light(pixels, *skin)
    answers, sizes = quantised(responses, least=LEAST_RESPONSE)
    mouth_rows, lit, openings = mouth.light()
    mouth_answers, mouth_sizes = quantised(openings, least=LEAST_RESPONSE)
    n_texels = N_PAGES * LEAST_SIDE**2 + LEAST_SIDE * (LEAST_SIDE // BLACK_SHARE)
    no_colours = np.zeros((0, 3), np.float32)
    return BakedLight(
        pages=pages,
        triangles=drawn.astype(np.int32),
        is_inside=np.zeros(len(drawn), bool),
        base=np.zeros((len(rows), 3), np.uint8),
        turns_deg=np.zeros((0, 2), np.float32),
        turn_weights=np.zeros((0, 0), np.float32),
        turn_modes=np.zeros((0, 3, n_texels), np.int8),
        camera_yaws_deg=np.zeros(0, np.float32),
        camera_modes=np.zeros((0, 3, LEAST_SIDE**2), np.int8),
        camera_sizes=np.zeros(0, np.float32),
        page_of={SKIN: 0, LIDS: 0, EYES: 1, PICTURED: 1},
        rows=rows.astype(np.int32),
        responses=answers,
        response_sizes=sizes,
        limits=equal_limits(MOST_TURNED, len(rows)),
        partners=rows.astype(np.int32),
        mouth_rows=mouth_rows.astype(np.int32),
        mouth_base=np.rint(lit).astype(np.uint8),
        mouth_responses=mouth_answers,
        mouth_sizes=mouth_sizes,
        mouth_limits=equal_limits(255.0, len(mouth_rows)),
        ball_rows=np.zeros(0, np.int32),
        ball_base=no_colours,
        ball_responses=np.zeros((N_BALL_TERMS, 3, 0), np.int8),
        ball_sizes=np.ones(N_BALL_TERMS, np.float32),
        lamps=np.zeros((0, N_LAMP_NUMBERS), np.float32),
        head_lamps=0,
        sky=np.zeros(3, np.float32),
        eye_gain=1.0,
        eye_edges=NO_EYES,
        view=np.zeros((TABLE_SIDE, TABLE_SIDE, TABLE_SIDE, 3), np.uint8),
        backdrop=pixels,
    )
