"""Light of a photograph: that of its skin, which turns and wrinkles with it, and that in the mouth, through the lips.

Wrinkles are shading that deepens with raised brows and smiles: lines that the picture shows become deeper, and faint
ones appear. Each vertex answers to its own movement (terms 4 to 6 of `tts2face.picture.baked.response`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from tts2face.models.baked_light import (
    BLACK_SHARE,
    LEAST_SIDE,
    N_BALL_TERMS,
    N_LAMP_NUMBERS,
    N_MOUTH_TERMS,
    N_PAGES,
    N_TERMS,
    BakedLight,
    equal_limits,
    quantised,
)
from tts2face.models.landmarks import LEFT_LIDS, OUTER_LIP_LOWER, OUTER_LIP_UPPER, RIGHT_LIDS
from tts2face.models.view_transform import TABLE_SIDE
from tts2face.numeric.arrays import LUMINANCE, FloatArray, IntArray, Pixels, decode_srgb, smoothstep, vertex_normals
from tts2face.photo.lines import LEAST_BLUR_PX, colours_at, grey_at
from tts2face.photo.mesh import PhotoMesh
from tts2face.photo.mouth import PICTURED
from tts2face.photo.shapes import PhotoPerson
from tts2face.photo.surface import EYES, LASHES, LID_OVER_EYE, LIDS, SKIN
from tts2face.picture.baked.response import MOVE_MM

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
MOST_TURNED, MOST_CHANGED = 30.0, 120.0  # of 255, change of the light of skin, and of that around lashes
MOUTH_OPEN = 1.1  # of the colour in open light, where the lips are wide open
SHADE_TINT = np.array([0.8, 1.05, 1.1])  # of what wrinkles darken: light between them is redder
NO_EYES = np.array([0.2, 0.4], np.float32)  # edges of pupil and iris, of which a photographed face has none
TURN_TERMS, MOVE_TERMS = slice(1, 4), slice(4, 7)  # of `tts2face.picture.baked.response.write_terms`
LEAST_RESPONSE = 1e-6  # of 255, of a response
CURVE_TERM = 2  # of `tts2face.picture.baked.response.write_mouth_terms`
RAISED = ("browInnerUp", "browOuterUpLeft", "browOuterUpRight")
SMILING = ("mouthSmileLeft", "mouthSmileRight")
UNLIKE_SMILES = ("jawOpen", "mouthPucker")  # whose motion of the cheeks is none of a smile
LEAST_MM = 0.6  # of movement, below which skin has no wrinkles
BROW_EDGES = (70, 63, 105, 66, 107, 336, 296, 334, 293, 300)  # upper edges, from the person's right to the left
FOREHEAD_TOP, NOSE_TIP = 10, 1  # landmarks
FOREHEAD = (0.12, 0.3, 0.75, 1.0)  # of the way from brows to its top, over which lines rise and fade
LEAST_HIGH = 0.1  # of that half width, of the height of a forehead
N_LINES = 3.0  # from brows to top
FOREHEAD_SIDE = (0.75, 1.05)  # of the half width of the brows, over which lines end
FOLDS = ((129, 203, 206, 216, 212), (358, 423, 426, 436, 432))  # from the wings of the nose past the mouth
FOLD_ENDS = (0.1, 0.3, 0.75, 1.0)  # of the way along it, over which it begins and ends
FOLD_REACH, CHEEK_REACH = 0.024, 0.045  # of the eye distance, of the shade of a fold and of the light beside it
CHEEK_SHARE = 0.5  # of that light
FOLD_BAND = 0.1  # of the eye distance to either side of a fold, beyond which nothing is searched
NEAR_FOLD = 2.0  # reaches of a fold, in which what the picture shows is one
N_FOLD_POINTS = 81  # points along a fold
TINY = 1e-9  # mm squared
FAINT_LINES, FAINT_FOLDS = 0.018, 0.05  # of the colour: lines that the picture does not show
DEEPER = 1.2  # lines that it shows, by how much of them
MOST_SHOWN = 0.05  # of the colour, of what counts as a line
LINE_BLUR = 0.01  # of the eye distance, as all of these ways
ON_LINE = (-0.06, -0.03, 0.0, 0.03, 0.06)  # places on a line that are compared with those to its sides
BESIDE_LINE = (-0.06, -0.045, 0.045, 0.06)


@dataclass(frozen=True, slots=True, eq=False)
class MouthRows:
    """Parts behind lips, each its vertices (N,) and their colours (N, 3) in open light.

    They come from the dark, a share (3,) of the colours, as the lips open.
    """

    pictured: Sequence[tuple[IntArray, FloatArray]]
    lit: Sequence[tuple[IntArray, FloatArray]]
    dark: FloatArray

    def light(self) -> tuple[IntArray, FloatArray, FloatArray]:
        """Vertices (M,), their base (M, 3), which is added to that of a picture, and responses (6, 3, M)."""
        rows, bases, responses = [], [], []
        none = np.zeros(3)
        for parts, base, dark, opened in (
            (self.pictured, none, self.dark - 1, MOUTH_OPEN - self.dark),
            (self.lit, self.dark, none, MOUTH_OPEN - self.dark),
        ):
            for numbers, colours in parts:
                answer = np.zeros((N_MOUTH_TERMS, 3, len(numbers)))
                answer[0], answer[CURVE_TERM] = (dark * colours).T, (opened * colours).T
                rows.append(numbers)
                bases.append(base * colours)
                responses.append(answer)
        return np.concatenate(rows), np.concatenate(bases), np.concatenate(responses, axis=2)


@dataclass(frozen=True, slots=True, eq=False)
class Changing:
    """Vertices (N,) whose colours change by (N, 3) as they go some ways (N, 3), mm."""

    vertices: IntArray
    ways: FloatArray
    change: FloatArray

    def responses(self) -> FloatArray:
        """(10, 3, N) responses of their light."""
        found = np.zeros((N_TERMS, 3, len(self.vertices)))
        way = float(MOVE_MM) * self.ways / (self.ways**2).sum(axis=1, keepdims=True)
        found[MOVE_TERMS] = np.einsum("nt,nc->tcn", way, self.change)
        return found


def skin_light(
    pixels: Pixels, mesh: PhotoMesh, vertices: FloatArray, by_movement: FloatArray
) -> tuple[IntArray, FloatArray]:
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


def _fit(terms: FloatArray, values: FloatArray) -> FloatArray:
    usual = float(np.median(values)) * USUAL_LIGHT
    ridge = np.diag(LIGHT_RIDGE) * len(values)
    weights = np.ones(len(values))
    for _ in range(ROUNDS):
        weighted = terms * weights[:, None]
        light = np.linalg.solve(weighted.T @ terms + ridge, weighted.T @ values + ridge @ usual)
        off = np.abs(values - terms @ light)
        weights = 1 / (1 + (off / (np.median(off) + LEAST_OFF)) ** 2)
    return np.asarray(light)


def _blurred(pixels: Pixels, spread: float, places: FloatArray) -> FloatArray:
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
    pixels: Pixels,
    pages: Pixels,
    skin: tuple[PhotoMesh, FloatArray, FloatArray],
    drawn: IntArray,
    mouth: MouthRows,
    lashes: Changing,
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
    lashes
        Vertices of lashes that move.
    """
    rows, responses = skin_light(pixels, *skin)
    limits = [equal_limits(MOST_TURNED, len(rows)), equal_limits(MOST_CHANGED, len(lashes.vertices))]
    rows = np.concatenate([rows, lashes.vertices])
    responses = np.concatenate([responses, lashes.responses()], axis=2)
    answers, sizes = quantised(responses, least=LEAST_RESPONSE)
    mouth_rows, lit, openings = mouth.light()
    mouth_answers, mouth_sizes = quantised(openings, least=LEAST_RESPONSE)
    n_texels = N_PAGES * LEAST_SIDE**2 + LEAST_SIDE * (LEAST_SIDE // BLACK_SHARE)
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
        page_of={SKIN: 0, LASHES: 1, LIDS: 1, LID_OVER_EYE: 1, EYES: 1, PICTURED: 1},
        rows=rows.astype(np.int32),
        responses=answers,
        response_sizes=sizes,
        limits=np.concatenate(limits, axis=2),
        partners=rows.astype(np.int32),
        mouth_rows=mouth_rows.astype(np.int32),
        mouth_base=np.rint(lit).astype(np.uint8),
        mouth_responses=mouth_answers,
        mouth_sizes=mouth_sizes,
        mouth_limits=equal_limits(255.0, len(mouth_rows)),
        ball_rows=np.zeros(0, np.int32),
        ball_base=np.zeros((0, 3), np.float32),
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


def wrinkles(pixels: Pixels, mesh: PhotoMesh, motion: Mapping[str, FloatArray], person: PhotoPerson) -> FloatArray:
    """(3, V) change of the light of vertices by their movement over `MOVE_MM`, of their colour.

    Parameters
    ----------
    motion
        Displacements (V, 3) by shape, mm.
    """
    raised, smiling = (np.sum([motion[name] for name in names], axis=0) for names in (RAISED, SMILING))
    others = [motion[name] for name in UNLIKE_SMILES]
    lines, folds = _forehead_lines(pixels, mesh, person), _smile_folds(pixels, mesh, person)
    found = _answers(raised, []) * lines[:, None] + _answers(smiling, others) * folds[:, None]
    return np.ascontiguousarray(found.T) * float(MOVE_MM)


def _answers(motion: FloatArray, others: Sequence[FloatArray]) -> FloatArray:
    """(V, 3) factors of a movement that are 1 together for a motion (V, 3), and as near to 0 as may be for others."""
    moves = np.linalg.norm(motion, axis=1) > LEAST_MM
    rows = np.stack([motion, *others], axis=1)[moves]
    gram = rows @ rows.transpose(0, 2, 1) + np.diag([TINY] + [LEAST_MM**2] * len(others))
    shares = np.linalg.solve(gram, np.eye(len(others) + 1)[:, :1])
    answers = np.zeros_like(motion)
    answers[moves] = (shares * rows).sum(axis=1)
    return answers


def _forehead_lines(pixels: Pixels, mesh: PhotoMesh, person: PhotoPerson) -> FloatArray:
    """(V,) change of light in lines across the forehead, of the colour."""
    brows, top = person.landmarks[list(BROW_EDGES), :2], person.landmarks[FOREHEAD_TOP, :2]
    along = brows[-1] - brows[0]
    half = float(np.linalg.norm(along)) / 2
    along = along / (2 * half)
    up = np.array([along[1], -along[0]])
    middle = (brows[0] + brows[-1]) / 2
    across = (mesh.places - middle) @ along
    edge = np.interp(across, (brows - middle) @ along, (brows - middle) @ up)
    high = float((top - middle) @ up)
    share = ((mesh.places - middle) @ up - edge) / np.maximum(high - edge, LEAST_HIGH * half)
    faint = FAINT_LINES * np.cos(2 * np.pi * N_LINES * share)
    inside = _between(share, FOREHEAD) * (1 - smoothstep(np.abs(across) / half, *FOREHEAD_SIDE))
    rows = np.flatnonzero(inside)
    faint[rows] += DEEPER * _shown_lines(pixels, mesh.places[rows], np.tile(along, (len(rows), 1)), person.scale)
    found: FloatArray = inside * faint
    return found


def _smile_folds(pixels: Pixels, mesh: PhotoMesh, person: PhotoPerson) -> FloatArray:
    """(V,) change of light at the folds from nose to mouth, of the colour; less where the picture smiles already."""
    found = np.zeros(len(mesh.places))
    for numbers in FOLDS:
        line = person.landmarks[list(numbers), :2]
        way, at, direction = _nearest(line, mesh.places)
        outwards = np.sign((line[0] - person.landmarks[NOSE_TIP, :2])[0])
        aside = way * outwards / person.scale
        beside = np.where(aside > 0, np.exp(-(((aside - CHEEK_REACH) / CHEEK_REACH) ** 2)), 0.0)
        change = FAINT_FOLDS * (CHEEK_SHARE * beside - np.exp(-((aside / FOLD_REACH) ** 2)))
        within = _between(at, FOLD_ENDS)
        rows = np.flatnonzero((within > 0) & (np.abs(aside) < FOLD_BAND))
        shown = _shown_lines(pixels, mesh.places[rows], direction[rows], person.scale)
        near = np.exp(-((aside[rows] / (NEAR_FOLD * FOLD_REACH)) ** 2))
        change[rows] += DEEPER * near * np.minimum(shown, 0.0)
        found += within * change
    return found * (1 - person.smile)


def _nearest(line: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Way from a line (M, 2) to places (V, 2), positive to the right in the picture, share of it, and its direction."""
    fine = np.stack(
        [np.interp(np.linspace(0, len(line) - 1, N_FOLD_POINTS), np.arange(len(line)), line[:, k]) for k in (0, 1)], 1
    )
    steps = np.gradient(fine, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    away_x, away_y = (places[:, k, None] - fine[:, k] for k in (0, 1))
    best = np.sqrt(away_x * away_x + away_y * away_y).argmin(axis=1)
    direction = steps[best]
    right = np.column_stack([np.abs(direction[:, 1]), -direction[:, 0] * np.sign(direction[:, 1])])
    way: FloatArray = ((places - fine[best]) * right).sum(axis=1)
    return way, best / (len(fine) - 1), direction


def _shown_lines(pixels: Pixels, places: FloatArray, direction: FloatArray, scale: float) -> FloatArray:
    """(V,) how much brighter a picture is on lines in a direction (V, 2) than to their sides, of its brightness."""
    if not len(places):
        return np.zeros(0)
    side = np.column_stack([-direction[:, 1], direction[:, 0]])
    on = [places + way * scale * direction for way in ON_LINE]
    off = [place + way * scale * side for way in BESIDE_LINE for place in on]
    grey = grey_at(pixels, np.stack([*on, *off], axis=1), max(LEAST_BLUR_PX, LINE_BLUR * scale))
    own, others = grey[:, : len(on)].mean(axis=1), grey[:, len(on) :].mean(axis=1)
    found: FloatArray = np.clip((own - others) / np.maximum(others, 1.0), -MOST_SHOWN, MOST_SHOWN)
    return found


def _between(share: FloatArray, limits: tuple[float, float, float, float]) -> FloatArray:
    """1 between the second and the third of four limits, falling to 0 at the first and the last."""
    found: FloatArray = smoothstep(share, *limits[:2]) * (1 - smoothstep(share, *limits[2:]))
    return found
