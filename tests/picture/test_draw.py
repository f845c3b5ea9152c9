"""Pictures: the effect of each option, thread independence, merged samples against full supersampling."""

from dataclasses import fields, replace

import numpy as np
import pytest
from PIL import Image

from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.picture.tiny_face import tiny_face
from tts2face.models.face import keep_parts
from tts2face.models.face_loading import load_face
from tts2face.picture.kernels.tones import TONE_TABLES, linear_light
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw, mesh_renderer
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

pytestmark = pytest.mark.usefixtures("few_directions")
REST = np.zeros(4)
SMALL = Picture(size="96x80", background="#204060")
OTHERS = {
    "size": "80x96", "camera": "three-quarter", "background": "white", "supersampling": 1, "quality": "draft",
    "visible_mark": True,
}  # fmt: skip


def clip_of(face, n_frames, fps=25.0, rate=8000):
    steps = np.linspace(0, 1, n_frames)
    motion = np.column_stack([steps, 1 - steps, 0 * steps, 0 * steps])
    speech = Speech(
        Waveform(np.zeros(round(n_frames * rate / fps), np.float32), rate),
        PhoneSequence([SILENCE], [0, round(n_frames * rate / fps) / rate]),
        (),
    )
    head = np.column_stack([0.2 * steps] + [0 * steps] * 5)
    return Clip(Trajectory(face.shape_names, motion, fps), Trajectory(HEAD_CHANNELS, head, fps), speech)


@pytest.mark.parametrize("option", sorted(OTHERS))
def test_every_option_changes_the_picture(option):
    face = tiny_face()
    before, after = (
        draw(face, REST, picture=picture) for picture in (SMALL, replace(SMALL, **{option: OTHERS[option]}))
    )
    assert before.shape != after.shape or np.abs(before.astype(int) - after).max() > 10


def test_every_option_is_tested():
    assert {option.name for option in fields(Picture)} == set(OTHERS) | {"renderer"}  # of which there is one


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_bytes_do_not_depend_on_the_number_of_threads(threads):
    face = tiny_face()
    clip = clip_of(face, 7)
    renderer = mesh_renderer(face, SMALL)
    one_by_one = [renderer.draw(*pose) for pose in zip(clip.motion.values, clip.head.values, strict=True)]
    together = list(renderer.frames(clip, threads=threads))
    assert len(together) == 7
    assert all(np.array_equal(a, b) for a, b in zip(one_by_one, together, strict=True))


@pytest.mark.parametrize("textured", [False, True])
def test_merged_samples_equal_samples_shaded_one_by_one(textured):
    face = tiny_face(textured=textured, n_rings=30)
    joined = draw(face, REST, picture=Picture(size="100x100", supersampling=3)).astype(float)
    single = draw(face, REST, picture=Picture(size="300x300", supersampling=1))
    light = linear_light(single).reshape(100, 3, 100, 3, 3).mean(axis=(1, 3))
    srgb = 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(joined - srgb).mean() <= 2


def test_a_colour_background_and_a_transparent_one():
    face = tiny_face()
    assert tuple(draw(face, REST, picture=replace(SMALL, background="#204060"))[0, 0]) == (0x20, 0x40, 0x60)
    clear = draw(face, REST, picture=replace(SMALL, background="transparent"))
    assert clear.shape == (80, 96, 4)
    assert clear[0, 0, 3] == 0
    assert clear[40, 48, 3] == 255
    assert 0 < ((clear[:, :, 3] > 0) & (clear[:, :, 3] < 255)).mean() < 0.2  # the outline


def test_a_transparent_picture_laid_over_a_colour_is_the_picture_on_that_colour():
    face = tiny_face()
    solid = draw(face, REST, picture=replace(SMALL, background="#204060"))
    clear = draw(face, REST, picture=replace(SMALL, background="transparent"))
    table = TONE_TABLES[0]
    share = clear[:, :, 3:] / 255
    light = table[clear[:, :, :3]] * share + table[np.array([0x20, 0x40, 0x60])] * (1 - share)
    srgb = 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(srgb - solid).max() <= 3  # 8-bit coverage


@pytest.mark.parametrize("yaw", [0.0, 0.5])
def test_coverage_is_the_share_of_samples_that_the_head_covers(yaw):
    face = keep_parts(load_face("head", hair="bald"), lambda part: part.kind != "strands")  # blended by their area
    pose = np.zeros(len(face.shape_names)), np.array([0, yaw, 0, 0, 0, 0])
    joined = draw(face, *pose, picture=Picture(size="96x96", supersampling=3, background="transparent"))
    single = draw(face, *pose, picture=Picture(size="288x288", supersampling=1, background="transparent"))
    covered = (single[:, :, 3] / 255).reshape(96, 3, 96, 3).mean(axis=(1, 3))
    assert np.abs(joined[:, :, 3] / 255 - covered).max() <= 0.002  # half a level of 255


def test_an_image_background_fills_the_picture(tmp_path):
    Image.new("RGB", (40, 10), (10, 200, 30)).save(tmp_path / "wall.png")
    drawn = draw(tiny_face(), REST, picture=replace(SMALL, background=str(tmp_path / "wall.png")))
    for corner in (drawn[0, 0], drawn[-1, 0], drawn[0, -1]):
        assert tuple(corner) == (10, 200, 30)


def test_a_file_that_is_no_image_is_refused(tmp_path):
    (tmp_path / "wall.png").write_bytes(b"no picture")
    with pytest.raises(DataError, match="cannot read the background image"):
        draw(tiny_face(), REST, picture=replace(SMALL, background=str(tmp_path / "wall.png")))


@pytest.mark.parametrize("size", ["96x96", "160x90", "90x160", "16x16"])
@pytest.mark.parametrize("camera", ["front", "three-quarter", "profile"])
def test_the_head_is_framed_in_every_format(size, camera):
    drawn = draw(tiny_face(), REST, picture=Picture(size=size, camera=camera, background="transparent"))
    covered = np.argwhere(drawn[:, :, 3] > 127)
    height, width = drawn.shape[:2]
    top, left = covered.min(axis=0)
    right = covered[:, 1].max()
    assert top > 0
    assert left > 0
    assert right < width - 1
    assert max(len(np.unique(covered[:, 0])) / height, (right - left) / width) > 0.5


def test_a_nearer_camera_shows_a_larger_head():
    far, near = (
        (
            draw(tiny_face(), REST, picture=replace(SMALL, camera=f"0,0,{mm}", background="transparent"))[:, :, 3] > 0
        ).sum()
        for mm in (2000, 900)
    )
    assert near > 2 * far


def test_a_camera_inside_the_head_draws_the_surface_in_front():
    drawn = draw(tiny_face(), REST, picture=replace(SMALL, camera="0,0,50"))
    assert np.ptp(drawn.reshape(-1, 3).astype(int), axis=0).max() > 0


def test_translucent_lashes_are_blended_with_the_surface_below():
    face = tiny_face()
    solid = replace(face, parts=(*face.parts[:-1], replace(face.parts[-1], opacity=1.0)))
    removed = replace(face, triangles=np.concatenate([face.triangles[:-2], np.zeros((2, 3), np.int32)]))
    through, full, none = (draw(f, REST, picture=SMALL).astype(float) for f in (face, solid, removed))
    changed = np.abs(full - none).max(axis=2) > 40
    assert changed.any()
    assert (np.abs(through - none)[changed].mean(axis=-1) > 5).all()
    assert (np.abs(through - full)[changed].mean(axis=-1) > 5).mean() > 0.9


def test_an_open_mouth_and_turned_eyes_change_the_picture():
    face = tiny_face()
    rest, moved = (draw(face, weights, picture=SMALL).astype(int) for weights in (REST, np.array([1.0, 0, 1, 1])))
    assert np.abs(rest - moved).max() > 60


def test_motion_of_another_face_is_refused():
    face = tiny_face()
    other = replace(clip_of(face, 2), motion=Trajectory(("a", "b"), np.zeros((2, 2)), 25.0))
    with pytest.raises(InputError, match="not in the shapes of this face"):
        next(mesh_renderer(face, SMALL).frames(other))
    with pytest.raises(InputError, match="4 shapes, not weights"):
        draw(face, np.zeros(3))
