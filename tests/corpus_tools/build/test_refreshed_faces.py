"""Steps of the builder that change what is there of a shipped face: its presets, and light that is retouched."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.shipped.film.retouch import RETOUCHED, retouch_face, soften_highlights
from corpus_tools.shipped.head.presets import PRESETS, refresh_presets
from lexicon.errors import InputError
from tts2face.models.face_file import FORMAT_VERSION, KIND, read_face
from tts2face.storage.shipped import SHIPPED_FOLDER
from tts2face.storage.tensors import read_tensors


def copied(name: str, folder: Path) -> Path:
    return Path(shutil.copy(SHIPPED_FOLDER / f"{name}.face", folder))


@pytest.mark.build
def test_presets_are_written_once_and_the_rest_of_the_head_stays(tmp_path: Path) -> None:
    path = copied("head", tmp_path)
    before, _ = read_tensors(path, KIND, FORMAT_VERSION)
    refresh_presets(path)
    content, (after, header) = path.read_bytes(), read_tensors(path, KIND, FORMAT_VERSION)
    refresh_presets(path)
    assert path.read_bytes() == content
    assert {name for name in before if not np.array_equal(before[name], after[name])} <= {
        f"identity{number}{end}" for number in range(len(PRESETS)) for end in ("", "_step")
    }
    for name, person in PRESETS.items():
        face = read_face(path, name)
        assert (face.hairdo.haircut, face.hairdo.colour) == (person.hairdo.haircut, person.hairdo.colour)
    assert header["metadata"]["preset_rests"]["kofi"] == PRESETS["kofi"].rest


@pytest.mark.build
def test_light_is_retouched_once(tmp_path: Path) -> None:
    path = copied("mara", tmp_path)
    retouch_face(path)
    content = path.read_bytes()
    retouch_face(path)
    assert path.read_bytes() == content
    assert read_face(path).metadata[RETOUCHED]
    with pytest.raises(InputError, match="there is no retouching of ada"):
        retouch_face(copied("ada", tmp_path))


def test_highlights_keep_a_share_where_it_is_asked_for() -> None:
    page = np.full((64, 64, 3), 120, np.uint8)
    page[30:33] = 230
    page[10:12] = 40
    half = np.zeros((64, 64))
    half[:, :32] = 1
    softened = soften_highlights(page, half, 0.2, 200.0, np.ones((64, 64), bool))
    assert (softened[31, :30] < 180).all()
    assert (softened[31, :30] > 120).all()
    assert (softened[:, 32:] == page[:, 32:]).all()
    assert (softened[10:12] == page[10:12]).all()
