"""Cameras; a video at its own frame rate replaces one."""

import time
from pathlib import Path

import pytest

from lexicon.errors import InputError
from tests.packages import needs
from tts2face.video import camera as camera_module
from tts2face.video.camera import CaptureDevice

needs("cv2")


class ClockOfPictures:
    """A clock that goes on when the picture before has been taken, however fast the machine is."""

    def __init__(self) -> None:
        self.camera: CaptureDevice | None = None
        self._now = 100.0

    def monotonic(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        while self.camera is not None and self.camera._newest is not None and not self.camera._ended:
            time.sleep(0.001)
        self._now += seconds


def test_pictures_come_as_they_are_filmed_and_end_with_the_film(make_video, monkeypatch) -> None:
    clock = ClockOfPictures()
    monkeypatch.setattr(camera_module, "time", clock)
    clock.camera = CaptureDevice(str(make_video("grey.mkv", n_frames=10, fps=25, tone_s=0.4)))
    with clock.camera as camera:
        pictures = list(camera.pictures())
    assert camera.fps == 25.0
    assert [picture.time for picture in pictures] == pytest.approx([number / 25 for number in range(1, 11)])
    levels = [picture.pixels.mean() for picture in pictures]
    assert levels == pytest.approx([20 + 4 * number for number in range(10)], abs=3)


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
