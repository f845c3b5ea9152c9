"""A character of more than 50,000 vertices."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.interchange.characters.made import Variant, shipped_head, write_character_file, write_landmarks
from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.saving import save_face
from tts2face.models.face import Face
from tts2face.models.face_file import read_face


def motion_of(face: Face, name: str) -> np.ndarray:
    return scatter_landmarks(face, landmark_motion(face, np.array([face.shape_names.index(name)])))[:, :, 0]


def dense_head() -> Face:
    """The skin of the shipped head with every triangle divided into four: more than 50,000 vertices."""
    head = shipped_head()
    part = head.parts[0]
    used, corners = np.unique(head.triangles[: part.count], return_inverse=True)
    triangles = corners.reshape(-1, 3)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    unique, places = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = places.reshape(3, -1) + len(used)
    a, b, c = triangles.T
    divided = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)

    def between(values: np.ndarray) -> np.ndarray:
        kept = values[used].astype(np.float32)
        return np.concatenate([kept, (kept[unique[:, 0]] + kept[unique[:, 1]]) / 2])

    return replace(
        head,
        vertices=between(head.vertices),
        triangles=divided.astype(np.int32),
        parts=(replace(part, count=len(divided)),),
        shapes=np.stack([between(shape) for shape in head.shapes]),
        colours=between(head.colours).astype(np.uint8),
        uv=None if head.uv is None else between(head.uv),
        eyes=(),
        landmarks=head.landmarks[:0],
        landmark_vertices=head.landmark_vertices[:0],
        landmark_weights=head.landmark_weights[:0],
        tangents=None,
        occlusion=None,
    )


def test_a_face_of_fifty_thousand_vertices(tmp_path: Path) -> None:
    character = write_character_file(tmp_path / "dense.glb", Variant(is_dense=True), face=dense_head())
    face = import_face(character, landmarks=write_landmarks(tmp_path / "landmarks.tsv")).face
    save_face(tmp_path / "dense.face", face)
    assert len(face.vertices) > 50_000
    opened = [motion_of(one, "jawOpen")[[13, 14], 1] for one in (face, shipped_head())]
    np.testing.assert_allclose(opened[0], opened[1], atol=0.05)
    assert read_face(tmp_path / "dense.face").triangles.shape == face.triangles.shape
