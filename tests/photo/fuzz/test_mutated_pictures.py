"""Damaged picture files are read, or refused in one sentence."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lexicon.errors import DataError
from tests.packages import package
from tts2face.photo.photograph import read_photograph

N_FILES = 100  # of each format
FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "GIF", "BMP", "HEIF")


@pytest.mark.parametrize("kind", FORMATS)
def test_mutated_pictures_never_crash(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(FORMATS.index(kind))
    if kind == "HEIF":
        package("pillow_heif").register_heif_opener()
    content = io.BytesIO()
    exif = Image.Exif()
    exif[0x0112] = 6
    options = {"exif": exif} if kind in ("JPEG", "PNG", "WEBP") else {}
    picture = Image.fromarray(rng.integers(0, 255, (80, 100, 4)).astype(np.uint8))
    (picture if kind in ("PNG", "WEBP", "TIFF") else picture.convert("RGB")).save(content, kind, **options)
    whole = np.frombuffer(content.getvalue(), np.uint8)
    refused = 0
    for number in range(N_FILES):
        changed = whole.copy()
        places = rng.integers(0, min(len(whole), 400 if number % 2 else len(whole)), rng.integers(1, 12))
        changed[places] = rng.integers(0, 256, len(places))
        path = tmp_path / f"{number}.bin"
        path.write_bytes(changed[: rng.integers(8, len(whole))].tobytes() if number % 5 == 0 else changed.tobytes())
        refused += sentence_of(path) is not None
    assert 10 < refused < N_FILES


def sentence_of(path: Path) -> str | None:
    """Why a picture is refused; None for one that is read."""
    try:
        assert read_photograph(path).pixels.shape[2] == 3
    except DataError as error:
        return str(error)
    return None
