"""The tiny face with light of a few plain modes, each of which changes one thing."""

from dataclasses import replace

import numpy as np

from tests.render.tiny_face import tiny_face
from tts2face.models.baked_light import BLACK_SHARE, OPENING_LANDMARKS, PRODUCTS, BakedLight

SKIN_LIGHT, TONGUE_LIGHT, WALL = (200, 120, 90), (150, 40, 50), (20, 60, 100)
SIDE, TURN_SIDE = 128, 128
JAW_CHANGE, TURN_CHANGE, CAMERA_CHANGE = 60, 50, 40  # of red with jawOpen 1, of green at 20 degrees, of blue from 30
MOUTH = ((0, -45), (0, -60), (-20, -52), (20, -52))  # x and y of the landmarks of the mouth


def lit_tiny_face():
    """The face, whose lashes are on the second page."""
    face = tiny_face(textured=True)
    names = [part.name for part in face.parts]
    spans = [face.triangles[part.first : part.first + part.count] for part in face.parts]
    skin, tongue, lashes = spans[0], spans[names.index("tongue")], spans[names.index("lashes")]
    front = np.flatnonzero(face.vertices[:, 2] > 0)
    front = front[np.isin(front, skin)]
    nearest = [front[np.linalg.norm(face.vertices[front, :2] - place, axis=1).argmin()] for place in MOUTH]
    rows, balls = np.unique(skin), np.unique(np.concatenate(spans[1:3]))
    tongue_rows = np.unique(tongue)
    n_shapes, n_texels = len(face.shape_names), 2 * TURN_SIDE**2 + TURN_SIDE * (TURN_SIDE // BLACK_SHARE)
    n_features = n_shapes + len(PRODUCTS) + 2
    modes = np.zeros((1, len(rows), 3), np.int8)
    modes[:, :, 0] = 100
    mode_weights = np.zeros((n_features, 1), np.float32)
    mode_weights[face.shape_names.index("jawOpen")] = JAW_CHANGE / 100
    turn_modes, camera_modes = np.zeros((1, 3, n_texels), np.int8), np.zeros((1, 3, TURN_SIDE**2), np.int8)
    turn_modes[0, 1, : 2 * TURN_SIDE**2], camera_modes[0, 2] = 100, 100
    drawn = np.arange(len(face.triangles), dtype=np.int32)
    light = BakedLight(
        page_of={names[0]: 0, "lashes": 1},
        pages=np.stack([np.full((SIDE, SIDE, 3), SKIN_LIGHT, np.uint8), np.full((SIDE, SIDE, 3), 30, np.uint8)]),
        triangles=np.concatenate([drawn, ~drawn[-len(lashes) :]]),
        is_inside=np.zeros(len(drawn) + len(lashes), bool),
        rows=rows.astype(np.int32),
        base=np.zeros((len(rows), 3), np.uint8),
        modes=modes,
        mode_weights=mode_weights,
        mouth_rows=tongue_rows.astype(np.int32),
        openings=np.zeros((1, 5), np.float32),
        mouth=np.full((1, len(tongue_rows), 3), TONGUE_LIGHT, np.uint8),
        turns_deg=np.array([[-20, 0], [20, 0]], np.float32),
        turn_weights=np.array([[0], [TURN_CHANGE / 100]], np.float32),
        turn_modes=turn_modes,
        camera_yaws_deg=np.array([30], np.float32),
        camera_modes=camera_modes,
        camera_sizes=np.array([CAMERA_CHANGE / 100], np.float32),
        ball_rows=balls.astype(np.int32),
        ball_base=np.full((len(balls), 3), 0.5, np.float32),
        ball_modes=np.zeros((0, len(balls), 3), np.float32),
        ball_weights=np.zeros((n_features, 0), np.float32),
        lamps=np.zeros((0, 17), np.float32),
        head_lamps=0,
        sky=np.zeros(3, np.float32),
        eye_gain=1.0,
        eye_edges=np.array([0.2, 0.5], np.float32),
        view=np.rint(np.stack(np.meshgrid(*[np.linspace(0, 255, 33)] * 3, indexing="ij"), -1)).astype(np.uint8),
        backdrop=np.full((32, 32, 3), WALL, np.uint8),
    )
    return replace(
        face,
        light=(light,),
        landmarks=np.array(OPENING_LANDMARKS, np.int32),
        landmark_vertices=np.repeat(np.array(nearest, np.int32)[:, None], 3, axis=1),
        landmark_weights=np.tile(np.array([1, 0, 0], np.float32), (4, 1)),
    )
