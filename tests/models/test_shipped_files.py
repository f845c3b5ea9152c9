"""Shipped files that are read and written again are as they were; pictures, which are coded anew, are left out."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tts2face.models.face_file import read_face, write_face
from tts2face.models.gaze import load_gaze, write_gaze
from tts2face.models.hair_file import read_hair, write_hair, write_lit_hair
from tts2face.models.lit_hair import LitHair
from tts2face.models.palette_file import read_palette, write_palette
from tts2face.models.phone_classifier import load_phone_classifier, write_phone_classifier
from tts2face.models.talker_file import read_talker, write_talker
from tts2face.storage.shipped import SHIPPED_FOLDER
from tts2face.storage.tensors import read_tensors

PICTURES = ("texture", "light", "skin", "relief", "alpha", "scalp")  # with which the names of their arrays start
ROUNDED = ("shape_", "identity")  # displacements in steps of their largest, which is rounded again


def write_any_hair(path: Path, hair: Any) -> None:
    (write_lit_hair if isinstance(hair, LitHair) else write_hair)(path, hair)


@pytest.mark.parametrize(
    ("name", "read", "write"),
    [
        ("grid_s1.talker", read_talker, write_talker),
        ("starter.palette", read_palette, write_palette),
        ("conversation.gaze", lambda path: load_gaze(str(path)), write_gaze),
        ("heart.phones", lambda path: load_phone_classifier(str(path)), write_phone_classifier),
        ("recordings.phones", lambda path: load_phone_classifier(str(path)), write_phone_classifier),
        ("cropped.hair", read_hair, write_any_hair),
    ],
)
def test_files_keep_their_bytes(
    name: str, read: Callable[[Path], Any], write: Callable[[Path, Any], None], tmp_path: Path
) -> None:
    write(tmp_path / name, read(SHIPPED_FOLDER / name))
    assert (tmp_path / name).read_bytes() == (SHIPPED_FOLDER / name).read_bytes()


@pytest.mark.parametrize(
    ("name", "read", "write"),
    [
        pytest.param("ada.face", read_face, write_face, marks=pytest.mark.build),
        ("bob01.hair", read_hair, write_any_hair),
        ("ada-bun.hair", read_hair, write_any_hair),
    ],
)
def test_files_with_pictures_keep_their_arrays(
    name: str, read: Callable[[Path], Any], write: Callable[[Path, Any], None], tmp_path: Path
) -> None:
    write(tmp_path / name, read(SHIPPED_FOLDER / name))
    kind = name.rpartition(".")[2]
    (before, _), (after, _) = (read_tensors(folder / name, kind, 1) for folder in (SHIPPED_FOLDER, tmp_path))
    kept = {array for array in before if not array.startswith((*PICTURES, *ROUNDED))}
    assert kept <= after.keys()
    for array in kept:
        np.testing.assert_array_equal(after[array], before[array], array)
