"""Validation of the drawing options, and exact frame rates."""

import pytest

from lexicon.errors import InputError
from tts2face.picture.camera_view import NAMED_VIEWS, parse_camera
from tts2face.picture.options import Picture, parse_background, parse_size
from tts2face.types import exact_rate, first_sample


@pytest.mark.parametrize("size", ["15x16", "16x15", "4098x16", "17x32", "0x0", "14"])
def test_sizes_out_of_range_are_refused(size):
    with pytest.raises(InputError, match="even numbers from 16 to 4096"):
        Picture(size=size)


@pytest.mark.parametrize("size", ["", "big", "512x", "x512", "-512x512", "5.5x6", "1x2x3"])
def test_texts_that_are_no_size_are_refused(size):
    with pytest.raises(InputError, match="width x height"):
        Picture(size=size)


def test_sizes_are_read():
    assert parse_size("640x480") == (640, 480)
    assert parse_size(" 1280 X 720 ") == (1280, 720)
    assert parse_size("256") == (256, 256)
    assert parse_size("auto") == (512, 512)


@pytest.mark.parametrize("camera", ["top", "", "1", "1,2,3,4", "nan,0", "inf,0,900", "a,b"])
def test_unknown_cameras_are_refused(camera):
    with pytest.raises(InputError, match="there is no camera"):
        Picture(camera=camera)


@pytest.mark.parametrize("camera", ["181,0", "0,86", "0,0,49", "0,0,100001"])
def test_cameras_out_of_range_are_refused(camera):
    with pytest.raises(InputError, match="out of range"):
        Picture(camera=camera)


def test_cameras_are_read():
    assert parse_camera("front") is NAMED_VIEWS["front"]
    assert parse_camera("20,-5,900").distance == 900
    assert parse_camera("-20,5").yaw_deg == -20


@pytest.mark.parametrize("background", ["mauvish", "#12345", "12345g", "", "wall.txt"])
def test_unknown_backgrounds_are_refused(background):
    with pytest.raises(InputError, match="there is no background"):
        Picture(background=background)


def test_a_missing_image_is_refused(tmp_path):
    with pytest.raises(InputError, match="no background image"):
        Picture(background=str(tmp_path / "wall.png"))


def test_backgrounds_are_read():
    assert parse_background("white") == (255, 255, 255)
    assert parse_background("#1a2B3c") == (0x1A, 0x2B, 0x3C)
    assert parse_background("f08") == (0xFF, 0x00, 0x88)
    assert parse_background("studio") == "studio"


@pytest.mark.parametrize("supersampling", [0, 4, -1])
def test_supersampling_out_of_range_is_refused(supersampling):
    with pytest.raises(InputError, match="must be 1, 2 or 3"):
        Picture(supersampling=supersampling)


@pytest.mark.parametrize("name", ["gl", "pyvista"])
def test_another_renderer_is_refused(name):
    with pytest.raises(InputError, match=f"no renderer '{name}'; numba draws every picture: remove --renderer"):
        Picture(renderer=name)


@pytest.mark.parametrize(
    ("fps", "exact"),
    [(23.976, (24000, 1001)), (29.97, (30000, 1001)), (59.94, (60000, 1001)), (119.88, (120000, 1001)),
     (30, (30, 1)), (24, (24, 1)), (12.5, (25, 2)), (1, (1, 1)), (120, (120, 1))],
)  # fmt: skip
def test_rates_are_exact_fractions(fps, exact):
    assert exact_rate(fps).as_integer_ratio() == exact


@pytest.mark.parametrize("fps", [0.5, 121, -30, float("nan")])
def test_rates_out_of_range_are_refused(fps):
    with pytest.raises(InputError, match="fps must lie between 1 and 120"):
        exact_rate(fps)


def test_frames_and_samples_stay_together_for_hours():
    rate = exact_rate(29.97)
    n_frames = 10 * 3600 * 30000 // 1001
    assert abs(first_sample(n_frames, 24000, rate) / 24000 - n_frames * 1001 / 30000) < 1 / 24000
