"""Pictures of shipped and real people, found by the tracker, speak: what it reads in the clip is what was said."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lexicon.errors import DataError, InputError
from tests.face.people import LIT
from tests.photo.pictures import SMILE, still
from tts2face.face.landmarks import moved_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import inner_lip_gaps, lip_opening, lip_width
from tts2face.photo.face_from_photo import face_from_photo
from tts2face.photo.mouth import PICTURED
from tts2face.picture.options import Picture
from tts2face.session.session import Session
from tts2face.types import Clip
from tts2face.video.media import read_frames
from tts2face.video.pose import remove_pose
from tts2face.video.tracking import FaceTracker

SIDE = 480
PANGRAM = "We were away a year ago, but Bob may move five big maps."
EYE_DISTANCE_MM, OPEN_MM, MOST_GAP_MM = 87.3, 5.0, 0.05


@pytest.fixture(scope="module", params=["head", *LIT])
def photo(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("photo") / f"{request.param}.png"
    Image.fromarray(still(request.param, SIDE)).save(path)
    return path


@pytest.fixture(scope="module")
def face(photo: Path, face_model: Path) -> Face:
    return face_from_photo(photo, consent="nobody", model=face_model)


def test_what_is_said_is_seen(face: Face, face_model: Path) -> None:
    check_speech(face, face_model)


@pytest.mark.parametrize("person", ["brbk7n", "lbax4n", "lwbsza", "sbia1a", "swiz3n"])
def test_real_people_speak(person: str, shared_recordings: Path, face_model: Path, tmp_path: Path) -> None:
    frame = next(iter(read_frames(shared_recordings / "grid_talkers" / f"{person}.mpg")))
    Image.fromarray(frame.pixels).save(tmp_path / f"{person}.png")
    said: list[str] = []
    face = face_from_photo(tmp_path / f"{person}.png", consent="nobody", model=face_model, on_warning=said.append)
    assert not said
    check_speech(face, face_model)


def check_speech(face: Face, face_model: Path) -> None:
    session = Session(face=face)
    clip = session.clip(f"[pause 0.5]{PANGRAM}[pause 0.5]", lead=None, seed=0)  # figures of rest and speech
    renderer = session.renderer(Picture(size="512x512", camera="close"))
    frames = list(renderer.frames(clip))
    wanted = moved_landmarks(session.mesh, clip.motion)
    tracking = FaceTracker(face_model).track(lambda: iter(frames), clip.fps)
    assert not tracking.is_missing.any()
    seen = remove_pose(tracking.points, clip.fps).landmarks
    assert np.corrcoef(lip_opening(seen), lip_opening(wanted))[0, 1] > 0.93
    assert np.corrcoef(lip_width(seen), lip_width(wanted))[0, 1] > 0.84  # .856 to .874 on zuri, three clips; most .9
    shut, opened = closures(clip, wanted), lip_opening(wanted) * EYE_DISTANCE_MM > OPEN_MM
    assert inner_lip_gaps(wanted)[shut, 1:-1].max() < MOST_GAP_MM
    assert np.median(lip_opening(seen)[shut]) < 0.35 * np.median(lip_opening(seen)[opened])


def closures(clip: Clip, landmarks: np.ndarray) -> list[int]:
    """The frame of each p, b and m in which the lips (T, 478, 3) are nearest to each other."""
    gaps, phones = inner_lip_gaps(landmarks)[:, 1:-1].max(axis=1), clip.speech.phones
    spans = zip(phones.phones, np.rint(clip.fps * np.asarray(phones.edges)).astype(int), strict=False)
    begins = [(begin, phone) for phone, begin in spans if phone in ("p", "b", "m")]
    return [begin + int(gaps[begin : begin + 3].argmin()) for begin, _ in begins]


def test_the_same_photo_gives_the_same_face(photo: Path, face: Face, face_model: Path) -> None:
    again = face_from_photo(photo, consent="nobody", model=face_model)
    np.testing.assert_array_equal(again.vertices, face.vertices)
    np.testing.assert_array_equal(again.shapes, face.shapes)
    assert face.metadata["name"] == photo.stem


@pytest.fixture(scope="module")
def smile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("smile") / "smile.png"
    Image.fromarray(still("head", SIDE, head=(4, 8, 0), **SMILE)).save(path)
    return path


def test_a_second_picture_gives_the_teeth(smile: Path, tmp_path: Path, face_model: Path) -> None:
    photo, other = tmp_path / "me.png", tmp_path / "other.png"
    Image.fromarray(still("head", SIDE)).save(photo)
    Image.fromarray(still("zuri", SIDE, **SMILE)).save(other)
    plain, own = (face_from_photo(photo, consent="nobody", model=face_model, smile=one) for one in (None, smile))
    assert PICTURED not in {part.name for part in plain.parts}
    assert PICTURED in {part.name for part in own.parts}
    for wrong, reason in (
        (photo, r"no upper teeth are seen in .*me\.png; give a picture of a smile that shows them clearly"),
        (other, r"other\.png shows another face than .*me\.png; give a smile of the same person"),
        (f"{smile}@2", r"smile\.png has one face, and no face 2"),
    ):
        with pytest.raises((DataError, InputError), match=reason):
            face_from_photo(photo, consent="nobody", model=face_model, smile=wrong)


def test_a_session_shows_a_photo(photo: Path) -> None:
    with pytest.raises(InputError, match="a photo has its own face and hair"):
        Session(face="ada", photo=photo, consent="nobody")
    with pytest.raises(InputError, match="state the consent"):
        Session(photo=photo)
