"""The tiny face with plain light, of which each part changes one thing."""

from dataclasses import replace

import numpy as np

from tests.picture.tiny_face import tiny_face
from tts2face.models.baked_light import BLACK_SHARE, LIP_RING, N_BALL_TERMS, N_MOUTH_TERMS, N_TERMS, BakedLight
from tts2face.models.light import Baked

SKIN_LIGHT, TONGUE_LIGHT, WALL = (200, 120, 90), (150, 40, 50), (20, 60, 100)
SIDE, TURN_SIDE = 128, 128
RISE_CHANGE, TURN_CHANGE, CAMERA_CHANGE = 30, 50, 40  # of red 8 mm higher, of green at 20 degrees, of blue from 30
MOST_CHANGE = 60  # with the expression


def lit_tiny_face():
    """The face, whose lashes are on the second page."""
    face = tiny_face(textured=True)
    names = [part.name for part in face.parts]
    spans = [face.triangles[part.first : part.first + part.count] for part in face.parts]
    skin, tongue, lashes = spans[0], spans[names.index("tongue")], spans[names.index("lashes")]
    front = np.flatnonzero(face.vertices[:, 2] > 0)
    front = front[np.isin(front, skin)]
    around = np.linspace(-np.pi, np.pi, len(LIP_RING), endpoint=False)  # from the right corner, upper lip first
    mouth = np.column_stack([20 * np.cos(-around), -52 + 8 * np.sin(-around)])
    nearest = [front[np.linalg.norm(face.vertices[front, :2] - place, axis=1).argmin()] for place in mouth]
    rows, balls = np.unique(skin), np.unique(np.concatenate(spans[1:3]))
    tongue_rows = np.unique(tongue)
    colours = face.colours.copy()
    colours[tongue_rows] = TONGUE_LIGHT
    n_texels = 2 * TURN_SIDE**2 + TURN_SIDE * (TURN_SIDE // BLACK_SHARE)
    responses = np.zeros((N_TERMS, 3, len(rows)), np.int8)
    responses[5, 0] = 100
    limits = np.array([-MOST_CHANGE / 2, MOST_CHANGE / 2], np.int8)[:, None, None]
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
        responses=responses,
        response_sizes=np.full(N_TERMS, RISE_CHANGE / 100, np.float32),
        limits=np.tile(limits, (1, 3, len(rows))),
        partners=np.concatenate([rows, balls]).astype(np.int32),
        mouth_rows=tongue_rows.astype(np.int32),
        mouth_base=np.full((len(tongue_rows), 3), TONGUE_LIGHT, np.uint8),
        mouth_responses=np.zeros((N_MOUTH_TERMS, 3, len(tongue_rows)), np.int8),
        mouth_sizes=np.ones(N_MOUTH_TERMS, np.float32),
        mouth_limits=np.zeros((2, 3, len(tongue_rows)), np.int8),
        turns_deg=np.array([[-20, 0], [20, 0]], np.float32),
        turn_weights=np.array([[0], [TURN_CHANGE / 100]], np.float32),
        turn_modes=turn_modes,
        camera_yaws_deg=np.array([30], np.float32),
        camera_modes=camera_modes,
        camera_sizes=np.array([CAMERA_CHANGE / 100], np.float32),
        ball_rows=balls.astype(np.int32),
        ball_base=np.full((len(balls), 3), 0.5, np.float32),
        ball_responses=np.zeros((N_BALL_TERMS, 3, len(balls)), np.int8),
        ball_sizes=np.ones(N_BALL_TERMS, np.float32),
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
        colours=colours,
        light=Baked(light),
        landmarks=np.array(LIP_RING, np.int32),
        landmark_vertices=np.repeat(np.array(nearest, np.int32)[:, None], 3, axis=1),
        landmark_weights=np.tile(np.array([1, 0, 0], np.float32), (len(LIP_RING), 1)),
    )
