"""Picture files of every kind give the same upright sRGB pixels, or one sentence."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms

from lexicon.errors import DataError
from tests.packages import package
from tts2face.photo import photograph
from tts2face.photo.photograph import KEPT_HEIGHT, read_photograph

SIZE = (120, 90)
ORIENTATION = 0x0112
TURNED = {3: Image.Transpose.ROTATE_180, 6: Image.Transpose.ROTATE_90, 8: Image.Transpose.ROTATE_270}


@pytest.fixture(scope="module")
def picture() -> Image.Image:
    """A smooth picture, in which every corner differs."""
    across, down = np.meshgrid(np.linspace(0, 1, SIZE[0]), np.linspace(0, 1, SIZE[1]))
    return Image.fromarray(np.rint(255 * np.stack([across, down, 0.5 * np.ones_like(down)], axis=2)).astype(np.uint8))


def written(folder: Path, image: Image.Image, name: str, **options: object) -> Path:
    path = folder / name
    image.save(path, **options)
    return path


def difference(found: np.ndarray, wanted: Image.Image) -> float:
    return float(np.abs(found.astype(int) - np.asarray(wanted.convert("RGB")).astype(int)).mean())


@pytest.mark.parametrize("name", ["me.jpg", "me.png", "me.webp", "me.tif", "me.bmp"])
def test_formats_are_read(tmp_path: Path, picture: Image.Image, name: str) -> None:
    found = read_photograph(written(tmp_path, picture, name))
    assert found.pixels.dtype == np.uint8
    assert difference(found.pixels, picture) < 3
    assert found.alpha is None
    assert found.reduced_by == 1


@pytest.mark.parametrize("orientation", sorted(TURNED))
def test_a_turned_camera_gives_an_upright_picture(tmp_path: Path, picture: Image.Image, orientation: int) -> None:
    exif = Image.Exif()
    exif[ORIENTATION] = orientation
    path = written(tmp_path, picture.transpose(TURNED[orientation]), "me.jpg", exif=exif, quality=95)
    assert difference(read_photograph(path).pixels, picture) < 2


@pytest.mark.parametrize(("mode", "name"), [("CMYK", "me.jpg"), ("P", "me.png"), ("L", "me.png"), ("1", "me.png")])
def test_modes_of_colour_become_srgb(tmp_path: Path, picture: Image.Image, mode: str, name: str) -> None:
    changed = picture.convert(mode)
    assert difference(read_photograph(written(tmp_path, changed, name)).pixels, changed) < 4


def test_16_bits_of_grey_are_8_bits(tmp_path: Path) -> None:
    grey = np.linspace(0, 65535, 80 * 70).reshape(70, 80).astype(np.uint16)
    for name in ("me.png", "me.tif"):
        found = read_photograph(written(tmp_path, Image.fromarray(grey), name)).pixels
        assert np.abs(found - (grey[:, :, None] / 257)).max() < 1.01


@pytest.mark.parametrize("most", [1.0, 255.0])
def test_pictures_of_fractions_are_read(tmp_path: Path, most: float) -> None:
    grey = np.linspace(0, most, 80 * 70, dtype=np.float32).reshape(70, 80)
    found = read_photograph(written(tmp_path, Image.fromarray(grey), "me.tif")).pixels
    assert np.abs(found - 255 / most * grey[:, :, None]).max() < 1


def test_colour_profiles_are_converted(tmp_path: Path, picture: Image.Image) -> None:
    lab = ImageCms.createProfile("LAB")
    plain = ImageCms.createProfile("sRGB")
    in_lab = ImageCms.profileToProfile(picture, plain, lab, outputMode="LAB")
    path = written(tmp_path, in_lab, "me.tif", icc_profile=ImageCms.ImageCmsProfile(lab).tobytes())
    assert difference(read_photograph(path).pixels, picture) < 4
    damaged = written(tmp_path, picture, "damaged.png", icc_profile=b"no profile")
    assert difference(read_photograph(damaged).pixels, picture) == 0


@pytest.mark.parametrize("mode", ["RGBA", "LA", "P"])
def test_coverage_is_kept(tmp_path: Path, picture: Image.Image, mode: str) -> None:
    cover = Image.fromarray(np.tile(np.array([0, 255], np.uint8).repeat(60), (90, 1)))
    covered = picture.copy()
    covered.putalpha(cover)
    found = read_photograph(written(tmp_path, covered.convert(mode), "me.png"))
    assert found.alpha is not None
    np.testing.assert_array_equal(found.alpha, np.asarray(cover))
    covered.putalpha(255)
    assert read_photograph(written(tmp_path, covered, "full.png")).alpha is None


@pytest.mark.parametrize("name", ["me.jpg", "me.png"])
def test_very_large_pictures_are_reduced(tmp_path: Path, picture: Image.Image, name: str) -> None:
    large = picture.resize((3200, 2400))
    found = read_photograph(written(tmp_path, large, name))
    assert found.pixels.shape == (KEPT_HEIGHT, 2880, 3)
    assert found.reduced_by == pytest.approx(3200 / 2880)
    assert difference(found.pixels[::24, ::24], picture) < 4


def test_heic_is_read_or_its_package_is_named(
    tmp_path: Path, picture: Image.Image, monkeypatch: pytest.MonkeyPatch
) -> None:
    heif = package("pillow_heif")
    heif.register_heif_opener()
    path = written(tmp_path, picture, "me.heic", quality=95)
    assert difference(read_photograph(path).pixels, picture) < 3
    monkeypatch.setitem(__import__("sys").modules, "pillow_heif", None)
    with pytest.raises(DataError, match=r"me\.heic is HEIC, which needs pillow-heif"):
        read_photograph(path)


def test_what_cannot_be_used_is_told(tmp_path: Path, picture: Image.Image, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DataError, match=r"40 x 90 pixels; give one with at least 64 along each side"):
        read_photograph(written(tmp_path, picture.resize((40, 90)), "small.png"))
    for name, content in (("none.jpg", None), ("text.jpg", b"not a picture"), ("empty.png", b"")):
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(DataError, match=rf"cannot read the photo .*{name}; give a JPEG"):
            read_photograph(path)
    kept = io.BytesIO()
    picture.save(kept, "PNG")
    cut = tmp_path / "cut.png"
    cut.write_bytes(kept.getvalue()[: len(kept.getvalue()) // 2])
    with pytest.raises(DataError, match="cannot read the photo"):
        read_photograph(cut)
    monkeypatch.setattr(photograph, "MAX_FILE_PIXELS", 10_000)
    with pytest.raises(DataError, match=r"large\.png has 120 x 90 pixels; at most .* reduce its size"):
        read_photograph(written(tmp_path, picture, "large.png"))
