"""Shapes of a photographed face: those of the shipped head, carried to its mesh by their common landmarks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tts2face.models.landmarks import (
    CHIN,
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.numeric.arrays import FloatArray, IntArray, smoothstep
from tts2face.photo.camera import PhotoCamera
from tts2face.photo.lids import LID_MEETING
from tts2face.photo.lines import LID_MARGINS, N_LID, N_LIP, InnerLips, spline_weights
from tts2face.photo.mesh import LIP_RINGS, PhotoMesh
from tts2face.photo.spreading import Spreading

OWN_SHAPES = ("eyeBlink", "eyeLook", "tongue")  # prefixes of the head's shapes whose skin is moved otherwise
# Towards landmarks of the skin, of the face's oval, of brows, and lips and lids.
SKIN_PULL = 0.05
OVAL_PULL = 0.003
BROW_PULL = 0.2
LINE_PULL = 1e3
STILL_FROM = 0.75  # of the eye distance from the face, beyond which no shape moves it
BROWS = (
    ((70, 46), (63, 53), (105, 52), (66, 65), (107, 55)),
    ((300, 276), (293, 283), (334, 282), (296, 295), (336, 285)),
)  # upper and lower landmarks of each brow, which move as one
BELOW_LIDS = ((25, 110, 24, 23, 22, 26, 112), (255, 339, 254, 253, 252, 256, 341))
AROUND_EYES = ((130, 243), (359, 463))
BELOW_FOLLOW = 0.35  # of the way of the lower margin, by which the landmarks below it follow
FEATURES_STILL = 0.2  # of the eye distance outside the face, beyond which blinks and closing lips move nothing
LOOK_DOWN, LOOK_UP = 0.22, -0.10  # of a blink, by which the lids follow the gaze
UPPER_SHARE, SMILING_SHARE = 0.25, 0.3  # of the way on which lips meet, of the upper lip; more in a smile
LOWER_FOLLOW = (0.97, 1.05)  # of that way, by which the red of the lower lip and its outer edge follow
PARTED = 0.03  # of the eye distance: a gap of lips that do not touch
MOUTH_MIDDLE = (0, 17, 13)  # landmarks of the upper edge, the lower edge and the middle of the mouth
LIP_STILL = 0.34  # of the eye distance from the mouth, beyond which closing lips move nothing
BREATH_MM = 3.0  # rise of the shoulders
SHOULDERS = (0.1, 0.9)  # below the chin, of the eye distance, over which they begin
BELOW_SHOULDERS = (2.0, 3.6)  # over which their rise fades downwards
BESIDE_SHOULDERS = (1.2, 2.0)  # from the middle of the face, of its width, over which they end
NECK_FADE = (-0.05, 0.95)  # below the chin, of the eye distance, over which skin stops following the head
TOP, SIDES_OF_FACE = 10, (234, 454)  # landmarks
HEAD_ELLIPSE = (0.66, 0.78, 0.66)  # half axes of the head: of the face's width to the side, of its height up and down
HEAD_MIDDLE = 0.14  # of the height of the face above its middle
HEAD_FADE = (1.0, 1.75)  # half axes over which the background stops following the head
BESIDE_NECK = (0.35, 0.75)  # of the face's width
EDGE_STILL_PX, EDGE_FADE = 0.5, 0.25  # at the edges of the mesh: pixels that never move; of the eye distance beyond
AWAY, FAR = 0.05, 0.1  # half axes of the head, and eye distances from the face, from which background is
RIM = 0.02  # of the eye distance within the face
DEPTH_PULL, RIM_DEPTH_PULL = 0.015, 0.001  # towards known depths, and those at the oval of the face
BACKGROUND_DEPTH, BEYOND_DEPTH = 0.12, 0.05  # of the background before the pivot, and what may lie beyond it


@dataclass(frozen=True, slots=True, eq=False)
class PhotoPerson:
    """A person in a picture: its size (width, height), landmarks (478, 3) in pixels and depths, lips, and smile."""

    size: tuple[int, int]
    landmarks: FloatArray
    lips: InnerLips
    smile: float
    scale: float

    @property
    def is_parted(self) -> bool:
        """Whether the lips do not touch."""
        return self.lips.gap > PARTED

    @property
    def upper_share(self) -> float:
        """Share of the upper lip in the way on which the lips meet."""
        return UPPER_SHARE + SMILING_SHARE * self.smile * self.is_parted


def face_shapes(
    mesh: PhotoMesh, spreading: Spreading, motion: Mapping[str, FloatArray], person: PhotoPerson
) -> dict[str, FloatArray]:
    """Displacements (V, 3) of a mesh by the motion (478, 3) of the head's landmarks in each shape, mm."""
    names = [name for name in motion if not name.startswith(OWN_SHAPES)]
    moved = np.stack([motion[name] for name in names], axis=1)
    for brow in BROWS:
        for pair in brow:
            moved[list(pair)] = moved[list(pair)].mean(axis=0)
    of_lip, of_lid = spline_weights(len(INNER_LIP_UPPER), N_LIP), spline_weights(len(LID_MARGINS[0][0]), N_LID)
    lines: list[tuple[IntArray, FloatArray, Sequence[int]]] = [
        (mesh.upper_lip, of_lip, INNER_LIP_UPPER),
        (mesh.lower_lip, of_lip, INNER_LIP_LOWER),
    ]
    for upper, lower, lids in zip(mesh.upper_lids, mesh.lower_lids, LID_MARGINS, strict=True):
        lines += [(upper, of_lid, lids[0]), (lower, of_lid, lids[1])]
    pull = np.full(len(mesh.landmarks), SKIN_PULL)
    pull[np.isin(mesh.landmarks, FACE_OVAL)] = OVAL_PULL
    pull[np.isin(mesh.landmarks, [number for brow in BROWS for pair in brow for number in pair])] = BROW_PULL
    known = [mesh.landmark_vertices]
    values = [moved[mesh.landmarks]]
    pulls = [pull]
    for vertices, weights, numbers in lines:
        known.append(vertices)
        values.append(np.einsum("ij,jkc->ikc", weights, moved[list(numbers)]))
        pulls.append(np.full(len(vertices), LINE_PULL))
    still = _still(mesh, STILL_FROM * person.scale, known)
    found = spreading.near(np.concatenate(known), np.concatenate(values), np.concatenate(pulls), still)
    for rows, upper in zip(mesh.bands, mesh.upper_lids, strict=True):
        found[rows] = found[upper[1:-1]]
    return {name: found[:, number] for number, name in enumerate(names)}


def _still(mesh: PhotoMesh, way: float, others: Sequence[IntArray]) -> IntArray:
    """Vertices that lie farther from the face than a way, or at the edge of the picture, without others."""
    far = np.union1d(np.flatnonzero(mesh.outside > way), mesh.border)
    return np.setdiff1d(far, np.concatenate(others))


def lid_ways(mesh: PhotoMesh, eye: int) -> tuple[FloatArray, FloatArray]:
    """(25, 3) ways of the margins of an upper and a lower lid that shut an eye, pixels and depths."""
    points = np.column_stack([mesh.places, np.zeros(len(mesh.places))])
    points[mesh.known, 2] = mesh.depths
    upper, lower = points[mesh.upper_lids[eye]], points[mesh.lower_lids[eye]]
    meeting = lower + LID_MEETING * (upper - lower)
    return meeting - upper, meeting - lower


def lid_motion(mesh: PhotoMesh, spreading: Spreading, person: PhotoPerson, eye: int) -> tuple[FloatArray, FloatArray]:
    """(V, 3) displacements of the skin around an eye that is shut, pixels and depths, and of what its upper lid lowers.

    In the first the upper lid rests: what comes over the eye is `tts2face.photo.lids`.
    """
    ways = lid_ways(mesh, eye)
    upper, lower = mesh.places[mesh.upper_lids[eye]], mesh.lower_lids[eye]
    along = upper[-1] - upper[0]
    at_line = (upper - upper[0]) @ along / (along @ along)
    vertex_of = mesh.vertex_of
    zero = np.zeros(3)
    found: dict[int, tuple[FloatArray, FloatArray]] = {
        int(at): (way, zero) for at, way in zip(lower, ways[1], strict=True)
    }
    for row in (mesh.upper_lids[eye][1:-1], *mesh.bands[eye]):
        found |= {int(at): (zero, way) for at, way in zip(row, ways[0][1:-1], strict=True)}
    for number in BELOW_LIDS[eye]:
        if number in vertex_of:
            at = np.clip((person.landmarks[number, :2] - upper[0]) @ along / (along @ along), 0, 1)
            way = np.array([np.interp(at, at_line, ways[1][:, k]) for k in range(3)])
            found[vertex_of[number]] = (BELOW_FOLLOW * way, zero)
    free = {*AROUND_EYES[eye]}
    for number, vertex in vertex_of.items():
        if number not in free:
            found.setdefault(vertex, (zero, zero))
    still = [mesh.upper_lids[1 - eye], mesh.lower_lids[1 - eye], mesh.upper_lip, mesh.lower_lip]
    for vertex in np.concatenate([*still, _still(mesh, FEATURES_STILL * person.scale, still)]).tolist():
        found.setdefault(vertex, (zero, zero))
    moved = spreading.exact(np.array(list(found)), np.array(list(found.values())))
    return moved[:, 0], moved[:, 1]


def closing(mesh: PhotoMesh, spreading: Spreading, person: PhotoPerson) -> FloatArray:
    """(V, 3) displacement that closes the lips of the picture, pixels and depths."""
    if person.lips.is_closed:
        return np.zeros((len(mesh.places), 3))
    ways = person.lips.lower - person.lips.upper
    numbers = np.arange(N_LIP)
    follow: dict[int, FloatArray] = {}
    vertex_of = mesh.vertex_of
    at_landmark = np.linspace(0, N_LIP - 1, len(INNER_LIP_UPPER))
    for line, outer, ring, share, near, far in (
        (mesh.upper_lip, OUTER_LIP_UPPER, LIP_RINGS[0], person.upper_share, 1.0, 1.0),
        (mesh.lower_lip, OUTER_LIP_LOWER, LIP_RINGS[1], person.upper_share - 1, *LOWER_FOLLOW),
    ):
        follow |= {int(vertex): share * ways[k] for k, vertex in zip(numbers, line, strict=True)}
        for row, part in ((ring, near), (outer, far)):
            for place, number in zip(at_landmark, row, strict=True):
                if number in vertex_of:
                    way = [np.interp(place, numbers, ways[:, c]) for c in range(3)]
                    follow.setdefault(vertex_of[number], share * part * np.array(way))
    mouth = person.landmarks[[MOUTH_CORNER_RIGHT, MOUTH_CORNER_LEFT, *MOUTH_MIDDLE], :2]
    far_off = np.linalg.norm(mesh.places[mesh.landmark_vertices][:, None] - mouth, axis=2).min(axis=1)
    still = [mesh.landmark_vertices[far_off > LIP_STILL * person.scale], *mesh.upper_lids, *mesh.lower_lids]
    for vertex in np.concatenate([*still, _still(mesh, FEATURES_STILL * person.scale, still)]).tolist():
        follow.setdefault(vertex, np.zeros(3))
    return spreading.exact(np.array(list(follow)), np.array(list(follow.values())))


@dataclass(frozen=True, slots=True, eq=False)
class HeadRegion:
    """Where the head lies in a picture: ellipse and neck."""

    across: FloatArray
    down: FloatArray
    middle: FloatArray
    half_axes: tuple[float, float, float]
    chin: FloatArray
    width: float

    @classmethod
    def of(cls, landmarks: FloatArray) -> "HeadRegion":
        """Region of landmarks (478, 2 or 3), pixels."""
        top, chin = landmarks[TOP, :2], landmarks[CHIN, :2]
        height = float(np.linalg.norm(chin - top))
        width = float(np.linalg.norm(landmarks[SIDES_OF_FACE[0], :2] - landmarks[SIDES_OF_FACE[1], :2]))
        down = (chin - top) / height
        middle = (top + chin) / 2 - HEAD_MIDDLE * height * down
        side, up, below = HEAD_ELLIPSE
        return cls(
            np.array([down[1], -down[0]]), down, middle, (side * width, up * height, below * height), chin, width
        )

    def radius(self, places: FloatArray) -> FloatArray:
        """(N,) way of places (N, 2) from the middle of the head in its half axes."""
        off = places - self.middle
        side, up, below = self.half_axes
        across, down = off @ self.across, off @ self.down
        found: FloatArray = np.hypot(across / side, np.where(down < 0, down / up, down / below))
        return found


def head_follow(mesh: PhotoMesh, person: PhotoPerson) -> FloatArray:
    """(V,) share of the head's motion that vertices follow."""
    region, scale = HeadRegion.of(person.landmarks), person.scale
    follow = 1 - smoothstep(region.radius(mesh.places), *HEAD_FADE)
    below = (mesh.places - region.chin) @ region.down
    aside = np.abs((mesh.places - region.middle) @ region.across)
    neck = 1 - smoothstep(below / scale, *NECK_FADE)
    beside = 1 - smoothstep(aside / region.width, *BESIDE_NECK)
    follow = np.where(below > 0, np.maximum(follow, beside) * neck, follow)
    return np.where(mesh.outside <= 0, 1.0, follow) * edge_share(mesh, person)


def edge_share(mesh: PhotoMesh, person: PhotoPerson) -> FloatArray:
    """(V,) 1 in what may move of the picture, falling to 0 at its edges."""
    low, high = mesh.frame
    inside = np.minimum(mesh.places - low, high - mesh.places).min(axis=1)
    return smoothstep(np.maximum(inside - EDGE_STILL_PX, 0.0) / person.scale, 0.0, EDGE_FADE)


def breathing(mesh: PhotoMesh, person: PhotoPerson, follow: FloatArray, px_per_mm: float) -> FloatArray:
    """(V, 3) rise of the shoulders, pixels and depths."""
    region = HeadRegion.of(person.landmarks)
    below = (mesh.places - region.chin) @ region.down / person.scale
    aside = np.abs((mesh.places - region.middle) @ region.across) / region.width
    share = smoothstep(below, *SHOULDERS) * (1 - smoothstep(below, *BELOW_SHOULDERS))
    share *= (1 - follow) * (1 - smoothstep(aside, *BESIDE_SHOULDERS))
    rise = BREATH_MM * px_per_mm * np.append(-region.down, 0.0)
    found: FloatArray = (share * edge_share(mesh, person))[:, None] * rise
    return found


def depths(
    mesh: PhotoMesh, spreading: Spreading, person: PhotoPerson, camera: PhotoCamera, pivot: FloatArray
) -> FloatArray:
    """(V,) depths of all vertices: of the background, a little before the pivot of the head."""
    scale = person.scale
    behind = camera.to_pixels(pivot[None])[0, 2] + BACKGROUND_DEPTH * scale
    away = HeadRegion.of(person.landmarks).radius(mesh.places) > HEAD_FADE[0] + AWAY
    far = np.setdiff1d(np.flatnonzero(away & (mesh.outside > FAR * scale)), mesh.known)
    at_rim = mesh.outside[mesh.known] > -RIM * scale
    pulls = np.concatenate([np.where(at_rim, RIM_DEPTH_PULL, DEPTH_PULL), np.full(len(far), DEPTH_PULL)])
    values = np.concatenate([mesh.depths, np.full(len(far), behind)])
    found = spreading.near(np.concatenate([mesh.known, far]), values, pulls)
    bounded: FloatArray = np.maximum(found, behind - BEYOND_DEPTH * scale)
    return bounded
