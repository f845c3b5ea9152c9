"""The face of the small made world: eyes, a mouth with known lips, and shapes of known size."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import Delaunay

from tts2face.models.face import Eye, Face, FacePart
from tts2face.models.landmarks import (
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LEFT_LIDS,
    N_LANDMARKS,
    N_MESH_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    RIGHT_LIDS,
)

# x to its own left, y up, z ahead, in mm.
MOUTH, MOUTH_WIDTH, LIP_HEIGHT = (0.0, -60.0), 50.0, 9.0
EYES, EYE_WIDTH, EYE_HEIGHT, EYEBALL = ((32.0, 0.0), (-32.0, 0.0)), 28.0, 10.0, 12.0
OVAL, OVAL_SIZE = (0.0, -20.0), (70.0, 95.0)
NOSE = (168, 6, 197, 195, 5, 4, 1, 2)  # landmarks from its root to its base
BROWS = ((300, 293, 334, 296, 336), (70, 63, 105, 66, 107))  # from the temples to the nose, left and right
IRISES = (range(473, 478), range(468, 473))
LIDS = (LEFT_LIDS, RIGHT_LIDS)
CHEEKS = ((425, 427, 411, 426, 436), (205, 207, 187, 206, 216))  # left and right
CHIN_SKIN = (208, 171, 175, 199, 396, 428)
LIPS = (*OUTER_LIP_UPPER, *OUTER_LIP_LOWER[1:-1], *INNER_LIP_UPPER, *INNER_LIP_LOWER[1:-1])
N_OTHER = 12  # places of landmarks without a name
PUPIL, SKIN, EYE_WHITE = (20, 30, 60), (206, 150, 124), (240, 240, 240)
GAZE_TURN = 0.5  # rad at weight 1
SPOKEN_SHAPES = {  # mm of the lips' corners outwards, of the upper and the lower lip upwards, of the lips ahead
    "mouthClose": (0.0, 0.0, 6.0, 0.0),
    "jawOpen": (-3.0, 0.0, -22.0, 0.0),
    "mouthFunnel": (-4.0, 3.0, -4.0, 4.0),
    "mouthPucker": (-8.0, 0.0, 0.0, 5.0),
    "mouthSmile": (8.0, 1.0, 1.0, -1.0),
    "mouthLowerDown": (0.0, 0.0, -6.0, 0.0),
}
ONE_SIDED = ("mouthSmile", "mouthLowerDown")


def landmark_places() -> np.ndarray:
    """(478, 3) landmarks of the face and of the talker at rest, lips closed."""
    few = _arc(OVAL, 1.6 * OVAL_SIZE[0], 0.8 * OVAL_SIZE[1], N_OTHER)
    flat = np.resize(few, (N_LANDMARKS, 2))  # landmarks without a name share places on the forehead: they cost little
    angles = np.pi / 2 - 2 * np.pi * np.arange(len(FACE_OVAL)) / len(FACE_OVAL)  # from the top over the left cheek
    flat[list(FACE_OVAL)] = np.add(OVAL, np.multiply(OVAL_SIZE, np.column_stack([np.cos(angles), np.sin(angles)])))
    for outer, inner, up in ((OUTER_LIP_UPPER, INNER_LIP_UPPER, 1.0), (OUTER_LIP_LOWER, INNER_LIP_LOWER, -1.0)):
        for lips, width, height in ((outer, MOUTH_WIDTH, LIP_HEIGHT), (inner, 0.9 * MOUTH_WIDTH, 0.0)):
            flat[list(lips)] = _arc(MOUTH, width, up * height, len(lips))
    for (x, y), lids, brow, iris in zip(EYES, LIDS, BROWS, IRISES, strict=True):
        side = np.sign(x)
        for lid, up in zip(lids, (1.0, -1.0), strict=True):  # both from the outer corner to the inner one
            flat[list(lid)] = _arc((x, y), -side * EYE_WIDTH, up * EYE_HEIGHT / 2, len(lid))
        flat[list(brow)] = _arc((x, y + 18.0), -side * 40.0, 5.0, len(brow))
        flat[iris[0]], flat[list(iris[1:])] = (x, y), np.add((x, y), [(5, 0), (0, 5), (-5, 0), (0, -5)])
    for numbers, (x, y) in ((CHEEKS[0], (38.0, -42.0)), (CHEEKS[1], (-38.0, -42.0)), (CHIN_SKIN, (0.0, -92.0))):
        flat[list(numbers)] = _arc((x, y), 16.0, -4.0, len(numbers))
    flat[list(NOSE)] = np.column_stack([np.zeros(len(NOSE)), np.linspace(2.0, -32.0, len(NOSE))])
    depth = 40.0 - 60.0 * np.square((flat - OVAL) / OVAL_SIZE).sum(axis=1)
    depth[list(NOSE)] += np.linspace(0.0, 20.0, len(NOSE))
    depth[N_MESH_LANDMARKS:] += EYEBALL / 2
    return np.column_stack([flat, depth])


def _arc(centre: tuple[float, float], width: float, height: float, n: int) -> np.ndarray:
    """(n, 2) points of half an ellipse, from its end at the lower x to the other one."""
    angles = np.linspace(np.pi, 0.0, n)
    return np.asarray(centre) + np.column_stack([width / 2 * np.cos(angles), height * np.sin(angles)])


def made_face() -> Face:
    """73 vertices of skin, most of them landmarks, two eyeballs of 6, and 18 shapes of jaw, lips, lids and gaze."""
    places = landmark_places()
    lids = [lid[at] for pair in LIDS for lid in pair for at in ((0, 4, 5, 8) if lid is pair[0] else (4, 5))]
    few = (*FACE_OVAL[::4], *NOSE[::3], *(number for pair in (*BROWS, *CHEEKS) for number in pair[::4]), CHIN_SKIN[2])
    numbers = [*LIPS, *lids, *few]
    spread = places.copy()  # with an open mouth, so that no triangle lies across the lips
    lower = list(INNER_LIP_LOWER[1:-1])
    spread[lower, 1] -= LIP_HEIGHT / 2
    spread[list(INNER_LIP_UPPER[1:-1]), 1] += LIP_HEIGHT / 2
    mesh = Delaunay(spread[numbers, :2])
    skin = mesh.simplices[~_is_hole(spread[numbers][mesh.simplices][..., :2].mean(axis=1))]
    n_skin, ball = len(numbers), _octahedron()
    blocks = [places[numbers], *(np.array((x, y, _eye_depth(places))) + EYEBALL * ball for x, y in EYES)]
    vertices = np.concatenate(blocks).astype(np.float32)
    ball_triangles = _outwards(ball, np.array([(a, b, c) for a in (0, 1) for b in (2, 3) for c in (4, 5)]))
    triangles = [_facing(vertices, skin), *(ball_triangles + n_skin + k * len(ball) for k in range(2))]
    firsts = np.cumsum([0, *map(len, triangles)])
    colours = np.repeat([SKIN, EYE_WHITE], [n_skin, 2 * len(ball)], axis=0).astype(np.uint8)
    colours[[n_skin + 4, n_skin + len(ball) + 4]] = PUPIL
    names, shapes = _face_shapes(vertices, numbers)
    corners, weights = _landmark_weights(mesh, spread, numbers)
    centres = [block.mean(axis=0).astype(np.float32) for block in blocks[1:]]
    return Face(
        vertices=vertices,
        triangles=np.concatenate(triangles).astype(np.int32),
        parts=tuple(
            FacePart(name, int(first), len(part), specular=0.3, shininess=30.0)
            for name, first, part in zip(("skin", "eye_left", "eye_right"), firsts, triangles, strict=False)
        ),
        shape_names=names,
        shapes=shapes,
        limits=np.tile(np.float32([0.0, 1.0]), (len(names), 1)),
        eyes=tuple(
            Eye(n_skin + k * len(ball), len(ball), centre, _eye_turns(side))
            for k, (centre, side) in enumerate(zip(centres, ("Left", "Right"), strict=True))
        ),
        colours=colours,
        uv=None,
        textures=(),
        landmarks=np.arange(N_LANDMARKS, dtype=np.int32),
        landmark_vertices=corners,
        landmark_weights=weights,
        pivot=np.float32([0.0, -60.0, -60.0]),
        metadata={"name": "made", "licence": "none"},
        occlusion=np.zeros((2, len(vertices), 1), np.uint8),  # nothing hides it, which drawing need not find out
    )


def _is_hole(middles: np.ndarray) -> np.ndarray:
    """Whether points (N, 2) lie between the lips or the lids."""
    holes = [(MOUTH, 0.9 * MOUTH_WIDTH, LIP_HEIGHT / 2), *((eye, EYE_WIDTH, EYE_HEIGHT / 2) for eye in EYES)]
    inside = [np.square((middles - centre) / (width / 2, height)).sum(axis=1) < 1 for centre, width, height in holes]
    return np.any(inside, axis=0)


def _eye_depth(places: np.ndarray) -> float:
    return float(places[LEFT_LIDS[0][0], 2]) - EYEBALL / 2


def _octahedron() -> np.ndarray:
    return np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)


def _outwards(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[corner] for corner in triangles.T)
    turned = np.einsum("tk,tk->t", np.cross(b - a, c - a), a + b + c) < 0
    return np.where(turned[:, None], triangles[:, ::-1], triangles)


def _facing(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Triangles in the order that faces the viewer."""
    a, b, c = (vertices[corner] for corner in triangles.T)
    away = np.cross(b - a, c - a)[:, 2] < 0
    return np.where(away[:, None], triangles[:, ::-1], triangles)


def _face_shapes(vertices: np.ndarray, numbers: Sequence[int]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names (K,) and displacements (K, V, 3): of the lips by `SPOKEN_SHAPES`, of the lids; none where eyes turn."""
    at = {number: row for row, number in enumerate(numbers)}
    x = vertices[: len(numbers), 0]
    upper = [at[number] for number in (*OUTER_LIP_UPPER[1:-1], *INNER_LIP_UPPER[1:-1])]
    lower = [at[number] for number in (*OUTER_LIP_LOWER[1:-1], *INNER_LIP_LOWER[1:-1])]
    near = np.exp(-np.square((vertices[: len(numbers), :2] - MOUTH) / (MOUTH_WIDTH, 2 * LIP_HEIGHT)).sum(axis=1))
    jaw = jaw_share(vertices[: len(numbers)])
    middle = 1.0 - np.square(x / (MOUTH_WIDTH / 2))
    shapes: dict[str, np.ndarray] = {}
    for name, (wider, upper_up, lower_up, ahead) in SPOKEN_SHAPES.items():
        moved = np.zeros(vertices.shape, np.float32)
        moved[: len(numbers), 0] = wider * near * np.clip(x / (MOUTH_WIDTH / 2), -1, 1)
        moved[upper, 1] = upper_up * middle[upper]
        moved[lower, 1] = lower_up * middle[lower]
        moved[: len(numbers), 2] = ahead * near
        if name == "jawOpen":
            moved[: len(numbers), 1] += lower_up * jaw
        if name not in ONE_SIDED:
            shapes[name] = moved
            continue
        for side, share in (("Left", x > 1.0), ("Right", x < -1.0)):
            half = np.zeros(vertices.shape, np.float32)
            half[: len(numbers)] = moved[: len(numbers)] * (share + 0.5 * (np.abs(x) <= 1.0))[:, None]
            shapes[name + side] = half
    for side, (upper_lid, lower_lid) in zip(("Left", "Right"), LIDS, strict=True):
        moved = np.zeros(vertices.shape, np.float32)
        for k in (4, 5):
            moved[at[upper_lid[k]], 1] = vertices[at[lower_lid[k]], 1] - vertices[at[upper_lid[k]], 1]
        shapes[f"eyeBlink{side}"] = moved
    for name in (*_eye_turns("Left"), *_eye_turns("Right")):
        shapes[name] = np.zeros(vertices.shape, np.float32)
    return tuple(shapes), np.stack(list(shapes.values()))


def jaw_share(places: np.ndarray) -> np.ndarray:
    """(N,) share of the jaw's motion that places (N, 3) have."""
    return np.clip((MOUTH[1] - LIP_HEIGHT - places[:, 1]) / 20.0, 0.0, 1.0)


def _eye_turns(side: str) -> dict[str, np.ndarray]:
    out = 1.0 if side == "Left" else -1.0
    axes = {"Up": (-1, 0, 0), "Down": (1, 0, 0), "In": (0, -out, 0), "Out": (0, out, 0)}
    return {f"eyeLook{way}{side}": np.float32(GAZE_TURN) * np.float32(axis) for way, axis in axes.items()}


def _landmark_weights(mesh: Delaunay, spread: np.ndarray, numbers: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """(478, 3) vertices around each landmark, and their weights; a landmark that is a vertex is it alone."""
    points = spread[:, :2]
    found = mesh.find_simplex(np.add(OVAL, 0.92 * (points - OVAL)))  # the oval has vertices at every fourth point
    corners = mesh.simplices[found].astype(np.int32)
    across = mesh.transform[found]
    first = np.einsum("nij,nj->ni", across[:, :2], points - across[:, 2])
    weights = np.clip(np.column_stack([first, 1.0 - first.sum(axis=1)]), 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    for row, number in enumerate(numbers):
        corners[number], weights[number] = row, (1.0, 0.0, 0.0)
    return corners, weights.astype(np.float32)
