"""Gestures from API and command line: styles, timelines, palettes, and constraints that always hold."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.decomposition.derived_styles import read_derived_styles
from lexicon.errors import InputError
from tests.made_models import made_style
from tests.tones import VOICE
from tests.world import World
from tts2face.face.gestures import gesture_face
from tts2face.face.landmarks import moved_landmarks
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.palette import FEATURES
from tts2face.models.palette_file import load_palette, write_palette
from tts2face.request import GAZES, Request
from tts2face.session.session import Session
from tts2face.storage.shipped import SHIPPED_FOLDER
from tts2face.types import Clip

TEXT = "Bob may move five big maps, but we keep two."
SMALL = ["--size", "64x64", "--fps", "5", "--quiet"]
MOODS = (*read_derived_styles("grid_s1"),)  # neutral first
SHAPES = {"brows": ("brows",), "cheeks": ("cheeks",), "blink": ("eyeBlink",), "gaze": ("eyeLook",)}


@pytest.fixture(scope="module")
def session(shipped: Session) -> Session:
    """What is shipped is judged; the rest runs on the made world."""
    return shipped


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("head")


@pytest.fixture(scope="module")
def with_gestures(session: Session) -> Clip:
    return session.clip(Request(text=TEXT))


@pytest.fixture(scope="module")
def without_gestures(session: Session) -> Clip:
    """Speech without gestures."""
    return session.clip(Request(text=TEXT, gestures="none"))


def channels_of(clip: Clip, begins: tuple[str, ...]) -> np.ndarray:
    return clip.motion.values[:, [name.startswith(begins) for name in clip.motion.channels]]


def test_every_feature_moves(with_gestures: Clip) -> None:
    for feature, begins in SHAPES.items():
        assert np.ptp(channels_of(with_gestures, begins), axis=0).max() > 0.05, feature
    assert np.degrees(np.ptp(with_gestures.head.values[:, :3], axis=0)).max() > 0.5


def test_a_layer_of_its_own_changes_no_other(with_gestures: Clip, session: Session) -> None:
    still = session.clip(Request(text=TEXT, gain="brows=0"))
    assert not channels_of(still, ("brows",)).any()
    others = [not name.startswith("brows") for name in with_gestures.motion.channels]
    np.testing.assert_array_equal(still.motion.values[:, others], with_gestures.motion.values[:, others])
    np.testing.assert_array_equal(still.head.values, with_gestures.head.values)


def test_the_starter_palette_has_the_moods_of_the_paper_and_its_provenance() -> None:
    palette = load_palette("starter")
    assert palette.names == (*MOODS, "grid_s1", "measured")
    measured = palette.styles["grid_s1"]
    assert measured.seconds == pytest.approx(40 * 60, rel=0.02)
    assert set(measured.motion) == set(FEATURES)
    assert "CC BY 4.0" in measured.metadata["licence"] or "Attribution 4.0" in measured.metadata["licence"]
    assert all(palette.derivations[mood].summary.startswith("derived from grid_s1") for mood in MOODS)


@pytest.mark.parametrize("style", MOODS[1:])
def test_lips_that_meet_still_meet_in_every_mood(
    style: str, without_gestures: Clip, session: Session, face: Face
) -> None:
    made = session.clip(Request(text=TEXT, style=style, plain_delivery=True))
    shown = gesture_face(face, load_palette("starter")).face
    before, after = lip_gap(face, without_gestures), lip_gap(shown, made)
    touching = before < 0.3
    assert touching.sum() > 5
    assert (after[touching] - before[touching]).max() < 0.1  # mm
    assert after.min() > min(before.min(), 0.0) - 0.1  # lips overlap no more than in lip motion alone


def test_measured_gestures_leave_lips_as_they_are(without_gestures: Clip, session: Session, face: Face) -> None:
    measured = session.clip(Request(text=TEXT, style="measured"))
    shown = gesture_face(face, load_palette("starter")).face
    assert np.corrcoef(lip_gap(face, without_gestures), lip_gap(shown, measured))[0, 1] > 0.995
    assert np.corrcoef(lip_width(face, without_gestures), lip_width(shown, measured))[0, 1] > 0.99


@pytest.mark.parametrize(("style", "least"), [("neutral", 0.95), ("delighted", 0.85)])
def test_a_smile_keeps_the_articulation(
    style: str, least: float, without_gestures: Clip, session: Session, face: Face
) -> None:
    smiling = session.clip(Request(text=TEXT, style=style, plain_delivery=True))
    shown = gesture_face(face, load_palette("starter")).face
    assert np.corrcoef(lip_gap(face, without_gestures), lip_gap(shown, smiling))[0, 1] > 0.995
    before, after = (without_slow_part(lip_width(*pair)) for pair in ((face, without_gestures), (shown, smiling)))
    assert np.corrcoef(before, after)[0, 1] > least
    assert after.std() > before.std()


def without_slow_part(values: np.ndarray) -> np.ndarray:
    """Values less their mean of 41 frames, which changes with the mood."""
    return values - np.convolve(np.pad(values, 20, mode="edge"), np.ones(41) / 41, "valid")


def lip_gap(face: Face, clip: Clip) -> np.ndarray:
    points = moved_landmarks(face, clip.motion)
    return points[:, 13, 1] - points[:, 14, 1]


def lip_width(face: Face, clip: Clip) -> np.ndarray:
    points = moved_landmarks(face, clip.motion)
    return points[:, 291, 0] - points[:, 61, 0]


def test_eyes_hold_the_viewer_while_the_head_nods(session: Session) -> None:
    clip = session.clip(Request(text="[nod]Yes.", gain="gaze=0,head=0"))
    assert np.degrees(clip.head.values[:, 0].max()) > 4
    up = channels_of(clip, ("eyeLookUp",)).mean(axis=1)
    assert np.corrcoef(up, clip.head.values[:, 0])[0, 1] > 0.95


def test_marks_and_flags_paint_styles(world: World) -> None:
    ready = world.session()
    plain, by_flag, by_mark = (
        ready.clip(Request(text=text, style=style))
        for text, style in ((TEXT, None), (TEXT, "head=wild"), (f"[style:head=wild]{TEXT}[/style]", None))
    )
    np.testing.assert_allclose(by_mark.head.values[30:-30], by_flag.head.values[30:-30], atol=1e-4)
    assert not np.array_equal(by_flag.head.values, plain.head.values)
    np.testing.assert_array_equal(channels_of(by_flag, ("brows",)), channels_of(plain, ("brows",)))


def test_another_palette_gives_other_motion(world: World, tmp_path: Path) -> None:
    other = replace(world.palette, styles={"few": made_style(5)}, derivations={})
    write_palette(tmp_path / "few.palette", other)
    ready = world.session(palette=tmp_path / "few.palette")
    assert not np.array_equal(ready.clip(TEXT).head.values, world.session().clip(TEXT).head.values)
    with pytest.raises(InputError, match="no style 'delighted' in the palette; it has few, measured"):
        ready.clip(Request(text=TEXT, style="delighted"))


def test_an_idle_face_lives(session: Session, face: Face) -> None:
    clip = session.clip(Request(idle=12.0))
    assert not clip.speech.waveform.samples.any()
    assert channels_of(clip, ("eyeBlink",)).max() > 0.6
    assert np.degrees(np.ptp(clip.head.values[:, :3], axis=0)).max() > 0.5
    gap = lip_gap(gesture_face(face, load_palette("starter")).face, clip)
    assert np.ptp(gap) < 0.5  # mm: lips stay closed


def test_the_camera_holds_the_gaze(session: Session) -> None:
    plain, held = (session.clip(Request(text=TEXT * 4, seed=3, gaze=gaze)) for gaze in GAZES)
    assert gaze_degrees(plain).max() > 8
    assert gaze_degrees(held).max() < 2  # microsaccades
    with pytest.raises(InputError, match="--gain of the gaze has no effect with --gaze camera; remove one"):
        session.clip(Request(text=TEXT, gaze="camera", gain="gaze=2"))


def gaze_degrees(clip: Clip) -> np.ndarray:
    """(T,) degrees of the line of sight from the viewer: of the eyes, in the head, and of the head."""
    ways = {"Out": 25, "In": 25, "Up": 20, "Down": 20}  # degrees of the left eye at weight 1
    left, right, up, down = (turn * channels_of(clip, (f"eyeLook{way}Left",))[:, 0] for way, turn in ways.items())
    pitch, yaw = np.degrees(clip.head.values[:, :2]).T
    return np.hypot(down - up + pitch, left - right + yaw)


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["--style", "cross"], 2, "no style 'cross' in the palette; it has neutral, depressed"),
        (["--palette", "none"], 2, "no palette 'none'; give starter"),
        (["--palette", "half.palette"], 3, "half.palette is damaged"),
        (["--expression", "happy=1@90-91"], 2, "lies beyond the clip, which lasts"),
        (["--timeline", "late.json"], 2, "the nod at 90 s lies beyond the clip"),
        (["--gain", "head=4"], 2, "the gain of head must lie between 0 and 3, not 4"),
    ],
)
def test_invalid_requests_give_one_sentence_and_nothing_is_written(
    arguments: list[str], code: int, reason: str, tones: World, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "late.json").write_text(json.dumps({"nods": [{"time": 90}]}))
    (here / "half.palette").write_bytes((SHIPPED_FOLDER / "starter.palette").read_bytes()[:100_000])
    before = set(here.iterdir())
    own = [] if "--palette" in arguments else ["--palette", str(tones.palette_file)]
    models = ["--talker", str(tones.talker_file), "--face", str(tones.face_file), "--voice", VOICE, *own]
    assert run(["Hi there.", *arguments, *models, "--out", "x.mp4", *SMALL]) == code
    assert reason in capsys.readouterr().err
    assert set(here.iterdir()) == before


def test_a_capture_becomes_a_style_of_the_starter_palette(
    capture: Path, tones: World, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cache = ["--cache", "cache", "--jobs", "1"]
    assert run(["corpus", "gestures", str(capture), "--style", "live", "--out", "live.palette", *cache]) == 0
    assert re.search(
        r"wrote live\.palette: style live from 1 recordings, 0\.[23] minutes; modes keep", capsys.readouterr().err
    )
    palette = load_palette("live.palette")
    assert palette.names[-3:] == ("grid_s1", "live", "measured")
    assert palette.styles["live"].intensity.max() > 0  # its sound is in the same folder
    models = ["--talker", str(tones.talker_file), "--face", str(tones.face_file), "--voice", VOICE]
    styled = ["--palette", "live.palette", "--style", "live"]
    assert run(["Hello.", *models, *styled, "--out", "x.mp4", *SMALL]) == 0
    alone = ["--alone", "--estimator", "samples"]
    assert run(["corpus", "gestures", str(capture), "--style", "live", "--out", "a.palette", *alone, *cache]) == 0
    made = load_palette("a.palette")
    assert made.names[-2:] == ("live", "measured")
    assert "exasperated" in made.derivations
    assert not np.array_equal(made.styles["live"].motion["expression"], palette.styles["live"].motion["expression"])


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["none", "--out", "a.palette"], 2, "none contains no video and no capture"),
        (["take.csv", "--out", "a.talker"], 2, "a palette is written as .palette"),
        (["take.csv", "--out", "a.palette", "--estimator", "guess"], 2, "no estimator 'guess'"),
        (["take.csv", "--out", "a.palette"], 3, "no recording could be used; the first: take"),
        (["take.csv", "--out", "a.palette", "--still", "sad=none.png"], 2, "none.png"),
    ],
)
def test_what_cannot_become_a_style(
    arguments: list[str], code: int, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "take.csv").write_text("a,b\n1,2\n")
    assert run(["corpus", "gestures", *arguments, "--style", "mine", "--cache", "cache", "--jobs", "1"]) == code
    assert reason in capsys.readouterr().err
    assert not list(tmp_path.glob("*.palette"))
