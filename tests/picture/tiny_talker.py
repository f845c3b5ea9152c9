"""A synthetic talker with an appearance model and pictures of 96 x 96 pixels."""

import numpy as np

from corpus_tools.appearance.frame import (
    MOUTH_LANDMARKS,
    build_reference_frame,
    face_ring,
    face_triangles,
    mouth_triangles,
)
from corpus_tools.appearance.plate import encode_plate_video
from tts2face.models.appearance import Appearance, Plate, TextureModel
from tts2face.models.landmarks import FACE_OVAL, INNER_LIP_LOWER, INNER_LIP_UPPER, N_MESH_LANDMARKS
from tts2face.models.talker import ShapeModel, Talker

SIZE = 96


def face_points() -> np.ndarray:
    """(468, 2) points in a picture of 96 x 96: face oval, parted lips, random points between."""
    shape = np.random.default_rng(3).uniform(-20, 20, (N_MESH_LANDMARKS, 2))
    angles = np.linspace(0, 2 * np.pi, len(FACE_OVAL), endpoint=False)
    shape[list(FACE_OVAL)] = 30 * np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    lips = np.linspace(0, np.pi, len(INNER_LIP_UPPER))
    shape[list(INNER_LIP_UPPER)] = np.stack([-8 * np.cos(lips), 12 - 4 * np.sin(lips)], axis=1)
    shape[list(INNER_LIP_LOWER)] = np.stack([-8 * np.cos(lips), 12 + 4 * np.sin(lips)], axis=1)
    return shape + SIZE / 2


def texture_model(shape: np.ndarray, triangles: np.ndarray, side: int, level: float) -> TextureModel:
    frame = build_reference_frame(shape, triangles, side)
    n_pixels = len(frame.pixels)
    basis, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3 * n_pixels, 2)))
    return TextureModel(
        reference=frame.points,
        triangles=frame.triangles,
        size=frame.size,
        pixels=frame.pixels,
        mean=np.full((n_pixels, 3), level, np.float32),
        basis=basis.T.reshape(2, n_pixels, 3).astype(np.float32),
        spread=np.full(2, 5.0, np.float32),
    )


def own_talker(*, has_face: bool = True) -> Talker:
    generator = np.random.default_rng(0)
    basis, _ = np.linalg.qr(generator.normal(size=(3 * 478, 3)))
    model = ShapeModel(
        generator.normal(0, 40, (478, 3)).astype(np.float32),
        basis.T.reshape(3, 478, 3).astype(np.float32),
        np.ones(3, np.float32),
        2,
        np.zeros(3, np.float32),
    )
    if not has_face:
        return Talker(25.0, model, (), {"name": "Ada"})
    shape = face_points()
    face = texture_model(shape, face_triangles(shape), 48, 100.0)
    points = np.concatenate([shape, face_ring(shape)])
    y, x = np.mgrid[:SIZE, :SIZE]
    pictures = [np.stack([2 * x + k, 2 * y, x + y], axis=2).clip(0, 255).astype(np.uint8) for k in range(4)]
    plate = Plate(
        video=encode_plate_video(iter(pictures)),
        points=np.repeat(points[None], 4, axis=0).astype(np.float32),
        axes=np.tile(np.array([[1.0, 0, 0], [0, -1.0, 0]], np.float32), (4, 1, 1)),
        shape=generator.normal(0, 1, (4, 3)).astype(np.float32),
        texture_parameters=generator.normal(0, 5, (4, 2)).astype(np.float32),
    )
    mouth = texture_model(shape[list(MOUTH_LANDMARKS)], mouth_triangles(), 24, 30.0)
    changed = np.ones(len(face.pixels), np.float32)
    appearance = Appearance(face, mouth, np.array(MOUTH_LANDMARKS, np.int32), changed, plate)
    return Talker(25.0, model, (), {"name": "Ada"}, appearance)
