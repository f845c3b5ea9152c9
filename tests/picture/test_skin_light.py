"""Colour of skin in shadow, against that of lit skin."""

import numpy as np
import pytest

from tests.picture.stability import visible_triangles
from tts2face.models.face import keep_parts
from tts2face.models.face_loading import load_face
from tts2face.picture.kernels.tones import linear_light
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

NECK_MM, FACE_MM = -105.0, (-95.0, 30.0)  # heights on the head


@pytest.mark.parametrize(("identity", "most"), [(None, 1.6), ("amara", 1.2), ("kofi", 1.2)])
def test_shadowed_skin_does_not_glow(identity: str | None, most: float) -> None:
    """Ratio of red to blue light of the neck's darker half, relative to the brighter part of the face."""
    face = keep_parts(load_face("head", identity, hair="bald"), lambda part: part.kind != "strands")
    renderer = mesh_renderer(face, Picture(size="256x256"))
    weights = np.zeros(len(face.shape_names), np.float32)
    light = linear_light(renderer.draw(weights))
    triangles = visible_triangles(renderer.scene, weights)
    parts = np.append(renderer.scene.surface.part_of, -1)[triangles]
    is_skin = np.isin(parts, [at for at, part in enumerate(face.parts) if part.kind == "skin"])
    height = face.vertices[face.triangles[triangles], 1].mean(axis=2)
    tone = light.mean(axis=2)
    neck, front = is_skin & (height < NECK_MM), is_skin & (height > FACE_MM[0]) & (height < FACE_MM[1])
    dark, lit = neck & (tone < np.median(tone[neck])), front & (tone > np.percentile(tone[front], 60))
    warmth = [light[mask, 0].mean() / light[mask, 2].mean() for mask in (dark, lit)]
    assert warmth[0] / warmth[1] < most
