"""Parts of the import: names of shapes, compressed buffers, atlas, alpha, points under pixels."""

from importlib.util import find_spec

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.interchange.characters.atlas import CUTOUT, build_atlas, coverage, fill_uncovered, triangle_opacity
from tts2face.interchange.characters.character import BLEND, MASK, Material
from tts2face.interchange.characters.shape_names import ARKIT_SHAPES, guess_mapping
from tts2face.interchange.characters.shapes import ShapeSource
from tts2face.interchange.characters.surface_points import (
    _barycentric,
    _Projection,
    nearest_points,
    points_under_pixels,
)
from tts2face.interchange.gltf.meshopt import decode_buffer
from tts2face.interchange.gltf.meshopt_filters import apply_filter
from tts2face.models.face_loading import load_face
from tts2face.numeric.arrays import matrix_quaternion, quaternion_matrix
from tts2face.picture.camera import CameraMatrices


def test_the_table_of_names_is_arkits() -> None:
    assert load_face("head").shape_names == (*ARKIT_SHAPES, "tongueUp")


@pytest.mark.parametrize(
    ("name", "shape", "side"),
    [
        ("eyeBlink_L", "eyeBlinkLeft", ""),
        ("EyeBlinkRight", "eyeBlinkRight", ""),
        ("blendShape1.jawOpen", "jawOpen", ""),
        ("Head_MouthLeft", "mouthLeft", ""),
        ("JAW_OPEN", "jawOpen", ""),
        ("mesh|mouth_Roll_Upper", "mouthRollUpper", ""),
        ("Brow_Raise_Inner_L", "browInnerUp", ""),
        ("viseme_PP", "mouthViseme_pp", ""),
        ("Fcl_MTH_O", "mouthViseme_oh", ""),
        ("mouthSmile", "mouthSmileLeft", "Left"),
        ("blink", "eyeBlinkRight", "Right"),
        ("eyesLookUp", "eyeLookUpLeft", "Left"),
    ],
)
def test_names_of_other_programs(name: str, shape: str, side: str) -> None:
    assert guess_mapping([name])[shape] == (ShapeSource(name, 1.0, side),)


@pytest.mark.parametrize("name", ["Height", "left_hand_fist", "Basis", "key 1", "mood"])
def test_other_names_are_not_taken_for_shapes(name: str) -> None:
    assert not guess_mapping([name])


def test_names_of_arkit_win_over_others_and_visemes() -> None:
    mapping = guess_mapping(["mouthOpen", "viseme_aa", "jawOpen", "mouthSmile", "mouthSmile_L"])
    assert mapping["jawOpen"] == (ShapeSource("jawOpen"),)
    assert mapping["mouthSmileLeft"][0].name == "mouthSmile_L"
    assert not [shape for shape in mapping if "Viseme" in shape]


def test_both_halves_of_an_unsided_shape_add_up() -> None:
    mapping = guess_mapping(["cheekPuff_L", "cheekPuff_R"])
    assert [source.name for source in mapping["cheekPuff"]] == ["cheekPuff_L", "cheekPuff_R"]


def attribute_stream(rows: np.ndarray) -> bytes:
    """Rows (N, stride) of one block as a meshopt stream whose deltas are stored in full."""
    count, stride = rows.shape
    groups = -(-count // 16)
    body, last = b"", rows[0].copy()
    for column in range(stride):
        values = rows[:, column].astype(int)
        deltas = (np.diff(np.concatenate([[int(last[column])], values])) + 128) % 256 - 128
        zigzag = np.where(deltas < 0, -2 * deltas - 1, 2 * deltas).astype(np.uint8)
        padded = np.zeros(groups * 16, np.uint8)
        padded[:count] = zigzag
        body += bytes([0xFF] * (-(-groups // 4))) + padded.tobytes()
    tail = bytes(max(32 - stride, 0)) + rows[0].tobytes()
    return b"\xa0" + body + tail


def test_compressed_attributes() -> None:
    rows = np.random.default_rng(1).integers(0, 256, (37, 8)).astype(np.uint8)
    content = np.frombuffer(attribute_stream(rows), np.uint8)
    np.testing.assert_array_equal(decode_buffer(content, "ATTRIBUTES", 37, 8), rows.reshape(-1))
    with pytest.raises(DataError, match="damaged"):
        decode_buffer(content[:40], "ATTRIBUTES", 37, 8)


def test_the_exponential_filter() -> None:
    packed = np.array([(-3 & 0xFF) << 24 | 20, (2 & 0xFF) << 24 | (-5 & 0xFFFFFF)], np.uint32).view(np.uint8)
    np.testing.assert_array_equal(np.frombuffer(apply_filter(packed, "EXPONENTIAL", 4).tobytes(), "<f4"), [2.5, -20.0])


@pytest.mark.skipif(find_spec("meshoptimizer") is None, reason="the reference encoder is not installed")
def test_triangles_and_attributes_of_the_reference_encoder() -> None:
    import meshoptimizer

    random = np.random.default_rng(2)
    triangles = random.integers(0, 300, (500, 3)).astype(np.uint32)
    stream = np.frombuffer(bytes(meshoptimizer.encode_index_buffer(triangles.reshape(-1), 1500, 300)), np.uint8)
    decoded = np.frombuffer(decode_buffer(stream, "TRIANGLES", 1500, 4).tobytes(), np.uint32).reshape(-1, 3)
    turned = [sorted(np.roll(row, n).tolist() for n in range(3)) for row in decoded]
    assert turned == [sorted(np.roll(row, n).tolist() for n in range(3)) for row in triangles]
    rows = np.cumsum(random.integers(-3, 4, (700, 12)), axis=0).astype(np.uint8)
    words = np.ascontiguousarray(rows).view(np.float32)
    stream = np.frombuffer(bytes(meshoptimizer.encode_vertex_buffer(words, 700, 12)), np.uint8)
    np.testing.assert_array_equal(decode_buffer(stream, "ATTRIBUTES", 700, 12), rows.reshape(-1))


def test_quaternions_of_rotation_matrices() -> None:
    random = np.random.default_rng(3)
    for _ in range(50):
        turn = random.normal(size=4)
        matrix = quaternion_matrix(turn)
        again = matrix_quaternion(matrix)
        assert abs(abs(float(again @ (turn / np.linalg.norm(turn)))) - 1) < 1e-12


def test_images_of_materials_lie_in_one_texture() -> None:
    images = [np.full((20 + 10 * n, 30, 4), 40 * n + 20, np.uint8) for n in range(4)]
    materials = {n: Material(str(n), (1.0, 1.0, 1.0, 1.0), image) for n, image in enumerate(images)}
    atlas = build_atlas(materials)
    assert atlas.texture is not None
    for n in materials:
        uv = atlas.coordinates(n, np.array([[0.0, 0.0], [0.5, 0.5], [1.0, 1.0], [7.0, -3.0]]))
        column, row = (
            np.minimum(uv * atlas.texture.shape[1::-1], np.array(atlas.texture.shape[1::-1]) - 1).astype(int).T
        )
        assert (atlas.texture[row, column] == 40 * n + 20).all()


def test_triangles_are_opaque_empty_translucent_or_have_holes() -> None:
    image = np.full((64, 64, 4), 255, np.uint8)
    image[:, :32, 3] = 0
    image[10:12, 4:6, 3] = 255  # a strand between the corners of the first triangle
    corners = np.array(
        [
            [[0.02, 0.1], [0.4, 0.1], [0.2, 0.9]],
            [[0.6, 0.1], [0.95, 0.1], [0.8, 0.9]],
            [[0.02, 0.5], [0.4, 0.5], [0.2, 0.9]],
            [[0.3, 0.5], [0.9, 0.5], [0.6, 0.9]],
        ]
    )
    masked = Material("lashes", image=image, alpha_mode=MASK)
    assert triangle_opacity(masked, corners).tolist() == [CUTOUT, 1.0, 0.0, CUTOUT]
    glass = Material("glass", (1.0, 1.0, 1.0, 0.5), image, alpha_mode=BLEND)
    assert triangle_opacity(glass, corners).tolist() == [CUTOUT, 0.55, 0.0, CUTOUT]
    assert triangle_opacity(Material("skin", image=image), corners).tolist() == [1.0] * 4
    assert triangle_opacity(Material("tint", (1.0, 1.0, 1.0, 0.3), alpha_mode=BLEND), corners).tolist() == [0.3] * 4


def test_the_cutoff_of_a_mask_decides_its_coverage() -> None:
    image = np.full((1, 4, 4), 255, np.uint8)
    image[0, :, 3] = [0, 60, 100, 255]
    assert coverage(Material("hair", image=image, alpha_mode=MASK, cutoff=0.3)).tolist() == [[0, 0, 255, 255]]
    half = Material("hair", (1.0, 1.0, 1.0, 0.5), image, alpha_mode=MASK, cutoff=0.3)
    assert coverage(half).tolist() == [[0, 0, 0, 255]]
    assert coverage(Material("hair", (1.0, 1.0, 1.0, 0.5), image, alpha_mode=BLEND)).tolist() == [[0, 30, 50, 128]]


def test_hidden_colours_beyond_an_edge_are_those_of_the_visible_pixels_near_them() -> None:
    colours, covered = np.zeros((37, 50, 3), np.uint8), np.zeros((37, 50), np.uint8)
    colours[:, :10], covered[:, :10] = (10, 200, 30), 255
    colours[:, 40:], covered[:, 40:] = (200, 20, 90), 255
    filled = fill_uncovered(colours, covered)
    np.testing.assert_array_equal(filled[:, :14], np.broadcast_to([10, 200, 30], (37, 14, 3)))
    np.testing.assert_array_equal(filled[:, 36:], np.broadcast_to([200, 20, 90], (37, 14, 3)))


def test_points_under_pixels_are_where_the_rays_meet_the_plane() -> None:
    vertices = np.array([[-50.0, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    view = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 500]])  # from z = 500, looking along -z
    camera = CameraMatrices(view, np.array([1000.0, 320.0, 320.0, 1.0]))
    wanted = np.array([[10.0, 20.0, 0.0], [-30.0, 5.0, 0.0]])
    pixels = np.column_stack([320 + wanted[:, 0] * 2, 320 - wanted[:, 1] * 2])
    points, facing = points_under_pixels(pixels, vertices, triangles, camera)
    np.testing.assert_allclose(points.places(vertices), wanted, atol=1e-9)
    assert (facing > 0.99).all()


@pytest.mark.fuzz
def test_the_nearest_triangle_under_a_pixel_is_that_of_a_brute_force_search() -> None:
    head = load_face("head")
    vertices, triangles = head.vertices.astype(np.float64), head.triangles.astype(np.int64)
    view = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 500]])
    camera = CameraMatrices(view, np.array([1000.0, 320.0, 320.0, 1.0]))
    projection = _Projection(vertices, triangles, camera)
    there = vertices @ view[:, :3].T + view[:, 3]
    flat = there[:, :2] / there[:, 2:] * 1000.0 + 320.0
    a, b, c = (flat[triangles[:, corner]] for corner in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    facing = triangles[area < 0]
    random = np.random.default_rng(5)
    n_hits = 0
    for pixel in random.uniform(-150, 1050, (300, 2)):
        weights = _barycentric(pixel, flat[facing])
        inside = np.flatnonzero((weights >= 0).all(axis=1))
        depths = (weights[inside] * there[facing[inside], 2]).sum(axis=1)
        hit = projection.hit(pixel)
        assert (hit is None) == (not len(inside))
        if hit is not None:
            n_hits += 1
            assert hit.depth == pytest.approx(depths.min(), abs=1e-6)
    assert n_hits > 40


def test_nearest_points_are_those_of_a_brute_force_search() -> None:
    head = load_face("head")
    skin = head.triangles[: head.parts[0].count : 7].astype(np.int64)
    random = np.random.default_rng(4)
    vertices = head.vertices.astype(np.float64)
    places = vertices[random.choice(np.unique(skin), 20)] + random.normal(size=(20, 3))
    found = nearest_points(places, vertices, skin).places(vertices)
    samples = random.dirichlet([1, 1, 1], 60)
    dense = np.einsum("sk,fkd->fsd", samples, vertices[skin]).reshape(-1, 3)
    least = np.array([np.linalg.norm(dense - place, axis=1).min() for place in places])
    assert (np.linalg.norm(found - places, axis=1) <= least + 1e-9).all()
