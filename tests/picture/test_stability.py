"""Flicker along a slow turn: of a card of hair no more than of the edge of skin, and its measure."""

from dataclasses import replace

import numpy as np

from tests.face.test_hair import cap
from tests.picture.stability import flicker, part_masks
from tests.picture.tiny_face import tiny_face
from tts2face.models.hair import attach_hair
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

N_FRAMES = 8


def test_steady_change_is_no_flicker() -> None:
    ramp = np.broadcast_to(np.arange(0, 50, 10, dtype=np.uint8)[:, None, None, None], (5, 4, 4, 3))
    assert flicker(ramp).max() == 0
    blinking = np.zeros((5, 4, 4, 3), np.uint8)
    blinking[::2] = 40
    np.testing.assert_allclose(flicker(blinking), 40)


def test_hair_flickers_no_more_than_the_edge_of_skin() -> None:
    bare = tiny_face(textured=True, n_rings=30)
    stripes = np.repeat(np.tile(np.array([40, 220], np.uint8), 32)[None, :], 64, axis=0)  # strands
    alpha = np.full((64, 64), 255, np.uint8)
    alpha[:, ::3] = 60
    face = attach_hair(bare, replace(cap(bare), pictures=(stripes, alpha)), "brown")
    renderer = mesh_renderer(face, Picture(size="160x160", camera="0,35"))
    weights = np.zeros(len(face.shape_names), np.float32)
    turn = [renderer.draw(weights, np.radians([0.125 * i, 0.25 * i, 0, 0, 0, 0])) for i in range(N_FRAMES)]
    change, masks = flicker(np.array(turn)), part_masks(renderer.scene, weights)
    assert masks["hair"].sum() > 30
    hair, edge = (np.percentile(change[masks[name]], 99) for name in ("hair", "edges of skin"))
    assert hair <= edge
    assert edge < 25
