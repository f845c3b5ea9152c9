"""A character made from the shipped head is imported back: same vertices, shapes, landmarks, eyes and speech."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cli.main import run
from lexicon.errors import DataError, InputError
from tests.interchange.characters.made import (
    Variant,
    head_without_mouth,
    shipped_head,
    write_character_file,
    write_landmarks,
)
from tts2face.face.gestures import gesture_face
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.interchange.characters.importing import ImportedFace, import_face
from tts2face.interchange.characters.landmark_table import landmark_table, read_landmark_table
from tts2face.interchange.characters.saving import save_face
from tts2face.interchange.characters.shapes import mapping_table, read_mapping
from tts2face.lips.retargeting import build_retargeter
from tts2face.models.face import Face
from tts2face.models.face_file import read_face
from tts2face.models.landmarks import LIP_LANDMARKS
from tts2face.models.palette_file import load_palette
from tts2face.models.talker_file import load_talker
from tts2face.types import Trajectory

PLACE_MM = 0.02  # of a landmark after its table with 7 digits; quantised files have steps of 0.015 mm
ORIGIN_MM = 0.7  # between the centre of the eyeball that built the head and that of the sphere fitted to it
QUANTISED_MM = 0.03
LIPS = sorted(set(LIP_LANDMARKS))
MERGED = {"mouthSmile": ("mouthSmileLeft", "mouthSmileRight"), "eyesClosed": ("eyeBlinkLeft", "eyeBlinkRight")}
MISSING = frozenset({"cheekPuff", "noseSneerLeft", "browInnerUp", "mouthFunnel"})
VARIANTS = {
    "plain": Variant(),
    "skinned": Variant(is_skinned=True),
    "quantised": Variant(is_quantised=True),
    "backwards": Variant(turn_deg=180.0),
    "renamed": Variant(rename=lambda name: "blendShape1." + name.replace("Left", "_L").replace("Right", "_R")),
    "prefixed": Variant(rename=lambda name: "Head_" + name[0].upper() + name[1:]),
}


def made_face(folder: Path, name: str, variant: Variant) -> ImportedFace:
    character = write_character_file(folder / f"{name}.glb", variant)
    table = write_landmarks(folder / f"{name}.tsv", variant.turn_deg)
    return import_face(character, landmarks=table, front="-z" if variant.turn_deg else None)


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], ImportedFace]:
    """A face of `VARIANTS`, imported once."""
    folder = tmp_path_factory.mktemp("variants")
    return cache(lambda name: made_face(folder, name, VARIANTS[name]))


@pytest.fixture(scope="module")
def plain(shared: Callable[[str], ImportedFace]) -> ImportedFace:
    return shared("plain")


def motion_of(face: Face, name: str) -> np.ndarray:
    return scatter_landmarks(face, landmark_motion(face, np.array([face.shape_names.index(name)])))[:, :, 0]


@pytest.mark.parametrize("name", VARIANTS)
def test_shapes_and_landmarks_come_back(name: str, shared: Callable[[str], ImportedFace]) -> None:
    face, head = shared(name).face, shipped_head()
    assert set(face.shape_names) == set(head.shape_names)
    here, there = (scatter_landmarks(one, landmark_positions(one)) for one in (face, head))
    shift = np.median(here - there, axis=0)
    assert np.linalg.norm(shift) < ORIGIN_MM
    assert np.abs(here - there - shift).max() < (QUANTISED_MM if name == "quantised" else PLACE_MM)
    tolerance = QUANTISED_MM if name == "quantised" else 1e-3
    for shape in ("jawOpen", "mouthSmileLeft", "browDownRight", "mouthPucker"):
        moved = motion_of(face, shape)[:468] - motion_of(head, shape)[:468]
        assert np.abs(moved).max() < tolerance
    centres = [np.array([eye.centre for eye in one.eyes]) for one in (face, head)]
    assert np.abs(centres[0] - centres[1]).max() < ORIGIN_MM
    assert {shape for eye in face.eyes for shape in eye.turns} == {shape for eye in head.eyes for shape in eye.turns}


@pytest.mark.smoke
def test_speech_moves_an_imported_face_as_the_face_it_was_made_of(tmp_path: Path) -> None:
    """By the score map that it gets on its mesh, which is that of the face itself."""
    talker, head = load_talker("grid_s1"), head_without_mouth()
    plain = import_face(
        write_character_file(tmp_path / "plain.glb", face=head), landmarks=write_landmarks(tmp_path / "plain.tsv")
    )
    parameters = talker.utterances[0].shape[:, : talker.model.n_speech]
    speech = Trajectory(tuple(f"shape{n}" for n in range(talker.model.n_speech)), parameters, talker.fps)
    original = replace(head, lip_tolerance_mm=plain.face.lip_tolerance_mm)
    weights = [build_retargeter(talker, face).retarget(speech) for face in (plain.face, original)]
    assert set(weights[1].channels) - set(weights[0].channels) == {"tongueUp"}  # which moves no skin
    shared = [weights[1].channels.index(name) for name in weights[0].channels]
    np.testing.assert_allclose(weights[0].values, weights[1].values[:, shared], atol=2e-3)  # share of a shape


def test_a_skinned_head_turns_about_its_bone(shared: Callable[[str], ImportedFace]) -> None:
    face = shared("skinned").face
    assert np.abs(face.pivot - shipped_head().pivot).max() < ORIGIN_MM


def test_texture_and_colours_come_along(plain: ImportedFace) -> None:
    face, head = plain.face, shipped_head()
    assert face.textures
    skin = next(part for part in face.parts if part.name == "skin:skin")
    assert skin.is_textured
    own, there = (
        one.colours[np.unique(one.triangles[part.first : part.first + part.count])].astype(int)
        for one, name in ((face, "teeth:teeth_upper"), (head, "teeth_upper"))
        for part in one.parts
        if part.name == name
    )
    assert np.abs(own.mean(axis=0) - there.mean(axis=0)).max() < 3  # of 255: the file's gamma is 2.2, not sRGB


def test_merged_shapes_are_divided_and_missing_ones_are_named(tmp_path: Path) -> None:
    variant = Variant(merged=MERGED, dropped=MISSING)
    imported = made_face(tmp_path, "merged", variant)
    names = imported.face.shape_names
    assert {"mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft", "eyeBlinkRight"} <= set(names)
    left = np.linalg.norm(motion_of(imported.face, "mouthSmileLeft"), axis=1)
    assert left[291] > 5.0
    assert left[61] < 0.01
    assert set(imported.report.missing) == MISSING
    assert "default head" in imported.report.missing["browInnerUp"]
    assert imported.report.missing["mouthFunnel"] == "the other shapes of its mouth"
    prepared = gesture_face(imported.face, load_palette("starter"))
    assert "browInnerUp" in prepared.face.shape_names


def test_a_mapping_names_shapes_of_any_name(tmp_path: Path) -> None:
    variant = Variant(rename=lambda name: f"s{shipped_head().shape_names.index(name)}")
    character = write_character_file(tmp_path / "numbered.glb", variant)
    table = write_landmarks(tmp_path / "landmarks.tsv")
    with pytest.raises(DataError, match="no shape of a known name that moves its mouth"):
        import_face(character, landmarks=table)
    number = shipped_head().shape_names.index
    (tmp_path / "map.toml").write_text(
        f'[shapes]\njawOpen = "s{number("jawOpen")}"\nmouthPucker = {{s{number("mouthPucker")} = 0.5}}\n'
        f'eyeBlinkLeft = "s{number("eyeBlinkLeft")}"\n'
    )
    face = import_face(character, landmarks=table, mapping=tmp_path / "map.toml").face
    assert {"jawOpen", "mouthPucker", "eyeBlinkLeft"} <= set(face.shape_names)
    np.testing.assert_allclose(
        motion_of(face, "mouthPucker")[13], 0.5 * motion_of(shipped_head(), "mouthPucker")[13], atol=1e-3
    )


def test_a_mapping_survives_its_table(plain: ImportedFace, tmp_path: Path) -> None:
    path = tmp_path / "mapping.tsv"
    path.write_text(mapping_table(plain.report.mapping))
    assert read_mapping(path) == plain.report.mapping


def test_landmarks_survive_their_table_in_the_axes_of_the_file(
    shared: Callable[[str], ImportedFace], tmp_path: Path
) -> None:
    imported = shared("backwards")
    given = read_landmark_table(write_landmarks(tmp_path / "given.tsv", VARIANTS["backwards"].turn_deg))
    (tmp_path / "again.tsv").write_text(landmark_table(imported.report.landmarks))
    again = read_landmark_table(tmp_path / "again.tsv")
    gaps = [np.linalg.norm(given[number] - again[number]) for number in given]
    assert max(gaps) < 2e-5  # metres


def test_a_vrm_file_speaks_by_its_expressions(tmp_path: Path) -> None:
    vowels = {
        "aa": "jawOpen",
        "ih": "mouthStretchLeft",
        "ou": "mouthPucker",
        "ee": "mouthSmileLeft",
        "oh": "mouthFunnel",
    }
    names = [name for name in shipped_head().shape_names]
    binds = {
        vowel: {"morphTargetBinds": [{"node": 0, "index": names.index(shape), "weight": 1.0}]}
        for vowel, shape in vowels.items()
    }
    blink = [{"node": 0, "index": names.index(f"eyeBlink{side}"), "weight": 1.0} for side in ("Left", "Right")]
    extension = {
        "specVersion": "1.0",
        "meta": {"name": "Test", "licenseUrl": "https://example.org/licence"},
        "humanoid": {"humanBones": {}},
        "expressions": {"preset": binds | {"blink": {"morphTargetBinds": blink}}},
    }
    variant = Variant(rename=lambda name: f"m{names.index(name)}", extensions={"VRMC_vrm": extension})
    character = write_character_file(tmp_path / "test.vrm", variant)
    imported = import_face(character, landmarks=write_landmarks(tmp_path / "landmarks.tsv"))
    assert {"mouthViseme_aa", "mouthViseme_ou", "eyeBlinkLeft", "eyeBlinkRight"} <= set(imported.face.shape_names)
    assert imported.report.missing["jawLeft"] == "the character's own visemes"
    assert "licenseUrl https://example.org/licence" in imported.report.licence
    build_retargeter(load_talker("grid_s1"), imported.face)


def test_a_folder_of_obj_files(tmp_path: Path) -> None:
    head, folder = shipped_head(), tmp_path / "objs"
    folder.mkdir()
    faces = "\n".join(f"f {a} {b} {c}" for a, b, c in (head.triangles + 1).tolist())
    poses = {"neutral": head.vertices}
    for name in ("jawOpen", "mouthPucker", "mouthSmile_L", "eyeBlink_L", "eyeBlink_R"):
        shape = name.replace("_L", "Left").replace("_R", "Right")
        poses[name] = head.vertices + head.shapes[head.shape_names.index(shape)]
    for name, places in poses.items():
        lines = "\n".join(f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in (places * 0.001).tolist())
        (folder / f"{name}.obj").write_text(f"{lines}\n{faces}\n")
    face = import_face(folder, landmarks=write_landmarks(tmp_path / "landmarks.tsv")).face
    np.testing.assert_allclose(motion_of(face, "jawOpen")[14], motion_of(head, "jawOpen")[14], atol=2e-3)
    (folder / "jawOpen.obj").write_text("v 0 0 0\n")
    with pytest.raises(DataError, match=r"has 1 vertices, but neutral\.obj has"):
        import_face(folder)


@pytest.mark.usefixtures("face_model")
def test_tracked_landmarks_lie_near_the_true_ones(tmp_path: Path) -> None:
    character = write_character_file(tmp_path / "tracked.glb", Variant(turn_deg=180.0))
    imported = import_face(character)
    face, head = imported.face, shipped_head()
    here, there = (scatter_landmarks(one, landmark_positions(one)) for one in (face, head))
    shift = np.median(here - there, axis=0)
    assert np.linalg.norm(shift) < 1.0  # mm; of the origin, which follows from the eyes
    gaps = np.linalg.norm((here - there - shift)[:468], axis=1)
    assert np.median(gaps) < 1.8  # mm; the head's own were located on the reference person
    assert gaps[LIPS].max() < 5.0
    opened = [motion_of(one, "jawOpen")[[13, 14], 1] for one in (face, head)]
    assert abs(np.diff(opened[0]) / np.diff(opened[1]) - 1)[0] < 0.15  # the widest gap of the lips


def test_a_saved_face_is_read_and_a_bad_one_does_not_appear(plain: ImportedFace, tmp_path: Path) -> None:
    save_face(tmp_path / "me.face", plain.face)
    assert read_face(tmp_path / "me.face").shape_names == plain.face.shape_names
    with pytest.raises(DataError, match=r"broken\.face.*vertices"):
        save_face(tmp_path / "broken.face", replace(plain.face, vertices=plain.face.vertices * 1e6))
    assert [path.name for path in tmp_path.iterdir()] == ["me.face"]


def test_the_commands_import_and_show(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    character = write_character_file(tmp_path / "character.glb", Variant(dropped=frozenset({"cheekPuff"})))
    table, face = write_landmarks(tmp_path / "landmarks.tsv"), tmp_path / "me.face"
    words = ["face", "import", str(character), "--out", str(face), "--landmarks", str(table)]
    words += ["--preview", str(tmp_path / "check.png"), "--write-mapping", str(tmp_path / "map.tsv")]
    words += ["--sheet", str(tmp_path / "sources.png")]
    assert run(words) == 0
    printed = capsys.readouterr().out
    assert "jawOpen\tjawOpen\t1" in (tmp_path / "map.tsv").read_text()
    assert {"found       51 of ARKit's 52", "missing     cheekPuff"} <= {*printed.splitlines()}
    strong = re.findall(r"(\w+) (\d\.\d\d) \((\w+)\)", " ".join(printed.split()))
    assert len(strong) == 6
    assert all((shape, own) == (source, "1.00") for shape, own, source in strong)
    assert len(printed.splitlines()) <= 24
    assert run(["face", "show", str(face), "--out", str(tmp_path / "sheet.png"), "--quiet"]) == 0
    assert run(["face", "still", str(face), "--size", "128x160", "--out", str(tmp_path / "still.png")]) == 0
    assert "128 x 160 pixels" in capsys.readouterr().err
    sizes = {
        "sheet.png": (8 * 192, 7 * 208),
        "check.png": (3 * 640, 640),
        "sources.png": (8 * 192, 7 * 224),
        "still.png": (128, 160),
    }
    for name, size in sizes.items():
        with Image.open(tmp_path / name) as picture:
            assert picture.size == size
    before = character.read_bytes()
    assert run(["face", "import", str(character), "--out", str(character)]) == 2
    assert character.read_bytes() == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"front": "up"}, "no front 'up'; choose"),
        ({"mapping": {"jawOpen": ()}}, None),
        ({"landmarks": "none.tsv"}, "cannot read the landmarks"),
        ({"mapping": "none.tsv"}, "cannot read the mapping"),
        ({"mapping": "none.json"}, "a mapping is a .tsv or .toml file"),
    ],
)
def test_wrong_options_are_refused(options: dict, message: str | None, tmp_path: Path) -> None:
    character = write_character_file(tmp_path / "character.glb")
    table = write_landmarks(tmp_path / "landmarks.tsv")
    if message is None:
        face = import_face(character, landmarks=table, **options).face
        assert "jawOpen" not in face.shape_names
        return
    with pytest.raises(InputError, match=message):
        import_face(character, **{"landmarks": table} | options)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("map.toml", "[shapes]\njawOpen = {Open = 1" + "0" * 400 + "}", "Open is too large a number; the maximum"),
        ("map.toml", "[shapes]\njawOpen = {Open = true}", "jawOpen: the gain of Open must be a number, not true"),
        ("map.toml", "[shapes]\njawOpen = [1]", r"jawOpen: give a name or a table of names with gains, not \[1\]"),
        ("map.tsv", "jawOpen\tOpen\t1" + "0" * 400, "map.tsv, line 1: .* is not a number; correct it"),
        ("map.tsv", "jawOpen\tOpen\t11", "line 1: the gain 11 is not within 10"),
    ],
)
def test_a_wrong_mapping_is_refused(name: str, content: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(DataError, match=reason):
        read_mapping(tmp_path / name)


@pytest.mark.smoke
def test_a_source_that_does_not_exist_is_named(tmp_path: Path) -> None:
    character = write_character_file(tmp_path / "character.glb")
    (tmp_path / "map.tsv").write_text("jawOpen\tMouthWide\n")
    with pytest.raises(InputError, match="no shape 'MouthWide'; it has: browDownLeft"):
        import_face(character, mapping=tmp_path / "map.tsv", landmarks=write_landmarks(tmp_path / "l.tsv"))
    with pytest.raises(InputError, match=r"a character is a .glb, .gltf, .vrm, .obj file or a folder"):
        import_face(tmp_path / "map.tsv")
