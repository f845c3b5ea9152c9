"""Cameras; a video at its own frame rate replaces one."""

import time
from pathlib import Path

import pytest

from lexicon.errors import InputError
from tests.packages import needs
from tts2face.video.camera import CaptureDevice

needs("cv2")


def test_pictures_come_as_they_are_filmed_and_end_with_the_film(make_video) -> None:
    with CaptureDevice(str(make_video("grey.mkv", n_frames=10, fps=25, tone_s=0.4))) as camera:
        pictures = list(camera.pictures())
    assert camera.fps == 25.0
    assert 2 <= len(pictures) <= 10  # a busy machine gets fewer, the newest each time
    assert [picture.time for picture in pictures] == sorted(picture.time for picture in pictures)
    levels = [picture.pixels.mean() for picture in pictures]
    assert levels == sorted(levels)
    assert levels[-1] == pytest.approx(56, abs=3)


def test_who_is_slow_gets_the_newest_picture(make_video) -> None:
    with CaptureDevice(str(make_video("grey.mkv", n_frames=25, fps=25, tone_s=1.0))) as camera:
        pictures = camera.pictures()
        first = next(pictures)
        time.sleep(0.5)
        second = next(pictures)
    assert second.pixels.mean() > first.pixels.mean() + 4 * 5  # five pictures later at least


def test_leaving_early_lets_the_camera_go(make_video) -> None:
    with CaptureDevice(str(make_video("grey.mkv", n_frames=25, fps=25, tone_s=1.0))) as camera:
        next(camera.pictures())
    assert not camera._thread.is_alive()


def test_a_missing_camera_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no camera '97'"):
        CaptureDevice("97")
    with pytest.raises(InputError, match="give a camera's number"):
        CaptureDevice(str(tmp_path / "none.mp4"))
