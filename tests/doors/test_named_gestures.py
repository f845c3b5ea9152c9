"""Named gestures in clips: at their word, on every face, with closed lips and without steps."""

import json
from pathlib import Path

import numpy as np
import pytest

from lexicon.gesture_names import GESTURES
from tests.golden.requests import starter_with_pictures
from tests.world import World
from tts2face.face.gestures import gesture_face
from tts2face.face.landmarks import moved_landmarks
from tts2face.models.face_loading import load_face
from tts2face.models.palette_file import load_palette
from tts2face.request import Request
from tts2face.session.session import Session
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import Clip

BILABIAL = frozenset("pbm")
LONG = "One, two, {}three, four, five, six, seven. Eight, nine, ten and eleven."
TEXT = "Bob may map my pub."


@pytest.fixture(scope="module")
def session(shipped: Session) -> Session:
    return shipped


def gaps(clip: Clip) -> np.ndarray:
    """(T,) gap between the middles of the lips, mm."""
    shown = gesture_face(load_face("head"), load_palette("starter")).face
    points = moved_landmarks(shown, clip.motion)
    return np.asarray(points[:, 13, 1] - points[:, 14, 1])


def least_gaps(clip: Clip) -> list[float]:
    """Smallest gap of each bilabial, mm."""
    phones, found, seen = clip.speech.phones, gaps(clip), clip.motion.times
    spans = [
        (start, end) for phone, start, end in zip(phones.phones, phones.edges, phones.edges[1:], strict=False)
        if phone in BILABIAL
    ]  # fmt: skip
    return [float(found[(seen >= start - 0.03) & (seen <= end + 0.03)].min()) for start, end in spans]


@pytest.mark.parametrize("name", ["smile", "laugh", "surprise", "sigh", "frown"])
def test_no_gesture_opens_a_closed_bilabial(session: Session, name: str) -> None:
    marked = " ".join(f"[{name} 1.5]{word}" for word in TEXT.split())
    plain, made = (least_gaps(session.clip(Request(text=text))) for text in (TEXT, marked))
    assert len(plain) == len(made) >= 6
    assert np.abs(np.array(made) - plain).max() < 0.05  # mm: twice the tolerance of closed lips, a fifth of a pixel


def test_a_laugh_opens_the_mouth_between_words(session: Session, tmp_path: Path) -> None:
    (tmp_path / "t.json").write_text(json.dumps({"gestures": [{"time": 1.2, "name": "laugh"}]}))
    still, clip = (
        session.clip(Request(text="Yes. [pause 2.4]Bob.", timeline=timeline))
        for timeline in (None, tmp_path / "t.json")
    )
    laughs = (clip.motion.times > 1.2) & (clip.motion.times < 2.4)
    assert gaps(still)[laughs].max() < 1.0
    assert gaps(clip)[laughs].max() > 3.0


@pytest.mark.parametrize("name", GESTURES)
def test_every_gesture_is_seen_at_its_word(session: Session, name: str) -> None:
    plain = session.clip(Request(text=LONG.format(""), gain="gaze=0"))
    mark = "[look left]" if name == "look_at" else f"[{name}]"  # the eyes are on the viewer
    made = session.clip(Request(text=LONG.format(mark), gain="gaze=0"))
    begin = float(made.speech.phones.edges[made.speech.words[2].first])
    change = np.hstack([made.motion.values - plain.motion.values, made.head.values - plain.head.values])
    moved = np.abs(change).max(axis=1)
    after = made.motion.times > begin + GESTURES[name].seconds + 0.3
    assert moved[made.motion.times < begin - 0.05].max() < 0.01
    assert moved[(made.motion.times > begin) & ~after].max() > 0.05
    assert moved[after].max() < 0.05
    channels = [*made.motion.channels]
    left, right = (change[:, channels.index(f"eyeBlink{side}")].max() for side in ("Left", "Right"))
    assert (left > 0.6, right > 0.6) == (name in {"wink", "blink"}, name == "blink")


@pytest.mark.parametrize("method", ["fields", "ju2008", "noise"])
def test_every_method_shows_a_shake(world: World, method: str) -> None:
    plain, made = (
        world.session().clip(Request(text=f"{mark}One, two, three.", gestures=method)) for mark in ("", "[shake]")
    )
    turned = np.degrees(made.head.values - plain.head.values)[:, 1]
    assert np.ptp(turned) == pytest.approx(10.5, abs=1.0)


def test_gestures_at_both_ends_and_over_a_boundary_have_no_steps(world: World, tmp_path: Path) -> None:
    gestures = [
        {"time": 0, "name": "smile"},
        {"time": 1.0, "name": "tilt", "seconds": 4},
        {"time": 3.4, "name": "laugh"},
    ]
    (tmp_path / "t.json").write_text(json.dumps({"gestures": gestures}))
    text = "One, two. Three, four. Five, six, seven, eight."
    plain, made = (
        world.session().clip(Request(text=text, timeline=timeline)) for timeline in (None, tmp_path / "t.json")
    )
    change = np.hstack([made.motion.values - plain.motion.values, made.head.values - plain.head.values])
    assert np.abs(change[0]).max() < 1e-6
    assert np.abs(change[-1]).max() > 1e-3  # a laugh that the clip cuts
    assert np.abs(np.diff(change, axis=0)).max() < 0.35  # of a weight in one of 30 frames a second: a lid that shuts


def test_the_timeline_is_the_text(world: World, tmp_path: Path) -> None:
    marked = world.session().clip(Request(text="One, [shake 1.5 2s]two, three."))
    begin = float(marked.speech.phones.edges[marked.speech.words[1].first])
    gesture = {"time": begin, "name": "shake", "size": 1.5, "seconds": 2}
    (tmp_path / "t.json").write_text(json.dumps({"gestures": [gesture]}))
    painted = world.session().clip(Request(text="One, two, three.", timeline=tmp_path / "t.json"))
    np.testing.assert_allclose(marked.head.values, painted.head.values, atol=1e-5)


def test_a_talkers_own_face_shows_what_its_video_allows(voices: VoicePool) -> None:
    own = Session(starter_with_pictures(), "self", voices=voices)
    plain = own.clip(TEXT)
    made = own.clip(" ".join(f"[{name}]" for name in GESTURES) + TEXT)
    assert made.motion.columns(["lids"]).max() > 0.9
    happy = made.motion.columns(["happy"]) - plain.motion.columns(["happy"])[: len(made.motion)]
    assert happy.max() > 0.4
    assert not made.head.values.any()
