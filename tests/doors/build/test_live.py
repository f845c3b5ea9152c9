"""A person before a camera: what the head does now is what the whole take, read afterwards, makes of it."""

from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from tests.corpus_tools.films import join_clips
from tts2face.lips.performer import build_performer_retargeter
from tts2face.models.face_loading import load_face
from tts2face.session.live_capture import CALIBRATION_S, LiveCapture, LivePose, track_poses
from tts2face.video.blendshapes import BlendshapeReader
from tts2face.video.media import TimedFrame, read_frames
from tts2face.video.streaming import StreamingTracker
from tts2face.video.take import read_take
from tts2face.video.tracking import FaceTracker

FPS = 25.0


@pytest.fixture(scope="module")
def recording(shared_recordings: Path, face_model: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    clips = sorted((shared_recordings / "grid_s1" / "clips").iterdir())[:4]
    out = tmp_path_factory.mktemp("film") / "person.mp4"
    join_clips(clips, out)
    return out


@pytest.fixture(scope="module")
def live(recording: Path, face_model: Path) -> list[LivePose | None]:
    return list(
        track_poses(
            read_frames(recording), load_face("head"), FaceTracker(face_model), BlendshapeReader(face_model), FPS
        )
    )


def test_live_capture_calibrates_and_then_follows_the_person(
    live: list[LivePose | None], recording: Path, face_model: Path
) -> None:
    """Compared with the take read as a whole, which includes later frames."""
    head = load_face("head")
    learnt = round(CALIBRATION_S * FPS)
    assert all(pose is None for pose in live[:learnt])
    followed = live[learnt + 1 :]
    assert all(pose is not None for pose in followed)
    take = read_take(recording, StreamingTracker(face_model), BlendshapeReader(face_model))
    weights_of_take = build_performer_retargeter(take.landmarks, take.scores, head).weights(take.landmarks, take.scores)
    weights = np.array([pose.weights for pose in followed if pose is not None])
    whole = weights_of_take.values[learnt + 1 : learnt + 1 + len(weights)]
    for shape, least in (("jawOpen", 0.9), ("eyeBlinkLeft", 0.9), ("mouthPucker", 0.7)):
        column = head.shape_names.index(shape)
        assert np.corrcoef(weights[:, column], whole[:, column])[0, 1] > least, shape
    assert (weights >= head.limits[:, 0] - 1e-6).all()
    assert (weights <= head.limits[:, 1] + 1e-6).all()


def test_without_a_face_the_head_waits(face_model: Path) -> None:
    blank = [TimedFrame(number / FPS, np.full((64, 64, 3), 90, np.uint8)) for number in range(5)]
    found = list(track_poses(blank, load_face("head"), FaceTracker(face_model), BlendshapeReader(face_model), FPS))
    assert found == [None] * 5


def test_an_actor_gives_each_pose_once(recording: Path, face_model: Path) -> None:
    with LiveCapture(read_frames(recording), load_face("head"), FPS, face_model) as actor:
        actor._thread.join()
        now = actor.latest_pose()
        assert now is not None
        assert now[0].shape == (len(load_face("head").shape_names),)
        assert now[1].shape == (6,)
        assert actor.latest_pose() is None


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["take.mp4", "--camera", "0"], "--camera cannot be combined with a take, --out"),
        (["--camera", "0", "--out", "m.mp4"], "--camera cannot be combined with a take, --out"),
        (["--camera", "0", "--face", "self"], "--out, --export or --face self; remove them"),
        ([], "add a take and --out, or use --camera"),
        (["take.mp4"], "add a take and --out, or use --camera"),
    ],
)
def test_orders_that_make_no_sense(words: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mimic", *words]) == 2
    assert reason in capsys.readouterr().err


def test_without_a_display_the_message_names_the_cause(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tts2face.picture.display.sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert run(["mimic", "--camera", "0"]) == 4
    assert "--camera opens a window, and this machine has no display" in capsys.readouterr().err
