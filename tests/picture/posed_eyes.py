"""Eyes of faces in a pose: shape weights of a gaze, what is seen of eyeballs, and their irises in a picture."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

from tts2face.face.deformation import REST_HEAD
from tts2face.picture.baked.visibility import N_COLUMNS, TRIANGLE_MASK, nearest_triangles, project
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import parse_camera
from tts2face.picture.kernels.eyes import eye_geometry

FACES = [
    "ada",
    "head",
    *(pytest.param(name, marks=pytest.mark.build) for name in ("ben", "zuri", "noor", "tomas", "mara")),
]
OPEN_PARTS = ("lashes", "brows", "hair", "wet", "glasses")  # through which one sees, or which hang before the eyes


def gazing(face, right=0.0, up=0.0, **shapes):
    """Weights (K,) of a face that looks to the picture's right and up by shares of the shapes of gaze."""
    ways = {"eyeLookOutLeft": right, "eyeLookInRight": right, "eyeLookInLeft": -right, "eyeLookOutRight": -right}
    ways |= {f"eyeLook{way}{side}": sign * up for way, sign in (("Up", 1), ("Down", -1)) for side in ("Left", "Right")}
    shapes |= {name: max(share, 0.0) for name, share in ways.items()}
    return np.array([shapes.get(name, 0.0) for name in face.shape_names], np.float32)


def posed_points(renderer, weights, head=REST_HEAD):
    """(V, 3) vertices as the renderer draws them."""
    posed = renderer.scene.pose(weights, head)
    return getattr(posed, "points", posed)


def polygon_mask(shape, corners):
    """(H, W) pixels in a polygon (N, 2)."""
    mask = Image.new("L", shape[::-1])
    ImageDraw.Draw(mask).polygon([tuple(corner) for corner in corners], fill=1)
    return np.asarray(mask) > 0


def irises(renderer, weights, head):
    """Brightness of the pixels of both irises between the lids."""
    scene, geometry = renderer.scene, eye_geometry(renderer.scene.face, renderer.scene.surface.rig)
    picture = renderer.draw(weights, head)[..., :3] @ [0.299, 0.587, 0.114]
    centres, gazes, lids, _ = geometry.seen((posed_points(renderer, weights, head), weights, head), scene.optics.view)
    side, turn = scene.picture.samples_per_side, np.linspace(0, 2 * np.pi, 24, endpoint=False)

    def shown(places):
        return (places[..., :2] / places[..., 2:] * scene.optics.lens[0] + scene.optics.lens[1:3]) / side

    for number, (centre, gaze, edges) in enumerate(zip(centres, gazes, lids, strict=True)):
        iris, radius = float(geometry.iris[number]), float(geometry.openings.radius[number])
        across = np.cross(gaze, [0.0, 1.0, 0.0])
        across /= np.linalg.norm(across)
        ring = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(across, gaze)
        inner = centre + radius * (iris * gaze + 0.85 * np.sqrt(1 - iris**2) * ring)
        opening = np.concatenate([shown(edges[0]), shown(edges[1])[::-1]])
        yield picture[polygon_mask(picture.shape, shown(inner)) & polygon_mask(picture.shape, opening)]


def seen_eyes(renderer, weights, camera, side):
    """Area of each eyeball seen beside its lids' opening, over the ball's disc, and whether the lids are shut."""
    scene, face = renderer.scene, renderer.scene.face
    optics, points = camera_matrices(parse_camera(camera), face, (side, side)), posed_points(renderer, weights)
    parts = [part for part in face.parts if part.kind != "strands" and part.name not in OPEN_PARTS]
    triangles = np.concatenate([face.triangles[part.first : part.first + part.count] for part in parts])
    table = np.zeros((len(points), N_COLUMNS), np.float32)
    project(
        points.astype(np.float32),
        np.arange(len(points), dtype=np.int32),
        optics.view.astype(np.float32),
        optics.lens.astype(np.float32),
        table,
    )
    nearest = nearest_triangles(table, np.ascontiguousarray(triangles), (side, side))[0][:, :side] & TRIANGLE_MASK
    openings = scene.surface.rig.clearance.openings
    for number, (eye, edges) in enumerate(zip(face.eyes, openings.edges(points), strict=True)):
        is_ball = ((triangles >= eye.first) & (triangles < eye.first + eye.count)).all(axis=1)
        seen = (nearest > 0) & is_ball[nearest - 1]
        gap = (edges[0] - edges[1])[2:7, 1].max()
        scale = optics.lens[0] / (optics.view[2, :3] @ eye.centre + optics.view[2, 3])
        if gap > 0.3:
            corners = optics.pixels(edges.reshape(-1, 3)).reshape(2, -1, 2)
            ring = np.concatenate([corners[0], corners[1][::-1]])
            reach = np.ceil(0.8 * scale)
            for right, down in [(0, 0), *(reach * np.array(way) for way in [(1, 0), (-1, 0), (0, 1), (0, -1)])]:
                seen &= ~polygon_mask(seen.shape, ring + np.array([right, down]))
        yield seen.sum() / (np.pi * (openings.radius[number] * scale) ** 2), gap <= 0.3
