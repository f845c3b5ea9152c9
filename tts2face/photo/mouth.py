"""The mouth that a photograph does not show: the head's teeth, gums and tongue, and the walls of the mouth."""

from dataclasses import dataclass, replace

import numpy as np

from tts2face.models.face import Face
from tts2face.models.landmarks import MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT, UPPER_LIP_INNER_MID
from tts2face.numeric.arrays import LUMINANCE, FloatArray, IntArray, Pixels, decode_srgb, encode_srgb, vertex_normals
from tts2face.photo.mesh import PhotoMesh

PICTURED = "teeth_pictured"  # part of upper teeth that a picture shows
TEETH, OTHERS = ("teeth_upper", "teeth_lower"), ("gums_upper", "gums_lower", "tongue")
UPPER_JAW, LOWER_JAW = (TEETH[0], OTHERS[0]), (TEETH[1], OTHERS[1])
WIDTH_LIMITS = (0.88, 1.1)  # of the mouth over the head's
PARTED_WIDTH = 0.85  # of a mouth that is open in the picture, and wider for it
BEHIND_MM = 1.0  # further back than in the head: lips are thinner than the head's
OPEN_TOOTH = 70  # percentile of the head's colours of teeth
GUM_SHARE = np.array([0.8, 0.66, 0.66])  # of the light of teeth that falls on gums and tongue
GAP_SHARE = 0.25  # of the darkness of gaps between teeth
DEPTH_MM, TONGUE_DEPTH_MM = 13.0, 17.0  # over which light falls to 1/e
LOWER_SHARE, ROOT_SHARE = 0.7, 0.4  # of the light of upper teeth on the edges of lower ones, and at the height below:
LOWER_MM = 7.0  # light comes from above, and the lower lip stands before them
DARK_SHARE = np.array([0.24, 0.16, 0.13])  # of open light, behind lips that hardly part: from lips and cheeks
DEEP_TINT = np.array([1.0, 0.62, 0.55])  # of light that has gone deep
AMBIENT = 0.30  # of the light of a tooth that faces the viewer
LIGHT_FROM = np.array([0.1, 0.35, 0.93])
CHEEKS = (50, 280, 205, 425, 101, 330)
LIP_RED = (15, 16, 86, 316, 12)
CHEEK_PX, LIP_PX = 3, 1  # around these, whose colours are taken
EDGE_MM = 4.0  # around the middle of the upper teeth, and behind their front, within which their edge is searched
TEETH_OVER_SKIN, TEETH_OVER_WHITE = 0.8, 0.62  # luminance of teeth, at least of the cheeks', and of the eyes' white
TINT_POWERS, SKIN_SHARE = (0.6, 0.35), 0.25  # of the hues of the eyes' white and the skin in teeth; the skin's share
TEETH_LIMITS = (0.06, 0.75)  # of the luminance of teeth
LEAST_HUE = 0.2  # range of the colours of lips, of the largest; .4 to .8 in colour pictures, 0 in grey ones
LEAST_LIGHT = 1e-3  # of any colour that is measured, so that black has a hue
WALL_MM = (0.0, 2.5, 8.0, 22.0)  # depth of the rings of the wall behind the lips
WALL_OUT_MM = (0.0, 0.8, 5.0, 7.0)  # and how much wider than the opening they are
WALL_FOLLOW = (1.0, 1.0, 0.8, 0.5)  # share of the motion of the lips that they follow
WALL_LIGHT = (0.60, 0.42, 0.24, 0.10)  # of the light of the lips
WALL_TINT = np.array([1.0, 0.55, 0.5])
BACK_MM, BACK_LIGHT = 40.0, 0.03


@dataclass(frozen=True, slots=True, eq=False)
class MouthInside:
    """Parts in the mouth: vertices (M, 3), mm, their shapes (K, M, 3), colours (M, 3) 0..255, and triangles by part.

    ``texels`` (M, 2) are places in a picture that shows the colours, if there is one.
    """

    vertices: FloatArray
    shapes: FloatArray
    colours: FloatArray
    parts: dict[str, IntArray]
    texels: FloatArray | None = None

    @property
    def teeth_edge(self) -> FloatArray:
        """(3,) middle of the edge of the upper teeth, mm."""
        teeth = self.vertices[np.unique(self.parts[TEETH[0] if self.texels is None else PICTURED])]
        middle = (teeth[:, 0].min() + teeth[:, 0].max()) / 2
        front = teeth[(np.abs(teeth[:, 0] - middle) < EDGE_MM) & (teeth[:, 2] > teeth[:, 2].max() - EDGE_MM)]
        place: FloatArray = front[front[:, 1].argmin()] * (0, 1, 1) + (middle, 0, 0)
        return place

    def moved(self, way: FloatArray) -> "MouthInside":
        """The parts, moved by a way (3,), mm."""
        return replace(self, vertices=self.vertices + way)


@dataclass(frozen=True, slots=True, eq=False)
class MouthPlace:
    """Where the mouth of a head lies in a face: a point (3,) of the head comes to its lips' middle (3,), mm."""

    size: float
    middle: FloatArray
    lip: FloatArray

    @classmethod
    def of(cls, head_landmarks: FloatArray, landmarks: FloatArray, *, is_parted: bool) -> "MouthPlace":
        """Behind lips of a face with landmarks (478, 3), mm."""
        corners = [MOUTH_CORNER_RIGHT, MOUTH_CORNER_LEFT]
        wide, usual = (np.linalg.norm(np.diff(points[corners], axis=0)) for points in (landmarks, head_landmarks))
        size = float(np.clip(wide / usual * (PARTED_WIDTH if is_parted else 1.0), *WIDTH_LIMITS))
        return cls(size, head_landmarks[UPPER_LIP_INNER_MID], landmarks[UPPER_LIP_INNER_MID])

    def to_face(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) of the head in the face."""
        placed: FloatArray = (points - self.middle) * self.size + self.lip - (0.0, 0.0, BEHIND_MM)
        return placed


def head_mouth(
    head: Face, place: MouthPlace, light: "MouthLight", given_way: tuple[float, float, float] | None = None
) -> MouthInside:
    """Teeth, gums and tongue of a head in a face.

    Its upper teeth may give way to others, from one place across to another one, mm; the rest of them rises by some.
    """
    names = (*TEETH, *OTHERS)
    by_part = {
        part.name: head.triangles[part.first : part.first + part.count].astype(np.int64)
        for part in head.parts
        if part.name in names
    }
    used, rows = np.unique(np.concatenate(list(by_part.values())), return_inverse=True)
    ends = np.cumsum([len(triangles) for triangles in by_part.values()])
    by_part = dict(zip(by_part, np.split(rows.reshape(-1, 3), ends[:-1]), strict=True))
    vertices = place.to_face(head.vertices[used].astype(np.float64))
    shapes = head.shapes[:, used].astype(np.float64) * place.size
    colours = _colours(head, used, by_part, vertices, light)
    if given_way is not None:
        low, high, rise = given_way
        vertices[np.unique(np.concatenate([by_part[name] for name in UPPER_JAW])), 1] += rise
        across = vertices[by_part[TEETH[0]], 0]
        by_part[TEETH[0]] = by_part[TEETH[0]][(across.max(axis=1) < low) | (across.min(axis=1) > high)]
    return MouthInside(vertices, shapes, colours, by_part)


@dataclass(frozen=True, slots=True, eq=False)
class MouthLight:
    """Linear light of the teeth (3,) and of the lips (3,)."""

    teeth: FloatArray
    lips: FloatArray

    @property
    def dark(self) -> FloatArray:
        """(3,) displayed colours behind lips that hardly part, of those in open light."""
        share: FloatArray = np.divide(*self.displayed(np.stack([self.teeth * DARK_SHARE, self.teeth])))
        return share

    def displayed(self, linear: FloatArray) -> FloatArray:
        """Colours (N, 3), 0..255, of linear light (N, 3), in grey where the lips are grey."""
        hue = min(1.0, float(np.ptp(self.lips) / self.lips.max()) / LEAST_HUE)
        grey = (linear @ LUMINANCE)[:, None]
        return encode_srgb(grey + hue * (linear - grey)).astype(np.float64)


def mouth_light(pixels: Pixels, landmarks: FloatArray, sclera: FloatArray) -> MouthLight:
    """Light in a mouth from the colours of cheeks, lips and the white of the eyes (3,), 0..255."""
    skin, lips = cheek_light(pixels, landmarks), _median(pixels, landmarks[list(LIP_RED), :2], LIP_PX)
    white = np.maximum(decode_srgb(sclera / 255), LEAST_LIGHT)
    bright = float(
        np.clip(max(TEETH_OVER_SKIN * (skin @ LUMINANCE), TEETH_OVER_WHITE * (white @ LUMINANCE)), *TEETH_LIMITS)
    )
    tints = [(light / (light @ LUMINANCE)) ** power for light, power in zip((white, skin), TINT_POWERS, strict=True)]
    tint = (1 - SKIN_SHARE) * tints[0] + SKIN_SHARE * tints[1]
    return MouthLight(bright * tint / float(tint @ LUMINANCE), lips)


def cheek_light(pixels: Pixels, landmarks: FloatArray) -> FloatArray:
    """Linear light (3,) of the cheeks of a face with landmarks (478, 2 or 3) in a picture (H, W, 3)."""
    return _median(pixels, landmarks[list(CHEEKS), :2], CHEEK_PX)


def _median(pixels: Pixels, places: FloatArray, reach: int) -> FloatArray:
    """Median linear light (3,) of the pixels around places (N, 2)."""
    found = []
    for across, down in np.rint(places).astype(int):
        rows, columns = (slice(max(at - reach, 0), max(at + reach + 1, 0)) for at in (down, across))
        found.append(pixels[rows, columns].reshape(-1, 3))
    every = np.concatenate(found)
    return np.maximum(decode_srgb(np.median(every if len(every) else pixels.reshape(-1, 3), axis=0) / 255), LEAST_LIGHT)


def _colours(
    head: Face, used: IntArray, parts: dict[str, IntArray], vertices: FloatArray, light: MouthLight
) -> FloatArray:
    """(M, 3) colours in open light, 0..255."""
    own = decode_srgb(head.colours[used] / 255.0)
    is_tooth = np.isin(np.arange(len(used)), np.concatenate([parts[name] for name in TEETH]))
    usual = np.percentile(
        own[np.unique(parts[TEETH[0]])], OPEN_TOOTH, axis=0
    )  # others are darkened by what covers them
    own[is_tooth] = np.where(own[is_tooth] < usual, usual - (usual - own[is_tooth]) * GAP_SHARE, own[is_tooth])
    gain = light.teeth / float(usual @ LUMINANCE)
    own[~is_tooth] *= GUM_SHARE
    front = vertices[np.unique(parts[TEETH[0]]), 2].max()
    reach = np.full(len(used), DEPTH_MM)
    reach[np.unique(parts["tongue"])] = TONGUE_DEPTH_MM
    share = np.exp(-np.clip(front - vertices[:, 2], 0, None) / reach)
    lower = np.unique(np.concatenate([parts[name] for name in LOWER_JAW]))
    edge = vertices[np.unique(parts[TEETH[1]]), 1].max()
    below = np.clip((edge - vertices[lower, 1]) / LOWER_MM, 0, 1)
    share[lower] *= LOWER_SHARE + (ROOT_SHARE - LOWER_SHARE) * below
    facing = np.clip(
        vertex_normals(vertices, np.concatenate(list(parts.values()))) @ (LIGHT_FROM / np.linalg.norm(LIGHT_FROM)), 0, 1
    )
    lit = own * gain * ((AMBIENT + (1 - AMBIENT) * facing) * share)[:, None] * DEEP_TINT ** (1 - share[:, None])
    return light.displayed(lit)


def mouth_walls(mesh: PhotoMesh, vertices: FloatArray, shapes: FloatArray, light: MouthLight) -> MouthInside:
    """Walls of a mouth, from the edges of the lips (of vertices (V, 3) and shapes (K, V, 3), mm) to the dark."""
    ring = np.concatenate([mesh.upper_lip, mesh.lower_lip[-2:0:-1]])
    n = len(ring)
    edge, middle = vertices[ring], vertices[ring].mean(axis=0)
    out = np.zeros((n, 3))
    out[1 : len(mesh.upper_lip) - 1, 1], out[len(mesh.upper_lip) :, 1] = 1.0, -1.0
    out[[0, len(mesh.upper_lip) - 1], 0] = np.sign(edge[[0, len(mesh.upper_lip) - 1], 0] - middle[0])
    rows, moves, colours = [], [], []
    lips = light.lips * WALL_TINT
    for back, wider, follow, bright in zip(WALL_MM, WALL_OUT_MM, WALL_FOLLOW, WALL_LIGHT, strict=True):
        rows.append(edge + wider * out - (0.0, 0.0, back))
        moves.append(follow * shapes[:, ring])
        colours.append(np.tile(lips * bright, (n, 1)))
    rows.append(middle[None] - (0.0, 0.0, BACK_MM))
    moves.append(np.zeros((len(shapes), 1, 3)))
    colours.append((lips * BACK_LIGHT)[None])
    triangles = []
    for k in range(len(WALL_MM) - 1):
        for i in range(n):
            a, b, c, d = k * n + i, k * n + (i + 1) % n, (k + 1) * n + i, (k + 1) * n + (i + 1) % n
            triangles += [(a, d, b), (a, c, d)]
    last, end = (len(WALL_MM) - 1) * n, len(WALL_MM) * n
    triangles += [(last + (i + 1) % n, last + i, end) for i in range(n)]
    return MouthInside(
        np.concatenate(rows),
        np.concatenate(moves, axis=1),
        light.displayed(np.concatenate(colours)),
        {"walls": np.array(triangles, np.int64)},
    )
