"""Structural mutations of character files: each loads, or is refused with one DataError."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.fuzz.mutations import change_value
from tests.interchange.characters.made import (
    Variant,
    glb,
    shipped_head,
    split_glb,
    write_character_file,
    write_landmarks,
)
from tts2face.interchange.characters.gltf_reader import read_gltf_character
from tts2face.interchange.characters.importing import import_face
from tts2face.models.face import Face, Texture
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER

N_MUTATIONS = 20  # of each of three files


def small_head() -> Face:
    """A head of few vertices: the lips and every sixteenth triangle of the shipped one, with five shapes."""
    from dataclasses import replace

    head = shipped_head()
    spans, first = [], 0
    lips = head.landmark_vertices[np.isin(head.landmarks, [*INNER_LIP_UPPER, *INNER_LIP_LOWER])]
    triangles: list[np.ndarray] = []
    for part in head.parts:
        corners = head.triangles[part.first : part.first + part.count]
        corners = corners[np.isin(corners, lips).any(axis=1) | (np.arange(part.count) % 16 == 0)]
        triangles.append(corners)
        spans.append(replace(part, first=first, count=len(corners)))
        first += len(corners)
    names = ("eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthPucker", "mouthSmileLeft")
    rows = [head.shape_names.index(name) for name in names]
    textures = tuple(
        Texture(texture.pixels[::16, ::16].copy(), None if texture.alpha is None else texture.alpha[::16, ::16].copy())
        for texture in head.textures
    )
    used, corners = np.unique(np.concatenate(triangles), return_inverse=True)
    bounds = [np.searchsorted(used, [eye.first, eye.first + eye.count]).tolist() for eye in head.eyes]
    eyes = tuple(replace(eye, first=low, count=high - low) for eye, (low, high) in zip(head.eyes, bounds, strict=True))
    return replace(
        head,
        vertices=head.vertices[used],
        colours=head.colours[used],
        uv=None if head.uv is None else head.uv[used],
        eyes=eyes,
        triangles=corners.reshape(-1, 3).astype(np.int32),
        landmarks=head.landmarks[:0],
        landmark_vertices=head.landmark_vertices[:0],
        landmark_weights=head.landmark_weights[:0],
        parts=tuple(spans),
        shape_names=names,
        shapes=head.shapes[rows][:, used],
        limits=head.limits[rows],
        textures=textures,
        tangents=None,
        occlusion=None,
        scores=None,
        hairdo=None,
    )


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[dict[str, Any], bytes]]:
    folder = tmp_path_factory.mktemp("sources")
    variants = {"skinned": Variant(is_skinned=True), "quantised": Variant(is_quantised=True)}
    names = list(small_head().shape_names)
    expressions = {"aa": {"morphTargetBinds": [{"node": 5, "index": names.index("jawOpen"), "weight": 1.0}]}}
    vrm = {"VRMC_vrm": {"meta": {"name": "x"}, "humanoid": {"humanBones": {}}, "expressions": {"preset": expressions}}}
    variants["vrm"] = Variant(is_skinned=True, extensions=vrm)
    found = {}
    for name, variant in variants.items():
        path = write_character_file(folder / f"{name}.glb", variant, face=small_head())
        found[name] = split_glb(path.read_bytes())
    return found


def mutate(root: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A copy of a document with one to three changes."""
    changed = copy.deepcopy(root)
    for _ in range(int(rng.integers(1, 4))):
        change_value(changed, rng)
    return changed


def outcome(path: Path, table: Path) -> tuple[Face | None, str]:
    """The imported face, or the message of the one error."""
    try:
        return import_face(path, landmarks=table).face, ""
    except (DataError, InputError) as error:
        return None, str(error)


@pytest.mark.fuzz
@pytest.mark.parametrize("name", [pytest.param("skinned", marks=pytest.mark.smoke), "quantised", "vrm"])
def test_a_mutated_file_loads_or_is_refused(
    name: str, sources: dict[str, tuple[dict[str, Any], bytes]], tmp_path: Path
) -> None:
    root, binary = sources[name]
    table, refused = write_landmarks(tmp_path / "landmarks.tsv"), 0
    for seed in range(N_MUTATIONS):
        path = tmp_path / "mutated.glb"
        path.write_bytes(glb(mutate(root, np.random.default_rng(seed)), binary))
        face, message = outcome(path, table)
        refused += face is None
        assert len(message) < 700
        assert "\n" not in message
        assert face is None or (np.isfinite(face.vertices).all() and np.isfinite(face.shapes).all())
    assert 0.2 * N_MUTATIONS < refused < N_MUTATIONS


@pytest.mark.parametrize("cut", [3, 11, 19, 40, 1000, -1, -5000])
def test_a_truncated_file_is_refused(cut: int, tmp_path: Path) -> None:
    content = write_character_file(tmp_path / "whole.glb", face=small_head()).read_bytes()
    path = tmp_path / "short.glb"
    path.write_bytes(content[:cut])
    with pytest.raises(DataError):
        read_gltf_character(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda root: root.update(extensionsRequired=["KHR_draco_mesh_compression"]),
            r"compressed with Draco .* @gltf-transform/cli copy IN.glb OUT.glb` and import its copy",
        ),
        (lambda root: root.update(extensionsRequired=["EXT_other"]), "requires the glTF extension EXT_other"),
        (lambda root: root["asset"].update(version="1.0"), "not glTF of version 2"),
        (lambda root: root["nodes"][-1]["children"].append(len(root["nodes"]) - 1), "has two parents"),
        (lambda root: root["accessors"][0].update(count=10**7), "are used"),
        (lambda root: root["bufferViews"][0].update(byteLength=10**9), "reaches to byte"),
        (lambda root: root["buffers"].__setitem__(0, {"byteLength": 4, "uri": "../secret.bin"}), "not a file beside"),
        (
            lambda root: root["buffers"].__setitem__(0, {"byteLength": 4, "uri": "data:;base64,@@@"}),
            "data URI is damaged",
        ),
        (lambda root: root["images"].__setitem__(0, {"uri": "data:;base64,AAAA"}), "image cannot be decoded"),
        (lambda root: root.update(nodes="x"), "nodes must be a list of objects"),
    ],
)
def test_each_defect_is_named(change: Any, message: str, tmp_path: Path) -> None:
    path = write_character_file(tmp_path / "whole.glb", Variant(is_quantised=True), face=small_head())
    root, binary = split_glb(path.read_bytes())
    change(root)
    path.write_bytes(glb(root, binary))
    with pytest.raises(DataError, match=message):
        read_gltf_character(path)


def test_a_gltf_file_with_files_beside_it(tmp_path: Path) -> None:
    root, binary = split_glb(write_character_file(tmp_path / "whole.glb", face=small_head()).read_bytes())
    (tmp_path / "head data.bin").write_bytes(binary)
    root["buffers"][0]["uri"] = "head%20data.bin"
    (tmp_path / "head.gltf").write_text(json.dumps(root))
    character, whole = (read_gltf_character(tmp_path / name) for name in ("head.gltf", "whole.glb"))
    assert len(character.pieces) == len(whole.pieces)
    np.testing.assert_array_equal(character.pieces[0].vertices, whole.pieces[0].vertices)


def test_a_picture_of_many_pixels_is_refused(tmp_path: Path) -> None:
    from tts2face.interchange.characters.materials import decode_image

    width = (100_000).to_bytes(4, "big")
    import zlib

    head = b"IHDR" + width + width + bytes([8, 2, 0, 0, 0])
    png = b"\x89PNG\r\n\x1a\n" + (13).to_bytes(4, "big") + head + zlib.crc32(head).to_bytes(4, "big")
    with pytest.raises(DataError, match=r"100000 x 100000 pixels|cannot be decoded"):
        decode_image(png, "test.png")
