"""Parts with holes: samples are drawn where the alpha of the texture is."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.picture.tiny_face import tiny_face
from tts2face.models.face import Face
from tts2face.picture.kernels.tones import TONE_TABLES
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw

pytestmark = pytest.mark.usefixtures("few_directions")
PICTURE = Picture(size="160x160", background="#808080")
EVERY_SAMPLE = replace(PICTURE, quality="high")
N_SHEET = 2  # triangles of the sheet of lashes, the last of the face


def face_with_sheet(alpha: np.ndarray | None) -> Face:
    """The tiny face whose sheet of lashes is textured; `alpha` (H, W) is the coverage of its texture."""
    face = tiny_face(textured=True)
    uv = np.array(face.uv)
    uv[-4:] = [[0, 1], [1, 1], [1, 0], [0, 0]]
    sheet = replace(face.parts[-1], opacity=1.0, texture=0, cutout=alpha is not None)
    return replace(face, uv=uv, parts=(*face.parts[:-1], sheet), textures=(replace(face.textures[0], alpha=alpha),))


def without_sheet(face: Face) -> Face:
    return replace(face, triangles=face.triangles[:-N_SHEET], parts=face.parts[:-1])


def drawn(face: Face, picture: Picture = PICTURE) -> np.ndarray:
    return draw(face, np.zeros(len(face.shape_names)), picture=picture).astype(int)


def full(value: int) -> np.ndarray:
    return np.full((64, 64), value, np.uint8)


@pytest.mark.parametrize("options", [{"supersampling": 1}, {"quality": "high"}])
def test_full_coverage_is_an_opaque_part_and_none_is_no_part(options: dict[str, Any]) -> None:
    """Every pixel has the same samples with and without holes, unlike with samples at edges only."""
    picture = replace(PICTURE, **options)
    opaque = face_with_sheet(None)
    np.testing.assert_array_equal(drawn(face_with_sheet(full(255)), picture), drawn(opaque, picture))
    np.testing.assert_array_equal(drawn(face_with_sheet(full(0)), picture), drawn(without_sheet(opaque), picture))


def test_half_coverage_is_the_mean_of_both() -> None:
    mixed, opaque = drawn(face_with_sheet(full(128))), face_with_sheet(None)
    with_it, without = drawn(opaque), drawn(without_sheet(opaque))
    inside = np.abs(with_it - without).max(axis=2) > 60
    assert inside.sum() > 100
    light = TONE_TABLES[0]
    whole, part = ((light[drawn] - light[without])[inside] for drawn in (with_it, mixed))
    share = (part * whole).sum() / (whole * whole).sum()  # by least squares; a sum of signed differences nearly cancels
    assert share == pytest.approx(0.5, abs=0.04)  # the shadow of the sheet does not become half


def test_an_edge_in_the_texture_is_an_edge_of_the_sheet() -> None:
    alpha = full(255)
    alpha[:, 32:] = 0
    halved = face_with_sheet(None)
    vertices = np.array(halved.vertices)
    vertices[[-3, -2], 0] = vertices[[-4, -1], 0] * 0.5 + vertices[[-3, -2], 0] * 0.5
    uv = np.array(halved.uv)
    uv[[-3, -2], 0] = 0.5
    cut = drawn(face_with_sheet(alpha), EVERY_SAMPLE)
    true = drawn(replace(halved, vertices=vertices, uv=uv), EVERY_SAMPLE)
    off = np.abs(cut - true).max(axis=2)
    assert np.abs(true - drawn(without_sheet(halved))).max(axis=2).max() > 100
    assert (off > 30).sum() <= 12  # pixels along the edge
    assert off.mean() < 0.3


@pytest.mark.parametrize("step", [4.0, -4.0], ids=["before", "behind"])
def test_a_translucent_part_before_and_behind_a_sheet_with_holes(step: float) -> None:
    def layered(alpha: np.ndarray | None) -> Face:
        face = face_with_sheet(alpha)
        second = face.vertices[-4:] + np.array([0, 0, step], np.float32)
        n = len(face.vertices)
        glass = replace(face.parts[-1], name="glass", first=len(face.triangles), opacity=0.5, cutout=False)
        return replace(
            face,
            vertices=np.concatenate([face.vertices, second]),
            triangles=np.concatenate([face.triangles, [[n, n + 1, n + 2], [n, n + 2, n + 3]]]).astype(np.int32),
            parts=(*face.parts, glass),
            shapes=np.pad(face.shapes, ((0, 0), (0, 4), (0, 0))),
            colours=np.concatenate([face.colours, face.colours[-4:]]),
            uv=np.concatenate([face.uv, face.uv[-4:]]),
        )

    np.testing.assert_array_equal(drawn(layered(full(255)), EVERY_SAMPLE), drawn(layered(None), EVERY_SAMPLE))


def test_the_order_of_triangles_does_not_matter() -> None:
    alpha = np.random.default_rng(1).integers(0, 256, (64, 64)).astype(np.uint8)
    face = face_with_sheet(alpha)
    turned = replace(face, triangles=np.concatenate([face.triangles[:-2], face.triangles[[-1, -2]]]))
    assert np.abs(drawn(face) - drawn(turned)).mean() < 0.2  # the samples of a pixel exchange their thresholds
