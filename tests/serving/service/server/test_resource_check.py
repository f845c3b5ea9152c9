"""Uploaded talkers, faces, palettes and dictionaries: checked, rewritten and drawn in a limited process."""

import io
import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from safetensors.numpy import save

from tests.interchange.characters.made import Variant, head_without_mouth, split_glb, write_character_file
from tests.models.made import write_made_models, write_made_talker
from tests.photo.pictures import still
from tests.processes.answered import refusal
from tts2face.interchange.characters.binding import KEY
from tts2face.models.consent import PHOTO_TOOL
from tts2face.models.face_file import read_face
from tts2face.models.light import Photographed
from tts2face.serving.work.resource_check import PLACES, SHOWN, STATEMENT, draw_resource, is_picture
from tts2face.session.session import Session
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors

MOST_BYTES = 50e6
WORDS = b"Siobhan  SH IH0 V AO1 N\nNguyen /\xc5\x8bwi\xc9\x99n/ # a name\n"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Small files of each kind."""
    return write_made_models(tmp_path_factory.mktemp("resources"), WORDS)


def check(
    kind: str, source: Path, folder: Path, most: float = MOST_BYTES, *, is_limited: bool = False
) -> tuple[str, Path]:
    checked = folder / "checked"
    checked.mkdir()
    return refusal(kind, source, checked, most, is_limited=is_limited), checked


@pytest.mark.parametrize(
    ("kind", "fact"),
    [
        ("talker", {"n_utterances": 6, "has_own_face": False, "language": "not stated"}),
        ("face", {"identities": ["older"], "summary": "mesh with 4 shapes"}),
        ("palette", {}),
        ("dictionary", {"n_words": 2}),
    ],
)
def test_a_file_is_described_and_drawn(files: dict[str, Path], tmp_path: Path, kind: str, fact: dict[str, Any]) -> None:
    message, checked = check(kind, files[kind], tmp_path)
    assert message == ""
    about = json.loads((checked / "description.json").read_text())
    assert about | fact == about
    if kind == "dictionary":
        assert (checked / "content").read_bytes() == WORDS
        return
    assert (checked / "content").read_bytes() == files[kind].read_bytes()  # as this package writes it
    with Image.open(checked / "picture.png") as picture:
        assert len(np.unique(np.asarray(picture))) > 20  # shows something


@pytest.mark.smoke
def test_a_talker_with_a_face_needs_the_consent_of_the_person(tmp_path: Path) -> None:
    path = tmp_path / "a.talker"
    write_made_talker(path, has_face=True)
    message, _ = check("talker", path, tmp_path)
    assert message == "it shows a person's face, but states no consent; build it with --consent"  # fmt: skip


def test_a_talker_with_a_face_and_consent_is_drawn_with_it(tmp_path: Path) -> None:
    path = tmp_path / "a.talker"
    write_made_talker(path, has_face=True)
    arrays, header = read_tensors(path, "talker", 1)
    header["consent"] = {"name": "Ada", "statement": "I agree to this.", "date": "2026-01-02"}
    write_tensors(path, "talker", 1, arrays, header)
    message, checked = check("talker", path, tmp_path)
    assert message == ""
    assert json.loads((checked / "description.json").read_text())["has_own_face"] is True
    with Image.open(checked / "picture.png") as own, Image.open(_default_picture(tmp_path)) as default:
        assert np.abs(np.asarray(own).astype(int) - np.asarray(default)).mean() > 10


def _default_picture(folder: Path) -> Path:
    """Picture of the shipped talker, which has no face of its own."""
    path = folder / "default.png"
    draw_resource("talker", find_file("grid_s1", "talker"), path)
    return path


@pytest.mark.smoke
def test_a_face_does_not_keep_paths_of_the_machine_that_made_it(files: dict[str, Path], tmp_path: Path) -> None:
    """The file of a character that a face names would be read by exports."""
    arrays, header = read_tensors(files["face"], "face", 1)
    header["metadata"] |= {KEY: {"file": "/etc/passwd", "sha256": "0" * 64}}
    write_tensors(tmp_path / "bound.face", "face", 1, arrays, header)
    message, checked = check("face", tmp_path / "bound.face", tmp_path)
    assert message == ""
    assert KEY not in read_face(checked / "content").metadata


@pytest.mark.usefixtures("face_model")
def test_a_character_becomes_a_face(tmp_path: Path) -> None:
    write_character_file(tmp_path / "avatar", face=head_without_mouth())
    message, checked = check("face", tmp_path / "avatar", tmp_path)
    assert message == ""
    about = json.loads((checked / "description.json").read_text())
    assert (about["summary"], about["licence"]) == ("mesh with 52 shapes", "made by a test")
    face = read_face(checked / "content")
    assert face.metadata["character"]["file"] == str(checked / "content")
    assert face.scores is not None  # calibrated on the mesh
    assert face.lip_tolerance_mm > 0
    assert any(note.startswith("found: 52 of ARKit's 52") for note in about["notes"])


@pytest.mark.usefixtures("face_model")
def test_clips_of_a_sent_character_are_its_own_rigged_file(tmp_path: Path) -> None:
    variant = Variant(is_skinned=True, rename=lambda name: f"Wolf3D.{name}")
    source = write_character_file(tmp_path / "avatar", variant, head_without_mouth())
    sent, _ = split_glb(source.read_bytes())
    message, checked = check("face", source, tmp_path)
    assert message == ""
    source.unlink()
    moved = (checked / "content").rename(tmp_path / "blob")  # as a store names it, on another machine
    Session(face=str(moved), palette=None).export("Papa.", [tmp_path / "a.glb"], fps=10)
    root, _ = split_glb((tmp_path / "a.glb").read_bytes())
    for key in ("meshes", "skins", "materials"):
        assert root[key] == sent[key]
    assert root["nodes"][: len(sent["nodes"])] == sent["nodes"]
    assert root["animations"][0]["name"] == "tts2face"
    assert {channel["target"]["path"] for channel in root["animations"][0]["channels"]} == {"weights", "rotation"}


def obj_text(vertices: np.ndarray) -> bytes:
    """The skin and eyes of the shipped head as an .obj file, in metres."""
    head = head_without_mouth()
    rows = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices / 1000.0]
    for part in head.parts:
        corners = head.triangles[part.first : part.first + part.count] + 1
        rows += [f"usemtl {part.name}", *(f"f {a} {b} {c}" for a, b, c in corners.tolist())]
    return "\n".join(rows).encode()


@pytest.mark.usefixtures("face_model")
def test_a_folder_of_obj_files_is_sent_as_an_archive(tmp_path: Path) -> None:
    head = head_without_mouth()
    files = [("head/neutral.obj", obj_text(head.vertices)), ("__MACOSX/head/._neutral.obj", b"\0")]
    for name in ("jawOpen", "mouthPucker", "eyeBlinkLeft", "eyeBlinkRight"):
        files.append((f"head/{name}.obj", obj_text(head.vertices + head.shapes[head.shape_names.index(name)])))
    (tmp_path / "avatar").write_bytes(packed(*files))
    message, checked = check("face", tmp_path / "avatar", tmp_path)
    assert message == ""
    about = json.loads((checked / "description.json").read_text())
    assert any(note.startswith("found: 4 of ARKit's 52") for note in about["notes"])
    assert all(len(note) < 1000 for note in about["notes"])
    assert len(Session(face=str(checked / "content"), palette=None).clip("Papa.").motion) > 10


@pytest.mark.usefixtures("face_model")
def test_a_gltf_file_is_sent_with_its_buffers_in_an_archive(tmp_path: Path) -> None:
    write_character_file(tmp_path / "a.glb", face=head_without_mouth())
    root, binary = split_glb((tmp_path / "a.glb").read_bytes())
    root["buffers"][0]["uri"] = "buffers/all.bin"
    files = ("scene.gltf", json.dumps(root).encode()), ("buffers/all.bin", binary)
    (tmp_path / "avatar").write_bytes(packed(*files))
    message, checked = check("face", tmp_path / "avatar", tmp_path)
    assert message == ""
    Session(face=str(checked / "content"), palette=None).export("Papa.", [tmp_path / "b.glb"], fps=10)
    animated, _ = split_glb((tmp_path / "b.glb").read_bytes())
    assert animated["meshes"] == root["meshes"]
    assert "uri" not in animated["buffers"][0]


@pytest.mark.smoke
def test_a_character_within_a_sent_face_is_left_out(files: dict[str, Path], tmp_path: Path) -> None:
    """It was not made here, and would be served as it is."""
    arrays, header = read_tensors(files["face"], "face", 1)
    write_tensors(tmp_path / "held.face", "face", 1, {**arrays, KEY: np.frombuffer(b"<script>", np.uint8)}, header)
    message, checked = check("face", tmp_path / "held.face", tmp_path)
    assert message == ""
    assert KEY not in read_tensors(checked / "content", "face", 1)[0]


@pytest.mark.usefixtures("face_model")
def test_a_mapping_names_the_shapes_of_a_character(tmp_path: Path) -> None:
    """Of names that nobody could guess: without it the character is refused, and the message names the part."""
    numbers: dict[str, str] = {}
    hidden = Variant(rename=lambda name: numbers.setdefault(name, f"x{len(numbers)}q"))
    source = write_character_file(tmp_path / "avatar", hidden, head_without_mouth())
    message, _ = check("face", source, tmp_path)
    assert "name its shapes in a file and give it as the part mapping" in message
    again = tmp_path / "again"
    again.mkdir()
    rows = "".join(f"{shape}\t{name}\n" for shape, name in numbers.items())
    (again / STATEMENT).write_text(json.dumps({"mapping": rows}))
    message, checked = check("face", source.rename(again / "avatar"), again)
    assert message == ""
    assert "jawOpen" in read_face(checked / "content").shape_names


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("mapping", "reason"),
    [
        ("jawOpen", "the mapping, line 1: has 1 columns; give shape, source and gain"),
        ("jawOpen\tnone", "the character has no shape 'none'"),
        ("[shapes]\njawOpen = 3", "the mapping, jawOpen: give a name or a table of names with gains, not 3"),
        ("[shapes]\njawOpen =", "the mapping is not TOML"),
        ("", "the mapping names no shape"),
    ],
)
def test_a_wrong_mapping_is_refused(plain_character: Path, tmp_path: Path, mapping: str, reason: str) -> None:
    source = tmp_path / "avatar"
    source.hardlink_to(plain_character)
    (tmp_path / STATEMENT).write_text(json.dumps({"mapping": mapping}))
    message, _ = check("face", source, tmp_path)
    assert reason in message
    assert str(tmp_path) not in message


@pytest.fixture(scope="module")
def plain_character(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_character_file(tmp_path_factory.mktemp("plain") / "avatar", face=head_without_mouth())


@pytest.mark.smoke
@pytest.mark.parametrize("consent", [None, "", {}, {"statement": ""}, {"statement": "yes"}, {"statement": 3}])
def test_a_head_of_a_photo_needs_a_statement(files: dict[str, Path], tmp_path: Path, consent: object) -> None:
    """A consent that says nothing is none."""
    arrays, header = read_tensors(files["face"], "face", 1)
    header["metadata"] |= {"made_by": PHOTO_TOOL} | ({} if consent is None else {"consent": consent})
    write_tensors(tmp_path / "head.face", "face", 1, arrays, header)
    message, _ = check("face", tmp_path / "head.face", tmp_path)
    assert message == "it shows a person's photograph, but states no consent; make it with --consent"


@pytest.mark.smoke
def test_a_talker_needs_more_than_an_empty_consent(tmp_path: Path) -> None:
    write_made_talker(tmp_path / "a.talker", has_face=True)
    arrays, header = read_tensors(tmp_path / "a.talker", "talker", 1)
    header["consent"] = {"name": "Ada", "statement": " ", "date": ""}
    write_tensors(tmp_path / "a.talker", "talker", 1, arrays, header)
    message, _ = check("talker", tmp_path / "a.talker", tmp_path)
    assert message == "it shows a person's face, but states no consent; build it with --consent"


@pytest.mark.smoke
@pytest.mark.parametrize("form", ["PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF"])
def test_pictures_are_told_by_their_first_bytes(form: str, files: dict[str, Path]) -> None:
    content = io.BytesIO()
    Image.new("RGB", (8, 8)).save(content, form)
    assert is_picture(content.getvalue()[:12])
    assert not any(is_picture(path.read_bytes()[:12]) for path in files.values())


@pytest.mark.usefixtures("face_model")
def test_a_photo_becomes_a_face_that_keeps_the_consent(tmp_path: Path) -> None:
    Image.fromarray(still("tomas", 320)).save(tmp_path / "photo.jpg")
    state(tmp_path, consent=None)
    message, _ = check("face", tmp_path / "photo.jpg", tmp_path)
    assert "state the consent" in message
    (tmp_path / "checked").rmdir()
    state(tmp_path, consent="me", fit='{"pivot": [170, 200]}')
    message, checked = check("face", tmp_path / "photo.jpg", tmp_path)
    assert message == ""
    face = read_face(checked / "content")
    assert isinstance(face.light, Photographed)
    assert face.metadata["consent"]["statement"] == "me"
    assert face.metadata["name"] == "tom"
    assert face.metadata["fit"]["pivot"] == pytest.approx([170, 200], abs=0.2)
    with Image.open(checked / "picture.png") as picture:
        assert np.asarray(picture).std() > 30


@pytest.mark.usefixtures("face_model")
def test_a_picture_without_a_face_is_refused(tmp_path: Path) -> None:
    Image.fromarray(np.full((200, 200, 3), 90, np.uint8)).save(tmp_path / "wall.png")
    state(tmp_path)
    message, _ = check("face", tmp_path / "wall.png", tmp_path)
    assert "there is no face in" in message
    assert str(tmp_path) not in message


def state(folder: Path, **more: Any) -> None:
    """State who is shown in a photo of a folder."""
    stated = {"name": "tom", "consent": "nobody", "max_pixels": 1_000_000} | more
    (folder / STATEMENT).write_text(json.dumps(stated))


@pytest.mark.usefixtures("face_model")
def test_places_of_a_photo_are_found_for_a_person_to_correct(tmp_path: Path) -> None:
    Image.fromarray(still("tomas", 320)).save(tmp_path / "photo.jpg")
    state(tmp_path, consent=None)
    message, folder = check("places", tmp_path / "photo.jpg", tmp_path)
    assert message == ""
    found = json.loads((folder / PLACES).read_text())
    assert (found["size"], found["notes"]) == ([320, 320], [])
    assert set(found["fit"]) == {"lips", "right_eye", "left_eye", "teeth", "pivot"}
    with Image.open(folder / SHOWN) as shown:
        assert shown.size == (320, 320)


def test_a_photo_of_too_many_pixels_and_a_wrong_fit_are_refused(tmp_path: Path) -> None:
    Image.new("RGB", (320, 200)).save(tmp_path / "photo.png")
    for more, reason in (
        ({"max_pixels": 60_000}, "it has 320 x 200 pixels, more than 60000; reduce its size"),
        ({"fit": "{"}, "the fit, line 1: not JSON"),
        ({"fit": '{"lip": {}}'}, "the fit: there is no 'lip' here"),
    ):
        state(tmp_path, **more)
        message, checked = check("face", tmp_path / "photo.png", tmp_path)
        assert reason in message
        checked.rmdir()


def zip_bomb() -> bytes:
    """Archive of some kilobytes that unpacks to 600 MB."""
    return packed(("neutral.obj", bytes(600_000_000)))


def packed(*files: tuple[str, bytes]) -> bytes:
    """Archive of files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files:
            archive.writestr(name, content)
    return buffer.getvalue()


class Evil:
    """An object whose unpickling writes a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.path,)


def pickled_npz(path: Path) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, vertices=np.array([Evil(path)], object))
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("kind", "make", "reason"),
    [
        ("face", lambda path: zip_bomb(), "the archive unpacks to 1 files of 600 MB, more than 2000 files or 512 MB"),
        ("face", pickled_npz, "the archive holds no character (.glb, .gltf, .vrm, .obj), but vertices.npy"),
        ("face", lambda path: packed(("a.glb", b""), ("b/b.vrm", b"")), "several characters (a.glb, b/b.vrm); pack o"),
        ("face", lambda path: packed(("a/../../a.obj", b"v 0 0 0")), "a.obj has no faces; export the mesh"),
        ("face", lambda path: packed(("a/a.obj", b""), ("a/b.obj", b"")), "a has no neutral.obj; name the face at re"),
        ("face", lambda path: packed(("a.obj", b"v" * 999))[:-30], "the archive is damaged, locked or of an unknown c"),
        ("talker", pickled_npz, "it is a zip archive, not a .talker file"),
        ("palette", lambda path: pickle.dumps(Evil(path)), "it is a Python pickle, not a .palette file"),
        ("face", lambda path: b"", "it is not a .face file, or is truncated"),
        ("face", lambda path: (1 << 40).to_bytes(8, "little") + b"{}", "it is not a .face file, or is truncated"),
        ("palette", lambda path: b"\x89PNG\r\n\x1a\n" + bytes(100), "it is a picture, not a .palette file"),
        ("face", lambda path: b"glTF" + bytes(100), "it has no JSON chunk"),
        ("dictionary", lambda path: b"Siobhan\n", "line 1: 'Siobhan' has no pronunciation"),
        ("dictionary", lambda path: b"# nothing\n", "it has no word"),
        ("dictionary", lambda path: b"\x80\x04\xff", "is not UTF-8"),
        ("dictionary", lambda path: b"a /" + "ə".encode() * 10_000 + b"/", "a word has at most 40"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, kind: str, make: Callable[[Path], bytes], reason: str) -> None:
    (tmp_path / "given").write_bytes(make(tmp_path / "touched"))
    message, _ = check(kind, tmp_path / "given", tmp_path)
    assert reason in message
    assert not (tmp_path / "touched").exists()
    assert str(tmp_path) not in message


@pytest.mark.smoke
def test_another_kind_is_refused(files: dict[str, Path], tmp_path: Path) -> None:
    message, _ = check("palette", files["face"], tmp_path)
    assert message == "it is not a palette file; give one that tts2face wrote"


@pytest.mark.parametrize("kind", ["talker", "face", pytest.param("palette", marks=pytest.mark.smoke)])
def test_a_truncated_file_is_refused(files: dict[str, Path], tmp_path: Path, kind: str) -> None:
    (tmp_path / "given").write_bytes(files[kind].read_bytes()[:-100])
    message, _ = check(kind, tmp_path / "given", tmp_path)
    assert message == f"it is damaged or not a {kind} file; build or copy it again"


@pytest.mark.parametrize(("kind", "name"), [("talker", "mean"), ("face", "vertices"), ("palette", "neutral")])
def test_nan_is_refused(files: dict[str, Path], tmp_path: Path, kind: str, name: str) -> None:
    arrays, header = read_tensors(files[kind], kind, 1)
    arrays[name] = arrays[name].copy()
    arrays[name].flat[0] = np.nan
    text = json.dumps(header)
    (tmp_path / "given").write_bytes(save(arrays, {"kind": kind, "version": "1", "metadata": text}))
    message, _ = check(kind, tmp_path / "given", tmp_path)
    assert f"{name} holds nan; its numbers must be finite" in message


def test_a_face_that_unpacks_to_gigabytes_ends_its_process_only(files: dict[str, Path], tmp_path: Path) -> None:
    """Shapes that move nothing take no bytes of the file, but each takes those of all vertices when it is read."""
    arrays, header = read_tensors(files["face"], "face", 1)
    n = 90_000_000 // len(arrays["vertices"])
    moved = len(arrays["shape_counts"])
    header["shape_names"] += [f"s{number}" for number in range(n - moved)]
    for name, value in (("shape_counts", 0), ("shape_steps", 1e-9)):
        more = np.full(n - moved, value, arrays[name].dtype)
        arrays[name] = np.concatenate([arrays[name], more])
    arrays["limits"] = np.concatenate([arrays["limits"], np.zeros((n - moved, 2), np.float32)])
    write_tensors(tmp_path / "large.face", "face", 1, arrays, header)
    assert (tmp_path / "large.face").stat().st_size < 20e6
    message, _ = check("face", tmp_path / "large.face", tmp_path, is_limited=True)
    assert ("Traceback" in message, "memory" in message) == (False, True), message


@pytest.mark.smoke
def test_what_is_stored_has_a_limit(files: dict[str, Path], tmp_path: Path) -> None:
    message, _ = check("dictionary", files["dictionary"], tmp_path, most=20)
    assert message == "it has more than 2e-05 MB as a dictionary"
