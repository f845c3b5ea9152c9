"""Findings about single recordings: good ones have none, damaged ones name the measure and what to do."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.recordings.light import face_light, measure_light
from corpus_tools.recordings.limits import REFUSAL, WARNING, Finding, limit_findings
from corpus_tools.recordings.observe import RecordingChecker, check_recording, recordings_to_check
from corpus_tools.run_options import RunOptions
from lexicon.errors import InputError
from tests.corpus_tools.films import write_video
from tests.packages import package
from tests.rendered_takes import ONLY_RENDERED, transcript
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, FACE_OVAL
from tts2face.video.media import TimedFrame, read_frames, read_sound

Damage = Callable[[np.ndarray], np.ndarray]
cv2 = package("cv2")


def round_face(radius: float = 60.0) -> np.ndarray:
    """Landmarks of a round face in the middle of 200 x 200 pixels, its eyes 60 px apart."""
    points = np.full((478, 3), 100.0)
    angles = np.linspace(0, 2 * np.pi, len(FACE_OVAL), endpoint=False)
    points[list(FACE_OVAL), :2] = 100 + radius * np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    points[[EYE_OUTER_RIGHT, EYE_OUTER_LEFT], 0] = 70.0, 130.0
    return points


def stripes(dark: int, bright: int, width: int = 10) -> np.ndarray:
    """A grey picture of vertical stripes."""
    columns = np.where(np.arange(200) // width % 2, bright, dark).astype(np.uint8)
    return np.repeat(np.tile(columns, (200, 1))[:, :, None], 3, axis=2)


def test_light_of_stripes_is_known() -> None:
    brightness, contrast, glare, _ = face_light(stripes(50, 150), round_face())
    assert (brightness, contrast, glare) == (pytest.approx(100, abs=3), 100.0, 0.0)
    assert face_light(stripes(100, 255), round_face())[2] == pytest.approx(0.5, abs=0.03)


def test_sharpness_falls_with_blur_and_depends_neither_on_light_nor_on_size() -> None:
    picture = stripes(50, 150, width=100)  # one edge
    sharp = face_light(picture, round_face())[3]
    assert face_light(picture // 2, round_face())[3] == pytest.approx(sharp, rel=0.05)
    twice = face_light(np.repeat(np.repeat(picture, 2, axis=0), 2, axis=1), 2 * round_face())[3]
    assert twice == pytest.approx(sharp, rel=0.15)
    blurred = [face_light(cv2.GaussianBlur(picture, (0, 0), deviation), round_face())[3] for deviation in (2, 4)]
    assert sharp > 1.4 * blurred[0] > 1.4 * 1.4 * blurred[1]


def test_a_face_outside_the_picture_is_dark() -> None:
    assert face_light(stripes(50, 150), round_face() + 500) == (0.0, 0.0, 0.0, 0.0)


def test_light_is_measured_twice_a_second_where_there_is_a_face() -> None:
    times = np.arange(50) / 25
    points = np.tile(round_face().astype(np.float32), (50, 1, 1))
    points[:5] = np.nan
    frames = [TimedFrame(time, stripes(50, 150)) for time in times]
    assert measure_light(frames, points, times)[:, 0] == pytest.approx([0.2, 0.72, 1.24, 1.76])
    assert measure_light(frames, np.full_like(points, np.nan), times).shape == (0, 5)


def test_a_finding_has_the_value_and_the_limit_that_it_exceeds() -> None:
    (dark,) = limit_findings({"brightness": 30.0, "glare": 0.0, "sharpness": 0.04})
    assert dark == Finding(
        WARNING, "brightness",
        "the face is dark (brightness 30 of 255, limit 50); put a lamp or a window in front of you", 30.0, 50.0,
    )  # fmt: skip
    (lost,) = limit_findings({"brightness": 10.0})
    assert (lost.severity, lost.limit) == (REFUSAL, 15.0)


@pytest.fixture(scope="module")
def checker(tmp_path_factory: pytest.TempPathFactory, face_model: Path) -> RecordingChecker:
    return RecordingChecker(RunOptions(tmp_path_factory.mktemp("cache"), 1, face_model))


def damaged(take: Path, out: Path, damage: Damage) -> Path:
    pictures = [damage(frame.pixels) for frame in read_frames(take)]
    write_video(pictures, read_sound(take, 16_000).samples, out)
    return out


@ONLY_RENDERED
@pytest.mark.parametrize(
    ("name", "damage", "severity"),
    [
        ("brightness", lambda one: (one * 0.2).astype(np.uint8), WARNING),
        ("glare", lambda one: np.clip(one * 2.5, 0, 255).astype(np.uint8), REFUSAL),
        ("sharpness", lambda one: cv2.GaussianBlur(one, (0, 0), 4), WARNING),
        ("unusable", np.zeros_like, REFUSAL),
    ],
)
def test_damaged_pictures_are_found(
    takes: Path, checker: RecordingChecker, tmp_path: Path, name: str, damage: Damage, severity: str
) -> None:
    take = takes / "clips" / "bbaf2n.mkv"
    before = {finding.code for finding in checker.check(recordings_to_check(take, transcript("bbaf2n"))[0])}
    assert not before & {"brightness", "glare", "sharpness", "unusable"}
    film = damaged(take, tmp_path / "film.mp4", damage)
    found = {one.code: one for one in checker.check(recordings_to_check(film, transcript("bbaf2n"))[0])}
    assert found[name].severity == severity


@ONLY_RENDERED
def test_the_command_says_what_is_wrong_and_builds_nothing(
    takes: Path, tmp_path: Path, face_model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    take = takes / "clips" / "bbaf2n.mkv"
    dark = damaged(take, tmp_path / "dark.mp4", lambda one: (one * 0.2).astype(np.uint8))
    before = sorted(tmp_path.iterdir())
    flags = ["--cache", str(tmp_path / "cache"), "--model", str(face_model)]
    assert run(["corpus", "check", str(dark), "--text", transcript("bbaf2n"), *flags]) == 0
    assert "dark: warning: the face is dark (brightness " in capsys.readouterr().out
    assert sorted(path for path in tmp_path.iterdir() if path.name != "cache") == before
    findings = check_recording(dark, "My elephants remembered nothing.", run_options=RunOptions(tmp_path / "cache", 1))
    assert findings[0].severity == REFUSAL
    assert {"fit", "unusable"} & {finding.code for finding in findings}


def test_a_text_for_a_folder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["corpus", "check", str(tmp_path), "--text", "Hello."]) == 2
    assert "--text belongs to one video" in capsys.readouterr().err
    with pytest.raises(InputError, match="there is no folder"):
        check_recording(tmp_path / "none.mp4")
