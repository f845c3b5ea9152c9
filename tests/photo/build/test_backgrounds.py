"""The shipped people before rooms, told from them by the segmentation model: their coverage is known."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import distance_transform_edt, gaussian_filter

from tests.face.people import LIT
from tts2face.models.face_loading import load_face
from tts2face.photo.face_from_photo import face_from_photo
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw, mesh_renderer
from tts2face.video.networks import SEGMENTER_NAME, find_segmenter

SIDE = 480
RIM_PX = 30


@pytest.fixture(scope="module")
def segmenter(face_model: Path) -> Path:
    found = find_segmenter(face_model)
    if found is None:
        pytest.skip(f"{SEGMENTER_NAME} is not installed: run `tts2face corpus setup`")
    return found


def room() -> np.ndarray:
    """A door with its frame, a rail and a blurred plant."""
    wall = np.tile(np.array((196, 188, 170), np.float64), (SIDE, SIDE, 1))
    wall[:, 100:124], wall[:, 124:140], wall[:, 340:] = (120, 84, 56), (238, 236, 230), (96, 120, 140)
    wall[84:94, :340] = (90, 70, 50)
    plant = gaussian_filter(np.random.default_rng(0).normal(0, 1, (SIDE, SIDE)), 5)
    wall[:, 400:] += 150 * plant[:, 400:, None] * np.array([-0.5, 1.0, -0.5])
    return wall.clip(0, 255)


# The gaps between mara's hair and neck are read too differently: her picture keeps its background.
@pytest.fixture(scope="module", params=["head", *(name for name in LIT if name != "mara")])
def person(request: pytest.FixtureRequest) -> np.ndarray:
    return draw(load_face(request.param), picture=Picture(size=f"{SIDE}x{SIDE}", background="transparent"))


@pytest.fixture
def photo(person: np.ndarray, tmp_path: Path) -> Path:
    share = person[..., 3:] / 255.0
    Image.fromarray(np.rint(share * person[..., :3] + (1 - share) * room()).astype(np.uint8)).save(tmp_path / "me.png")
    return tmp_path / "me.png"


def test_a_person_is_told_from_a_room(photo: Path, person: np.ndarray, segmenter: Path, face_model: Path) -> None:
    said: list[str] = []
    face = face_from_photo(photo, consent="nobody", model=face_model, on_warning=said.append)
    assert not said
    view, true = face.light.view, person[..., 3] / 255.0
    apart = np.abs(view.alpha / 255.0 - true)
    near = (distance_transform_edt(true < 0.5) < RIM_PX) & (distance_transform_edt(true > 0.5) < RIM_PX)
    assert apart[near].mean() < 0.06
    assert apart[~near].mean() < 0.01
    free = distance_transform_edt(true == 0) > RIM_PX
    assert np.percentile(np.abs(view.behind - room())[free], 99) <= 1
    turned = mesh_renderer(face, Picture()).draw(
        np.zeros(len(face.shape_names)), np.array([0.08, 0.12, 0.1, 0, 0, 0], np.float32)
    )
    still = distance_transform_edt(true == 0) > 2 * RIM_PX
    np.testing.assert_array_equal(turned[still], view.behind[still])


def test_a_person_whose_surroundings_look_like_him_is_not_cut_out(
    tmp_path: Path, segmenter: Path, face_model: Path
) -> None:
    """Hair before a wall of heads like it."""
    shown = draw(load_face("head"), picture=Picture(size=f"{SIDE}x{SIDE}", background="transparent"))
    wall = np.zeros((SIDE, SIDE, 3))
    small = np.asarray(Image.fromarray(shown).resize((160, 160), Image.Resampling.LANCZOS), np.float64)
    for top in range(-40, SIDE, 70):
        for left in range(-60, SIDE, 60):
            rows, columns = slice(max(top, 0), top + 160), slice(max(left, 0), left + 160)
            part = wall[rows, columns]
            own = small[max(-top, 0) :, max(-left, 0) :][: part.shape[0], : part.shape[1]]
            share = own[..., 3:] / 255
            part[:] = share * own[..., :3] + (1 - share) * part
    share = shown[..., 3:] / 255.0
    Image.fromarray((share * shown[..., :3] + (1 - share) * wall).astype(np.uint8)).save(tmp_path / "me.png")
    said: list[str] = []
    face = face_from_photo(tmp_path / "me.png", consent="nobody", model=face_model, on_warning=said.append)
    assert face.light.view.alpha is None
    assert any("is not told from the background" in sentence for sentence in said)


def test_without_the_segmentation_model_it_is_said(
    photo: Path, face_model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tts2face.video.networks.is_segmenter", lambda _: False)
    said: list[str] = []
    face = face_from_photo(photo, consent="nobody", model=face_model, on_warning=said.append)
    assert face.light.view.alpha is None
    assert any("`tts2face corpus setup` adds the model" in sentence for sentence in said)
