"""Characters as files hold them: faces at rest of .obj folders, empty shapes, painted mouths, shells before eyes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.interchange.characters.made import Variant, write_character_file
from tests.interchange.characters.test_gltf_mutations import small_head
from tts2face.interchange.characters.character import BLEND, Character, Material, MaterialPiece, MorphTarget
from tts2face.interchange.characters.eyeballs import mark_eyeballs
from tts2face.interchange.characters.gltf_reader import read_gltf_character
from tts2face.interchange.characters.head_mesh import LEFT_EYE, RIGHT_EYE, HeadMesh
from tts2face.interchange.characters.importing import import_face, propose_mapping, read_character
from tts2face.interchange.characters.obj_reader import read_obj_folder
from tts2face.interchange.characters.surface import shells_before_eyes

SQUARE = "v 0 0 0 {0}\nv 1 0 0 {0}\nv 1 1 0 {1}\nv 0 1 0 {1}\nf 1 2 3 4\n"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
RAISED = "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n"
CORNERS = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])


def write_objs(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / name).write_text(RAISED if "jaw" in name.lower() else TRIANGLE)
    return folder


@pytest.mark.parametrize(
    "names",
    [
        ("neutral.obj", "jawOpen.obj"),
        ("Neutral.OBJ", "jawOpen.OBJ"),
        ("generic_neutral_mesh.obj", "jawOpen.obj", "identity000.obj"),
        ("Head-Neutral.obj", "jawOpen.obj", "base.obj"),
        ("neutral.obj", "neutral_smile.obj", "jawOpen.obj"),
        ("Basis.obj", "jawOpen.obj"),
    ],
)
def test_the_face_at_rest_of_a_folder_is_found(names: tuple[str, ...], tmp_path: Path) -> None:
    character = read_obj_folder(write_objs(tmp_path, *names))
    assert len(character.target_names) == len(names) - 1
    assert propose_mapping(character)["jawOpen"][0].name == "jawOpen"
    assert character.pieces[0].vertices[2, 1] == 1.0


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (("jawOpen.obj", "smile.obj"), "has no neutral.obj"),
        (("a_neutral.obj", "b_neutral.obj", "jawOpen.obj"), r"several faces at rest \(a_neutral.obj, b_neutral.obj\)"),
    ],
)
def test_a_folder_without_one_face_at_rest_is_refused(names: tuple[str, ...], reason: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=reason):
        read_obj_folder(write_objs(tmp_path, *names))


@pytest.mark.parametrize(("dark", "light"), [("0 0 0", "1 0.5 0"), ("0 0 0", "255 127.5 0")])
def test_one_obj_file_is_a_character_without_shapes(dark: str, light: str, tmp_path: Path) -> None:
    path = tmp_path / "Bust.OBJ"
    path.write_text(SQUARE.format(dark, light))
    character = read_character(path)
    (piece,) = character.pieces
    assert piece.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert not character.target_names
    assert piece.colours is not None
    np.testing.assert_allclose(piece.colours[[0, 2]], [[0, 0, 0], [1.0, 0.216, 0]], atol=2e-3)  # linear light


def test_colours_that_only_some_vertices_have_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "bust.obj").write_text(SQUARE.format("", "1 0.5 0"))
    assert read_character(tmp_path / "bust.obj").pieces[0].colours is None


def test_materials_lie_beside_an_obj_file(tmp_path: Path) -> None:
    (tmp_path / "bust.obj").write_text("mtllib bust.mtl\n" + SQUARE.format("", "").replace("f ", "usemtl clay\nf "))
    (tmp_path / "bust.mtl").write_text("newmtl clay\nKd 1 0 0\n")
    assert read_character(tmp_path / "bust.obj").materials[0].colour == (1.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("scan.ply", r"not scan\.ply; export it as \.glb \(.*Blender opens \.ply and \.stl"),
        ("bust.STL", r"not bust\.STL; export it as \.glb"),
        ("empty.obj", r"has no faces; export the mesh, not only its points"),
    ],
)
def test_other_files_of_meshes_are_refused(name: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"v 0 0 0\n")
    with pytest.raises((DataError, InputError), match=reason):
        read_character(tmp_path / name)


def made_character(shapes: dict[str, float], **changes: object) -> Character:
    """A triangle with shapes that raise it by so much, and what else a character has."""
    names = {MorphTarget(0, number): name for number, name in enumerate(shapes)}
    up = np.array([0.0, 1.0, 0.0], np.float32)
    morphs = {target: np.tile(shapes[name] * up, (3, 1)) for target, name in names.items()}
    piece = MaterialPiece("mesh", CORNERS, np.array([[0, 1, 2]]), None, None, 0, morphs, np.zeros(3, np.int64))
    made = Character((piece,), (Material("skin"),), names, {}, {}, {}, {}, faces_back=False, licence="")
    return replace(made, **changes)


@pytest.mark.parametrize("still", [0.0, 1e-7, -1e-6])
def test_an_empty_jaw_is_as_good_as_missing(still: float) -> None:
    character = made_character({"jawOpen": still, "Fcl_MTH_A": 0.1, "Fcl_MTH_O": 0.1})
    assert character.still_names == ("jawOpen",)
    assert {*propose_mapping(character)} == {"mouthViseme_aa", "mouthViseme_oh"}


@pytest.mark.parametrize(("jaw", "speaks_by_visemes"), [(0.005, True), (0.05, False)])
def test_a_jaw_that_hardly_moves_beside_visemes_is_none(jaw: float, speaks_by_visemes: bool) -> None:
    others = {"mouthSmile": 0.1, "viseme_aa": 0.1, "viseme_O": 0.02}
    mapping = propose_mapping(made_character({"jawOpen": jaw} | others))
    assert ("jawOpen" in mapping) == (not speaks_by_visemes)
    assert ("mouthViseme_aa" in mapping) == speaks_by_visemes


def test_an_expression_counts_where_it_moves_something() -> None:
    binds = {"aa": {MorphTarget(0, 0): 1.0}, "ih": {MorphTarget(0, 1): 1.0}, "ou": {MorphTarget(0, 0): 0.0}, "ee": {}}
    character = made_character({"Key 1": 0.1, "Key 2": 0.0}, expressions=binds)
    assert character.moving_names == ("Key 1", "aa")
    assert {*propose_mapping(character)} == {"mouthViseme_aa"}


def _vrm1(binds: dict[str, object]) -> dict[str, object]:
    presets = {name: binds for name in ("aa", "ih", "ou")}
    humanoid = {"humanBones": {}}
    return {"VRMC_vrm": {"meta": {"name": "x"}, "humanoid": humanoid, "expressions": {"preset": presets}}}


def _vrm0() -> dict[str, object]:
    values = [{"materialName": "skin", "propertyName": "_MainTex_ST", "targetValue": [1, 1, 0.5, 0]}]
    painted = {"binds": [], "materialValues": values}
    groups = [{"name": name, "presetName": name} | painted for name in ("a", "i", "u", "o")]
    bones = {"humanBones": []}
    return {"VRM": {"meta": {"title": "x"}, "humanoid": bones, "blendShapeMaster": {"blendShapeGroups": groups}}}


@pytest.mark.parametrize(
    "extensions",
    [
        _vrm1({"textureTransformBinds": [{"material": 0, "offset": [0.5, 0.0]}]}),
        _vrm1({"materialColorBinds": [{"material": 0, "type": "color", "targetValue": [1, 0, 0, 1]}]}),
        _vrm0(),
    ],
    ids=["texture", "colour", "vrm0"],
)
def test_a_painted_mouth_is_refused_for_what_it_is(extensions: dict[str, object], tmp_path: Path) -> None:
    variant = Variant(rename=lambda name: f"Key {name[-4:]}", is_skinned=True, extensions=extensions)
    path = write_character_file(tmp_path / "painted.glb", variant, face=small_head())
    assert len(read_gltf_character(path).painted) >= 3
    with pytest.raises(DataError, match=r"mouth is painted: .* take a character whose mouth has shapes"):
        import_face(path)


@pytest.mark.parametrize(
    ("name", "mode", "is_shell"),
    [
        ("M_LacrimalFluid", "OPAQUE", True), ("M_EyeBlend", "OPAQUE", True), ("MI_EyeOcclusion_Inst", "OPAQUE", True),
        ("Std_Tearline_L", "OPAQUE", True), ("EyeMoisture", "OPAQUE", True), ("eyeshell_shader", "OPAQUE", True),
        ("Tear", "OPAQUE", True), ("M_LacrimalFluid", BLEND, False), ("M_ScleraLeft", "OPAQUE", False),
        ("Std_Eye_L", "OPAQUE", False), ("Teardrop_shirt", "OPAQUE", False), ("eyelashes", "OPAQUE", False),
        ("bears", "OPAQUE", False),
    ],
)  # fmt: skip
def test_shells_before_the_eyes_that_lost_their_transparency(name: str, mode: str, is_shell: bool) -> None:
    character = made_character({"jawOpen": 0.1}, materials=(Material(name, alpha_mode=mode),))
    assert shells_before_eyes(character) == ([0] if is_shell else [])


def _strip(centre: np.ndarray, radius: float) -> np.ndarray:
    angles = np.linspace(-1.2, 1.2, 40)
    ring = radius * np.column_stack([np.sin(angles), 0.35 * np.cos(angles), np.sqrt(0.8) * np.cos(angles)])
    return np.concatenate([ring, ring * [1, 0.8, 1]]) + centre


def _ball(centre: np.ndarray, radius: float, n: int = 200) -> np.ndarray:
    height = 1 - (2 * np.arange(n) + 1) / n
    around = np.arange(n) * np.pi * (3 - np.sqrt(5))
    level = np.sqrt(1 - height**2)
    return centre + radius * np.column_stack([level * np.cos(around), height, level * np.sin(around)])


def test_lashes_and_hair_are_no_eyeballs() -> None:
    parts, shapes = [], {}
    places = {"Left": np.array([0.03, 0.0, 0.0]), "Right": np.array([-0.03, 0.0, 0.0])}
    for centre in places.values():
        parts += [_ball(centre, 0.012), _strip(centre, 0.013)]
    parts += [_ball(np.zeros(3), 0.1), np.array([[0.03, 0.004, 0.02], [-0.03, 0.004, 0.02], [0.0, 0.1, 0.0]])]
    vertices = np.concatenate(parts)
    triangles, first = [], 0
    for part in parts:
        triangles.append(np.column_stack([np.arange(len(part) - 2) + first + k for k in range(3)]))
        first += len(part)
    for number, side in enumerate(places):
        blink = np.zeros(vertices.shape, np.float32)
        strip = 200 * (number + 1) + 80 * number
        blink[strip : strip + 80, 1] = -0.01
        blink[len(vertices) - 3 + number, 1] = -0.01
        shapes[f"eyeBlink{side}"] = blink
    n = len(vertices)
    head = HeadMesh(
        vertices, np.concatenate(triangles), np.zeros(n - 2 * len(parts), np.int64), np.zeros((n, 2)), np.ones((n, 3)),
        shapes, np.zeros(n, np.int64), np.zeros(n, np.int8), np.eye(3),
    )  # fmt: skip
    marked = mark_eyeballs(head, made_character({"jawOpen": 0.1}))
    assert [(marked.eye_of == eye).sum() for eye in (LEFT_EYE, RIGHT_EYE)] == [200, 200]
    assert np.ptp(marked.vertices[marked.eye_of == LEFT_EYE, 0]) < 0.025
