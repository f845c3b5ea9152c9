"""A picture of the shipped head, with the landmarks that it has there, speaks: at rest it is the picture itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from lexicon.errors import InputError
from tests.interchange.exports.test_stage_glb import Read
from tests.photo.pictures import ONE_PROCESS, drawn, found_in, speaking, still, weights_of
from tts2face.face.deformation import REST_HEAD
from tts2face.face.landmarks import moved_landmarks
from tts2face.interchange.exports.stage_glb import stage_glb
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import inner_lip_gaps, lip_opening
from tts2face.models.light import Photographed
from tts2face.photo.found_face import FoundFace
from tts2face.photo.photograph import Photograph, split_number
from tts2face.photo.surface import EYES, LASHES, LID_OVER_EYE, LIDS, SKIN
from tts2face.picture.baked.scene import BEHIND_SHARE
from tts2face.picture.baked.visibility import NEAR, TRIANGLE_MASK, nearest_triangles, project
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer
from tts2face.session.session import Session

pytestmark = [pytest.mark.usefixtures("drafted"), ONE_PROCESS]

SIDE = 400
NAME = "head"
LEAST_TEETH = 60  # samples, of a mouth of 130 samples
MOST_FOLDED = 10  # triangles, at the corners of shut lids
PANGRAM = "We were away a year ago, but Bob may move five big maps."
BLINK = {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}


@pytest.fixture(scope="module")
def pixels() -> np.ndarray:
    return still(NAME, SIDE)


@pytest.fixture(scope="module")
def face(pixels: np.ndarray) -> Face:
    return speaking(Photograph(pixels, None, 1.0), found_in(NAME, SIDE))


@pytest.fixture(scope="module")
def renderer(face: Face) -> MeshRenderer:
    return mesh_renderer(face, Picture())


def samples_of_parts(renderer: MeshRenderer, **weights: float) -> dict[str, int]:
    """Samples in which each part of a face is seen."""
    scene = renderer.scene
    table = scene.surface.template.copy()
    optics = (scene.optics.view.astype(np.float32), scene.optics.lens.astype(np.float32))
    project(scene.pose(weights_of(scene.face, **weights), REST_HEAD), scene.surface.source, *optics, table)
    table[scene.surface.behind, NEAR] *= BEHIND_SHARE
    nearest, _, _ = nearest_triangles(table, scene.surface.triangles, (2 * SIDE, 2 * SIDE))
    seen = (nearest[nearest > 0] & TRIANGLE_MASK) - 1
    names = np.repeat([part.name for part in scene.face.parts], [part.count for part in scene.face.parts])
    shown, counts = np.unique(names[scene.surface.light.triangle_numbers[seen]], return_counts=True)
    return dict(zip(shown.tolist(), counts.tolist(), strict=True))


def test_at_rest_it_is_the_picture(renderer: MeshRenderer, pixels: np.ndarray) -> None:
    shown = drawn(renderer)
    assert shown.shape == pixels.shape
    apart = np.abs(shown.astype(int) - pixels).max(axis=2)
    assert np.median(apart) == 0
    assert np.percentile(apart, 99) <= 6
    assert apart.max() < 90  # at the line between the lips and at the rims of the eyes


def test_what_does_not_move_is_the_picture_in_every_frame(renderer: MeshRenderer, pixels: np.ndarray) -> None:
    shown = drawn(renderer, np.array([0.05, 0.1, 0.03, 0, 0, 0], np.float32), jawOpen=0.5, browInnerUp=0.5)
    corners = [np.s_[:20, :20], np.s_[:20, -20:]]
    for corner in corners:
        np.testing.assert_array_equal(shown[corner], pixels[corner])
    assert np.abs(shown.astype(int) - pixels).max() > 60


def test_shapes_move_the_skin_without_folds(face: Face) -> None:
    view = face.light.view.view
    triangles = face.triangles[: next(part for part in face.parts if part.name == SKIN).count]

    def areas(points: np.ndarray) -> np.ndarray:
        seen = points @ view[:, :3].T + view[:, 3]
        places = seen[:, :2] / seen[:, 2:] * face.light.view.lens[0]
        a, b, c = (places[triangles[:, k]] for k in range(3))
        first, second = b - a, c - a
        return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]

    ahead = areas(face.vertices.astype(float)) < 0
    assert ahead.mean() > 0.995
    for name, shape in zip(face.shape_names, face.shapes, strict=True):
        turned = areas(face.vertices.astype(float) + shape)[ahead]
        assert (turned > 0.5).sum() <= MOST_FOLDED, name


def test_lids_cover_the_eyes(renderer: MeshRenderer) -> None:
    open_eyes, shut = samples_of_parts(renderer), samples_of_parts(renderer, **BLINK)
    assert not {LASHES, LID_OVER_EYE} & set(open_eyes)
    assert open_eyes.get(LIDS, 0) < 0.01 * open_eyes[EYES]  # in the corners of the eyes
    assert shut.get(EYES, 0) < 0.01 * open_eyes[EYES]
    assert shut[LID_OVER_EYE] > 0.2 * open_eyes[EYES]
    assert min(shut[LIDS], shut[LASHES]) > 0.1 * open_eyes[EYES]
    half = samples_of_parts(renderer, eyeBlinkLeft=0.5, eyeBlinkRight=0.5)
    assert 0.3 < half[EYES] / open_eyes[EYES] < 0.7


def test_the_inside_of_the_mouth_is_seen_through_parted_lips_alone(renderer: MeshRenderer) -> None:
    inside = ("teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue", "walls")
    shut, opened = samples_of_parts(renderer), samples_of_parts(renderer, jawOpen=0.6)
    assert sum(shut.get(name, 0) for name in inside) == 0
    assert min(opened.get(name, 0) for name in ("teeth_upper", "tongue", "walls")) > 20


def test_upper_teeth_lie_on_the_lip_of_each_f_and_v(face: Face) -> None:
    session = Session(face=face)
    clip, renderer = session.clip("Five vivid foxes have fine fur."), session.renderer(Picture())
    phones, rate = clip.speech.phones, clip.fps
    spans = zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True)
    frames = [range(round(begin * rate), round(end * rate) + 1) for phone, begin, end in spans if phone in ("f", "v")]
    assert len(frames) == 8
    for span in frames:
        poses = [dict(zip(clip.motion.channels, clip.motion.values[k].tolist(), strict=True)) for k in span]
        assert any(samples_of_parts(renderer, **pose).get("teeth_upper", 0) > LEAST_TEETH for pose in poses)


def test_gaze_moves_the_iris_and_not_the_lids(renderer: MeshRenderer) -> None:
    ahead, aside = drawn(renderer), drawn(renderer, eyeLookOutLeft=0.6, eyeLookInRight=0.6)
    changed = np.abs(ahead.astype(int) - aside).max(axis=2) > 8
    rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
    assert len(rows) < 0.1 * SIDE
    assert 0.1 * SIDE < len(columns) < 0.4 * SIDE


def test_lips_of_speech_close_and_open_as_those_of_the_head(face: Face) -> None:
    clip, wanted = (Session(face=one).clip(PANGRAM, gestures="none") for one in (face, "head"))
    landmarks = [moved_landmarks(one, shown.motion) for one, shown in ((face, clip), (load_face("head"), wanted))]
    openings = [lip_opening(points) for points in landmarks]
    assert np.corrcoef(*openings)[0, 1] > 0.98
    gaps = inner_lip_gaps(landmarks[0])[:, 1:-1].max(axis=1)
    phones = clip.speech.phones
    for phone, begin, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        if phone in ("p", "b", "m"):
            frames = gaps[int(begin * clip.fps) : int(np.ceil(end * clip.fps)) + 1]
            assert frames.min() < 0.05, (phone, begin)


def test_a_file_keeps_the_face(face: Face, renderer: MeshRenderer, tmp_path: Path) -> None:
    path = tmp_path / "me.face"
    write_face(path, face)
    assert path.stat().st_size < 2_000_000
    kept = read_face(path)
    assert kept.metadata == face.metadata
    assert "photograph of Ada" in kept.mark.notice
    pose = {"jawOpen": 0.4, "eyeBlinkLeft": 0.5, "mouthSmileLeft": 0.3}
    again = mesh_renderer(kept, Picture())
    apart = np.abs(drawn(again, **pose).astype(int) - drawn(renderer, **pose))
    assert apart.mean() < 1.5  # pages are JPEG in files


def test_a_picture_is_seen_from_where_it_was_taken(face: Face, renderer: MeshRenderer) -> None:
    assert (renderer.picture.width, renderer.picture.height) == (SIDE, SIDE)
    wide = mesh_renderer(face, Picture(size="320x180"))
    assert wide.draw(weights_of(face)).shape == (180, 320, 3)
    near = mesh_renderer(face, Picture(size="200x200", camera="close")).scene.optics
    far = mesh_renderer(face, Picture(size="200x200")).scene.optics
    assert near.lens[0] > 1.2 * far.lens[0]
    for camera in ("profile", "three-quarter", "20,0"):
        with pytest.raises(InputError, match="a photograph is seen from where it was taken; choose the camera front"):
            mesh_renderer(face, Picture(camera=camera))


def test_a_background_that_is_joined_to_the_person_stays(face: Face) -> None:
    for background in ("transparent", "red", "blur"):
        with pytest.raises(InputError, match="the person in the photograph was not told from its background"):
            mesh_renderer(face, Picture(background=background))


def test_the_head_moves_within_what_the_picture_bears(face: Face) -> None:
    view = face.light.view
    small, large = (view.bearable(np.array([0, yaw, 0, 4, 4, 9], float)) for yaw in (0.05, 1.0))
    assert 0.5 * 0.05 < small[1] < 0.05
    assert large[1] <= np.radians(9)
    assert small[5] == 0
    assert 0 < small[3] < 4


def placed(side: int, corner: tuple[int, int], size: tuple[int, int]) -> tuple[Photograph, FoundFace]:
    """A picture of a size in which the head has a side, with its left top corner at a place."""
    across, down = corner
    pixels = np.full((size[1], size[0], 3), (120, 130, 140), np.uint8)
    shown = still(NAME, side)
    rows, columns = slice(max(down, 0), down + side), slice(max(across, 0), across + side)
    pixels[rows, columns] = shown[max(-down, 0) :, max(-across, 0) :][: size[1] - rows.start, : size[0] - columns.start]
    found = found_in(NAME, side)
    return Photograph(pixels, None, 1.0), replace(found, landmarks=found.landmarks + np.array([across, down, 0]))


@pytest.mark.parametrize(
    ("side", "corner", "size"),
    [
        (100, (567, 300), (1280, 720)),  # a small face in a large picture
        (300, (-70, 20), (401, 351)),  # cut by the edge, in a picture of odd sides
        (64, (0, 0), (64, 64)),
    ],
)
def test_faces_anywhere_in_pictures_of_any_size_are_kept(
    side: int, corner: tuple[int, int], size: tuple[int, int], tmp_path: Path
) -> None:
    picture, found = placed(side, corner, size)
    made = speaking(picture, found)
    assert len(made.vertices) < 20_000
    write_face(tmp_path / "me.face", made)
    kept = read_face(tmp_path / "me.face")
    shown = drawn(mesh_renderer(kept, Picture()))
    even = [length - length % 2 for length in size]
    assert shown.shape == (even[1], even[0], 3)
    apart = np.abs(shown.astype(int) - picture.pixels[: even[1], : even[0]])
    assert np.median(apart) <= 1  # pages are JPEG in files
    assert apart.mean() < 3


def test_pictures_do_not_depend_on_the_number_of_threads(face: Face) -> None:
    session = Session(face=face)
    clip = session.clip("Hello.", fps=10)
    one, three = (
        np.array(list(session.renderer(Picture(size="128x128")).frames(clip, threads=threads))) for threads in (1, 3)
    )
    np.testing.assert_array_equal(one, three)


def test_an_export_shows_the_picture(face: Face, tmp_path: Path) -> None:
    session = Session(face=face)
    session.export("Hi.", [str(tmp_path / "clip.glb")])
    content = (tmp_path / "clip.glb").read_bytes()
    assert content.count(b"\xff\xd8\xff") == 2  # the picture and its eyes
    assert b"photograph of Ada" in content
    assert b"".join(chunk.content for chunk in session.stream_file("Hi.", "glb")) == content


def test_one_of_several_faces_is_named_after_the_file(tmp_path: Path) -> None:
    path = tmp_path / "me.jpg"
    path.touch()
    assert split_number(path) == (path, 1)
    assert split_number(f"{path}@2") == (path, 2)
    assert split_number(f"{tmp_path}/./me.jpg@2") == (path, 2)
    odd = tmp_path / "me@2"
    odd.touch()
    assert split_number(odd) == (odd, 1)
    with pytest.raises(InputError, match=r"there is no photo .*nobody"):
        split_number(tmp_path / "nobody.jpg")


def test_the_stage_shows_it_as_the_picture_does(face: Face) -> None:
    view = face.light.view
    angle = np.radians(12)
    roll = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    turned = replace(view, view=np.column_stack([roll @ view.view[:, :3], view.view[:, 3]]))
    leaning = replace(face, light=Photographed(face.light.baked, turned))
    made = Read(stage_glb(leaning, leaning.shape_names))
    seen = leaning.vertices @ leaning.light.view.view[:, :3].T + leaning.light.view.view[:, 3]
    expected = seen[:, :2] / seen[:, 2:]
    primitives, materials = made.json["meshes"][0]["primitives"], made.json["materials"]
    for primitive, material in zip(primitives, materials, strict=True):
        places = 1000 * made.accessor(primitive["attributes"]["POSITION"])
        shown = places[:, :2] * (1, -1) / (view.view[2, 3] - places[:, 2:])
        apart, _ = cKDTree(expected).query(shown)
        assert apart.max() < 1e-6
        assert material["extras"]["unlit"]
        assert material["extras"]["behind"] == (material["name"] not in (SKIN, LIDS, LASHES))
    stage = made.json["asset"]["extras"]
    assert list(stage["views"]) == ["front", "close"]
    assert stage["photo"]["gain"] == pytest.approx(leaning.light.view.head_gain)
    low, high = np.array(stage["frame"])
    assert ((high - low)[:2] > 0.2).all()  # metres: a head with some of what is around it
    assert ((high - low)[:2] < 0.5).all()
