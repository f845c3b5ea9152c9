"""The face of the live preview: its geometry and shapes are the face's within the quantisation."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

from tests.picture.film.lit_face import SKIN_LIGHT, lit_tiny_face
from tests.picture.tiny_face import tiny_face
from tts2face.face.rest_light import in_rest_light
from tts2face.interchange.exports import stage_surfaces
from tts2face.interchange.exports.stage_glb import LEAST_MOVE_MM, quantised_moves, stage_glb
from tts2face.interchange.exports.surfaces import divide_surface
from tts2face.models.light import Baked

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
FACE = tiny_face(textured=True)


class Read:
    """A file read by the rules of the glTF specification."""

    def __init__(self, content):
        size = struct.unpack_from("<I", content, 12)[0]
        self.json = json.loads(content[20 : 20 + size])
        self.binary = content[28 + size :]

    def view(self, number, kind, count):
        at = self.json["bufferViews"][number]["byteOffset"]
        return np.frombuffer(self.binary, kind, count, at)

    def accessor(self, number):
        one = self.json["accessors"][number]
        width, kind = WIDTHS[one["type"]], TYPES[one["componentType"]]
        values = np.zeros((one["count"], width), kind)
        if "bufferView" in one:
            values = self.view(one["bufferView"], kind, values.size).reshape(-1, width).copy()
        if "sparse" in one:
            sparse = one["sparse"]
            at = self.view(sparse["indices"]["bufferView"], TYPES[sparse["indices"]["componentType"]], sparse["count"])
            values[at] = self.view(sparse["values"]["bufferView"], kind, sparse["count"] * width).reshape(-1, width)
        return values


@pytest.fixture(scope="module")
def made():
    with pytest.MonkeyPatch.context() as whole:
        whole.setattr(stage_surfaces, "LEAST_TRIANGLES", 10**9)
        return Read(stage_glb(FACE, FACE.shape_names))


def test_triangles_are_those_of_the_face(made):
    for surface, primitive in zip(divide_surface(FACE), made.json["meshes"][0]["primitives"], strict=True):
        places = made.accessor(primitive["attributes"]["POSITION"]) * 1000
        corners = places[made.accessor(primitive["indices"]).reshape(-1, 3)]
        expected = FACE.vertices[surface.vertices[surface.triangles]]
        order = [np.lexsort(one.reshape(len(one), -1).round(3).T) for one in (corners, expected)]
        assert corners[order[0]] == pytest.approx(expected[order[1]], abs=1e-3)  # float32 of metres, in mm


def test_large_surfaces_are_reduced_to_vertices_of_the_face(made):
    reduced = Read(stage_glb(FACE, FACE.shape_names))
    counts = [
        [one.json["accessors"][primitive["indices"]]["count"] // 3 for primitive in one.json["meshes"][0]["primitives"]]
        for one in (reduced, made)
    ]
    assert sum(counts[0]) < 0.9 * sum(counts[1])
    assert all(few == all_ for few, all_ in zip(*counts, strict=True) if all_ < stage_surfaces.LEAST_TRIANGLES)
    for primitive in reduced.json["meshes"][0]["primitives"]:
        places = reduced.accessor(primitive["attributes"]["POSITION"]) * 1000
        away = np.abs(FACE.vertices[None] - places[:, None]).max(axis=2).min(axis=1)
        assert away.max() < 1e-3  # float32 of metres, in mm


def test_targets_move_vertices_as_the_shapes_do(made):
    mesh = made.json["meshes"][0]
    assert mesh["extras"]["targetNames"] == list(FACE.shape_names)
    for primitive in mesh["primitives"]:
        places = made.accessor(primitive["attributes"]["POSITION"]) * 1000
        at = [int(np.argmin(np.abs(FACE.vertices - place).sum(axis=1))) for place in places]
        for shape, target, scale in zip(FACE.shapes, primitive["targets"], mesh["extras"]["scales"], strict=True):
            moves = made.accessor(target["POSITION"]) / 32767 * 1000 / scale
            step = 1000 / scale / 32767
            assert moves == pytest.approx(shape[at], abs=max(step, LEAST_MOVE_MM))


def test_small_shapes_keep_their_precision():
    shapes = np.zeros((2, 3, 3), np.float32)
    shapes[0, 1], shapes[1, 2] = (0.05, 0.0, -0.02), (40.0, -13.0, 0.005)
    moves, scales = quantised_moves(shapes)
    back = moves / 32767 * 1000 / scales[:, None, None]
    assert back[0] == pytest.approx(shapes[0], abs=0.05 / 32767)
    assert back[1] == pytest.approx(shapes[1], abs=40 / 32767)


def test_other_viewers_can_read_it(made):
    assert made.json["extensionsRequired"] == ["KHR_mesh_quantization", "EXT_texture_webp"]
    stage = made.json["asset"]["extras"]
    assert set(stage["views"]) == {"front", "three-quarter", "profile", "close"}
    assert len(stage["lamps"]) == 4
    assert len(stage["eyes"]) == len(FACE.eyes)


def test_a_face_with_baked_light_is_shown_in_it_at_rest() -> None:
    face = lit_tiny_face()
    light = face.light.baked
    lashes = face.triangles[face.parts[-1].first :]
    brown = replace(light, page_of={"skin": 0}, rows=np.unique(lashes).astype(np.int32))
    brown = replace(brown, base=np.full((len(brown.rows), 3), (90, 60, 30), np.uint8))
    shown, unlit = in_rest_light(replace(face, light=Baked(brown)))
    assert unlit == {"skin", "lashes"}
    assert [one.pixels[0, 0].tolist() for one in shown.textures] == [list(SKIN_LIGHT), [30, 30, 30]]
    assert (shown.colours[brown.rows] == (90, 60, 30)).all()
    others = np.setdiff1d(np.arange(len(face.vertices)), brown.rows)
    np.testing.assert_array_equal(shown.colours[others], face.colours[others])

    made = Read(stage_glb(face, face.shape_names))
    by_name = {one["name"]: one for one in made.json["materials"]}
    assert {name for name, one in by_name.items() if one["extras"]["unlit"]} == {"skin", "lashes"}
    assert by_name["skin"]["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    assert by_name["lashes"]["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 1}
    assert in_rest_light(FACE) == (FACE, frozenset())
