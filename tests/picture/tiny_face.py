"""A small synthetic face: a ball of skin with two eyeballs, a tongue and a sheet of lashes."""

from dataclasses import replace
from functools import cache

import numpy as np

from tts2face.models.face import VERTEX_COLOURS, Eye, Face, FacePart, Texture

SKIN, EYE, TONGUE, LASH = (206, 150, 124), (240, 240, 240), (190, 70, 80), (30, 20, 15)
FLESH = FacePart("skin", 0, 0, specular=0.2, shininess=20.0, wrap=0.4)
RADIUS = 90.0  # mm


def ball(centre, radius, n_rings):
    """Vertices and triangles of a sphere, counter-clockwise seen from outside, poles along z."""
    polar = np.linspace(0, np.pi, n_rings + 1)[1:-1]
    around = np.linspace(0, 2 * np.pi, 2 * n_rings, endpoint=False)
    theta, phi = np.meshgrid(polar, around, indexing="ij")
    rings = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    points = np.vstack([[[0, 0, 1]], rings, [[0, 0, -1]]])
    n_around, last = len(around), len(points) - 1
    triangles = []
    for j in range(n_around):
        k = (j + 1) % n_around
        triangles.append((0, 1 + j, 1 + k))
        for i in range(len(polar) - 1):
            a, b = 1 + i * n_around, 1 + (i + 1) * n_around
            triangles += [(a + j, b + j, b + k), (a + j, b + k, a + k)]
        end = 1 + (len(polar) - 1) * n_around
        triangles.append((last, end + k, end + j))
    return np.asarray(centre) + radius * points, np.array(triangles)


def at(*values):
    """A point or a rotation vector."""
    return np.array(values, np.float32)


@cache
def tiny_face(textured=False, n_rings=14):
    """The face; with `textured`, the skin has a chequered texture."""
    skin, skin_triangles = ball((0, -20, -60), RADIUS, n_rings)
    left, eye_triangles = ball((32, 0, 14), 13, 8)
    right, _ = ball((-32, 0, 14), 13, 8)
    tongue, tongue_triangles = ball((0, -60, 18), 8, 6)
    lashes = np.array([[15, 6, 34], [50, 6, 34], [50, 14, 34], [15, 14, 34]], float)
    blocks = [skin, left, right, tongue, lashes]
    starts = np.cumsum([0] + [len(block) for block in blocks])
    faces = [skin_triangles, eye_triangles, eye_triangles, tongue_triangles, np.array([[0, 1, 2], [0, 2, 3]])]
    vertices = np.vstack(blocks).astype(np.float32)
    triangles = np.vstack([face + start for face, start in zip(faces, starts[:-1], strict=True)]).astype(np.int32)
    colours = np.repeat([SKIN, EYE, EYE, TONGUE, LASH], [len(block) for block in blocks], axis=0).astype(np.uint8)
    for first in starts[1:3]:  # pupils
        colours[first : first + 20] = (20, 30, 60)
    jaw, smile = np.zeros_like(vertices), np.zeros_like(vertices)
    below = np.arange(len(vertices)) < starts[1]
    jaw[below & (vertices[:, 1] < -40), 1] = -25.0
    jaw[starts[3] : starts[4], 1] = -25.0
    smile[below & (vertices[:, 0] > 20) & (vertices[:, 2] > 0), 1] = 10.0
    names = ("jawOpen", "mouthSmileLeft", "eyeLookInLeft", "eyeLookInRight")
    still = np.zeros_like(vertices)
    counts = [len(face) for face in faces]
    firsts = np.cumsum([0, *counts])
    rest = {"uv": None, "textures": ()}
    if textured:
        unit = (skin - (0, -20, -60)) / RADIUS
        uv = np.full((len(vertices), 2), 0.5, np.float32)
        uv[: len(skin)] = np.column_stack([0.5 + 0.5 * unit[:, 0], 0.5 - 0.5 * unit[:, 1]])
        chequers = np.indices((64, 64)).sum(axis=0) // 8 % 2
        texture = np.where(chequers[..., None] == 0, (230, 60, 40), (40, 80, 230)).astype(np.uint8)
        rest = {"uv": uv, "textures": (Texture(texture),)}
    return Face(
        vertices=vertices,
        triangles=triangles,
        parts=(
            replace(FLESH, first=int(firsts[0]), count=counts[0], texture=0 if textured else VERTEX_COLOURS),
            FacePart("eye_left", int(firsts[1]), counts[1], specular=0.8, shininess=200.0),
            FacePart("eye_right", int(firsts[2]), counts[2], specular=0.8, shininess=200.0),
            FacePart("tongue", int(firsts[3]), counts[3], specular=0.3, shininess=30.0, wrap=0.2),
            FacePart("lashes", int(firsts[4]), counts[4], opacity=0.6),
        ),
        shape_names=names,
        shapes=np.stack([jaw, smile, still, still]).astype(np.float32),
        limits=np.array([[0, 1]] * 4, np.float32),
        eyes=(
            Eye(
                int(starts[1]),
                len(left),
                np.array([32, 0, 14], np.float32),
                {"eyeLookInLeft": np.array([0, -0.5, 0], np.float32)},
            ),
            Eye(
                int(starts[2]),
                len(right),
                np.array([-32, 0, 14], np.float32),
                {"eyeLookInRight": np.array([0, 0.5, 0], np.float32)},
            ),
        ),
        colours=colours,
        landmarks=np.zeros(0, np.int32),
        landmark_vertices=np.zeros((0, 3), np.int32),
        landmark_weights=np.zeros((0, 3), np.float32),
        pivot=np.array([0, -60, -60], np.float32),
        metadata={"name": "tiny"},
        **rest,
    )  # fmt: skip
