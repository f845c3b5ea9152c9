"""Faces for programs that light them: hair in the colours that its video shows, and a bust that ends level."""

from dataclasses import replace

import numpy as np
import pytest

from tests.picture.film.lit_face import SKIN_LIGHT, lit_tiny_face
from tests.picture.tiny_face import tiny_face
from tts2face.interchange.exports.plain_face import plain_face
from tts2face.interchange.exports.surfaces import reflection
from tts2face.models.face import FacePart
from tts2face.models.face_loading import load_face
from tts2face.models.hair import seen_colour
from tts2face.models.light import Lamps
from tts2face.numeric.arrays import decode_srgb

HAIR_LIGHT = (90, 60, 30)


def lit_hair(share_in_shadow=0.0):
    """The lit face whose lashes are hair, the skin of one colour, a share of whose page is black, and its colour."""
    face = lit_tiny_face()
    parts = tuple(replace(part, name="hair") if part.name == "lashes" else part for part in face.parts)
    baked = face.light.baked
    pages = baked.pages.copy()
    pages[1] = HAIR_LIGHT
    pages[0, :, : round(share_in_shadow * pages.shape[2])] = 0
    light = replace(baked, page_of={"skin": 0, "hair": 1}, pages=pages)
    skin = replace(face.textures[0], pixels=np.full_like(face.textures[0].pixels, (230, 150, 120)))
    lit = replace(face, parts=parts, textures=(skin, *face.textures[1:]), light=type(face.light)(light))
    return lit, parts.index(next(part for part in parts if part.name == "hair"))


def rows_of(face, number):
    """Vertices of a part."""
    part = face.parts[number]
    return np.unique(face.triangles[part.first : part.first + part.count])


@pytest.mark.parametrize("share_in_shadow", [0.0, 0.3])
def test_hair_has_the_light_that_is_seen_over_that_on_the_skin(share_in_shadow):
    face, number = lit_hair(share_in_shadow)
    plain = plain_face(face)
    own = rows_of(face, number)
    lamp = decode_srgb(np.array(SKIN_LIGHT) / 255).sum() / decode_srgb(np.array([230, 150, 120]) / 255).sum()
    expected = decode_srgb(np.array(HAIR_LIGHT) / 255) / lamp
    assert np.allclose(decode_srgb(plain.colours[own] / 255), expected, rtol=0, atol=0.005)
    others = np.setdiff1d(np.arange(len(face.vertices)), own)
    assert np.array_equal(plain.colours[others], face.colours[others])
    assert np.array_equal(plain.vertices, face.vertices)


def test_faces_without_baked_light_or_hair_stay_as_they_are():
    face, _ = lit_hair()
    for still in (tiny_face(textured=True), lit_tiny_face(), replace(face, light=Lamps())):
        assert plain_face(still) is still


def test_a_haircut_before_lamps_is_brighter_and_reflects_no_white():
    face = load_face("head")
    plain = plain_face(face)
    hair, own = (next(part for part in shown.parts if part.name == "hair") for shown in (plain, face))
    assert (reflection(hair), reflection(own)) == (0.0, 0.25)
    before, after = (shown.textures[own.texture].pixels / 255 for shown in (face, plain))
    np.testing.assert_allclose(after, seen_colour(before), atol=0.003)
    assert after.mean() > 1.1 * before.mean()
    for part in plain.parts:
        if part.name != "hair" and part.is_textured:
            assert plain.textures[part.texture] is face.textures[part.texture]
            assert reflection(part) == 1.0


def dressed(heights):
    """The tiny face with a tube of cloth that ends at one height for each of the points around it, with a seam."""
    face = tiny_face(textured=True)
    n, rings = len(heights), 5
    turn = np.linspace(0, 2 * np.pi, n + 1)  # the last column lies on the first, as at a seam of a texture
    ends = np.append(heights, heights[0])
    share = np.linspace(0, 1, rings)[:, None]
    points = np.stack([np.tile(100 * np.cos(turn), (rings, 1)), -100 + share * (ends + 100),
                       np.tile(100 * np.sin(turn), (rings, 1))], axis=-1).reshape(-1, 3)  # fmt: skip
    k, column = np.arange(rings - 1)[:, None] * (n + 1), np.arange(n)
    halves = ((0, 1, n + 2), (0, n + 2, n + 1))
    triangles = np.concatenate([np.stack([k + column + to for to in half], -1).reshape(-1, 3) for half in halves])
    v, shapes = len(face.vertices), np.zeros((len(face.shapes), len(points), 3), np.float32)
    shapes[0] = points / 100
    return replace(
        face,
        vertices=np.concatenate([face.vertices, points.astype(np.float32)]),
        triangles=np.concatenate([face.triangles, (triangles + v).astype(np.int32)]),
        parts=(*face.parts, FacePart("shirt", len(face.triangles), len(triangles))),
        shapes=np.concatenate([face.shapes, shapes], axis=1),
        colours=np.concatenate([face.colours, np.full((len(points), 3), 90, np.uint8)]),
        uv=np.concatenate([face.uv, np.zeros((len(points), 2), np.float32)]),
        occlusion=None,
    )


@pytest.mark.parametrize("seed", range(4))
def test_clothes_end_at_one_height_on_their_own_surface(seed):
    heights = np.random.default_rng(seed).uniform(-300, -200, 24)
    face = dressed(heights)
    plain = plain_face(face)
    number = len(face.parts) - 1
    own, before = rows_of(plain, number), rows_of(face, number)
    lowest = plain.vertices[own]
    bottom = lowest[:, 1].min()
    assert bottom == pytest.approx(heights.max(), abs=40)  # where the highest edge between two points ends
    triangles = plain.triangles[plain.parts[number].first :]
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    pairs, counts = np.unique(edges, axis=0, return_counts=True)
    ends = plain.vertices[np.unique(pairs[counts == 1]), 1]
    on_seam = np.hypot(*(plain.vertices[np.unique(pairs[counts == 1])][:, [0, 2]] - [100, 0]).T) < 1
    assert set(np.rint(ends[~on_seam]).tolist()) == {-100.0, float(np.rint(bottom))}
    assert np.abs(np.hypot(lowest[:, 0], lowest[:, 2]) - 100).max() < 3  # of the tube's chords
    assert len(own) < len(before)
    assert [part.name for part in plain.parts] == [part.name for part in face.parts]
    assert np.array_equal(plain.triangles[: len(face.triangles) - face.parts[-1].count],
                          face.triangles[: face.parts[-1].first])  # fmt: skip
    assert plain.shapes is face.shapes


def test_clothes_that_end_level_keep_their_vertices():
    face = dressed(np.full(24, -250.0))
    assert np.allclose(plain_face(face).vertices, face.vertices)
    assert len(plain_face(face).triangles) == len(face.triangles)


@pytest.mark.parametrize("name", ["ada", "noor"])
def test_hair_of_shipped_faces_is_as_coloured_as_in_their_video(name):
    face = load_face(name)
    plain = plain_face(face)
    hair = next(number for number, part in enumerate(face.parts) if part.name == "hair")
    fibre, shown = (own.colours[rows_of(face, hair)].mean(axis=0) for own in (face, plain))
    seen = {"ada": (120, 68, 50), "noor": (167, 161, 157)}[name]  # mean of a lock, and of the hair that looks forward
    assert np.abs(shown - seen).max() < 30
    assert np.abs(fibre - seen).max() > np.abs(shown - seen).max() / 2
    cloth = next(number for number, part in enumerate(plain.parts) if part.name == "shirt")
    heights = plain.vertices[rows_of(plain, cloth), 1]
    assert (heights < heights.min() + 1e-3).sum() > 50
