"""Speech in any mood on drawn faces: no folds, and neither teeth nor eyeballs in front of the skin around them."""

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.ndimage import maximum_filter

from tests.face.people import LIT
from tts2face.face.deformation import REST_HEAD
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, LID_RINGS
from tts2face.models.palette_file import load_palette
from tts2face.picture.baked.scene import LitScene
from tts2face.picture.baked.visibility import N_COLUMNS, TRIANGLE_MASK, nearest_triangles, project
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import CameraView
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.session.session import Session

N_POSES = 200
SIDE_PX, SHARE = 700, 0.8
OUTLINE_PX = 5  # width of what may lie over an outline: landmarks lie between vertices, and lips are round
FOLDED_MM2 = 12.0  # skin of the lower face that is seen at rest and turned over; lids turn over their edges
ROLLED_MM2 = {"noor": 70.0, "zuri": 50.0}  # the rim of their upper lip rolls in in rounded or rolled smiles
LOWER_FACE_MM = -20.0
TEXTS = (
    "People who move to Boston often choose a house by the sea.",
    "Who knew that you would join us? Five big maps!",
    "I am sorry, but we have not found your mother's blue shoes.",
)


@pytest.fixture(scope="module", params=LIT)
def posed(request: pytest.FixtureRequest) -> tuple[Face, np.ndarray]:
    """A face, and weights of random frames of speech in all moods."""
    face = load_face(request.param)
    session = Session(face=face)
    found = []
    for number, style in enumerate(load_palette("starter").names):
        clip = session.clip(TEXTS[number % len(TEXTS)], style=style, seed=number, voice="espeak")
        found.append(clip.motion.values)
    frames = np.concatenate(found)
    chosen = frames[np.random.default_rng(3).choice(len(frames), N_POSES, replace=False)]
    return session.face.mesh, chosen


def seen(face: Face, points: np.ndarray) -> np.ndarray:
    """(SIDE_PX, SIDE_PX) number of the triangle that is seen in each pixel; -1 for none."""
    table = np.zeros((len(points), N_COLUMNS), np.float32)
    optics = camera_matrices(CameraView(0, 0, share=SHARE), face, (SIDE_PX, SIDE_PX))
    every = np.arange(len(points), dtype=np.int32)
    project(points, every, optics.view.astype(np.float32), optics.lens.astype(np.float32), table)
    nearest, _, _ = nearest_triangles(table, face.triangles.astype(np.int32), (SIDE_PX, SIDE_PX))
    return (nearest[:, :SIDE_PX] & TRIANGLE_MASK).astype(np.int64) - 1


def outline(face: Face, points: np.ndarray, rows: list[int]) -> np.ndarray:
    """Pixels within a polygon of landmarks, and a little around it."""
    corners = np.einsum("lc,lcx->lx", face.landmark_weights[rows], points[face.landmark_vertices[rows]])
    table = np.zeros((len(corners), N_COLUMNS), np.float32)
    optics = camera_matrices(CameraView(0, 0, share=SHARE), face, (SIDE_PX, SIDE_PX))
    every = np.arange(len(corners), dtype=np.int32)
    view, lens = optics.view.astype(np.float32), optics.lens.astype(np.float32)
    project(corners.astype(np.float32), every, view, lens, table)
    picture = Image.new("L", (SIDE_PX, SIDE_PX))
    places = [tuple(place) for place in table[:, :2].tolist()]
    pen = ImageDraw.Draw(picture)
    pen.polygon(places, fill=255)
    pen.line([*places, places[0]], fill=255)  # a polygon without a height has no filling
    left, top, right, bottom = picture.getbbox() or (0, 0, 0, 0)
    near = np.s_[max(top - OUTLINE_PX, 0) : bottom + OUTLINE_PX, max(left - OUTLINE_PX, 0) : right + OUTLINE_PX]
    around = np.asarray(picture) > 0
    around[near] = maximum_filter(around[near], 2 * OUTLINE_PX + 1)
    return around


def triangle_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(F, 3) normals of triangles, twice as long as they are large."""
    a, b, c = (points[triangles[:, k]].astype(np.float64) for k in range(3))
    return np.cross(b - a, c - a)


def test_neither_teeth_nor_balls_nor_folds_are_seen(posed: tuple[Face, np.ndarray]) -> None:
    face, poses = posed
    scene = mesh_renderer(face, Picture(size="64x64")).scene
    assert isinstance(scene, LitScene)
    part_of = np.repeat([part.name for part in face.parts], [part.count for part in face.parts])
    inside = np.array([name.startswith(("teeth", "gums", "tongue")) for name in part_of])
    balls, skin = np.isin(part_of, ("sclera", "iris")), part_of == "skin"
    rest = triangle_normals(face.vertices, face.triangles)
    ahead = np.zeros(len(part_of), bool)
    ahead[np.unique(seen(face, face.vertices))[1:]] = True
    ahead &= face.vertices[face.triangles, 1].max(axis=1) < LOWER_FACE_MM
    lips = [*INNER_LIP_UPPER, *INNER_LIP_LOWER[::-1][1:-1]]
    wrong = []
    for number, weights in enumerate(poses):
        points = scene.pose(weights, REST_HEAD)
        shown = seen(face, points)
        teeth, eyes = ((shown >= 0) & kind[shown] for kind in (inside, balls))
        beyond_lips = int((teeth & ~outline(face, points, lips)).sum())
        lids = np.any([outline(face, points, list(ring)) for ring in LID_RINGS], axis=0)
        beyond_lids = int((eyes & ~lids).sum())
        normals = triangle_normals(points, face.triangles)
        turned = skin & ahead & ((rest * normals).sum(axis=1) < 0)
        folded = float(np.linalg.norm(normals[turned], axis=1).sum() / 2)
        if beyond_lips or beyond_lids or folded > ROLLED_MM2.get(face.metadata["name"], FOLDED_MM2):
            wrong.append((number, beyond_lips, beyond_lids, round(folded, 1)))
    assert not wrong
