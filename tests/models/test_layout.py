"""Validation of model files: one array or key of a valid file is changed, and the error names the reason."""

import json
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import save

from lexicon.errors import DataError
from tests.models.made import write_made_face, write_made_palette, write_made_talker
from tests.picture.tiny_talker import own_talker
from tts2face.models.audio_map import FEATURE_SIZES
from tts2face.models.face_file import read_face
from tts2face.models.palette_file import read_palette
from tts2face.models.talker_file import read_talker
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.picture.options import Picture
from tts2face.picture.own_face import own_face_renderer
from tts2face.sound.features import FEATURE_RATE, speech_features
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.types import Waveform

READERS: dict[str, Callable[[Path], Any]] = {"face": read_face, "palette": read_palette, "talker": read_talker}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    write_made_face(folder / "made.face")
    write_made_palette(folder / "made.palette")
    write_made_talker(folder / "made.talker", has_face=True)
    return folder


def refusal(made: Path, tmp_path: Path, kind: str, change: Callable[[dict, dict], None]) -> str:
    """The error of a file after a change to its arrays and metadata."""
    arrays, header = read_tensors(made / f"made.{kind}", kind, 1)
    arrays = {name: np.array(array) for name, array in arrays.items()}
    change(arrays, header)
    write_tensors(tmp_path / f"wrong.{kind}", kind, 1, arrays, header)
    with pytest.raises(DataError) as refused:
        READERS[kind](tmp_path / f"wrong.{kind}")
    assert str(tmp_path / f"wrong.{kind}") in str(refused.value)
    assert "again" in str(refused.value)
    return str(refused.value)


def put(name: str, value: float) -> Callable[[dict, dict], None]:
    """A change: one number of an array."""

    def change(arrays: dict, header: dict) -> None:
        arrays[name].reshape(-1)[-1] = value

    return change


@pytest.mark.parametrize(
    ("kind", "name", "value", "reason"),
    [
        ("face", "vertices", np.nan, "vertices holds nan; its numbers must be finite"),
        ("face", "vertices", 1e6, "vertices holds 1000000.0; its greatest number is 10000"),
        ("face", "triangles", 10**6, "triangles holds 1000000, beyond its"),
        ("face", "shape_vertices", -1, "shape_vertices holds -1, beyond its"),
        ("face", "landmark_vertices", 10**6, "landmark_vertices holds 1000000, beyond its"),
        ("face", "landmarks", 478, "landmarks holds 478, beyond its 478 landmarks"),
        ("face", "landmarks", 0, "landmarks holds a duplicate number"),
        ("face", "landmark_weights", 0.9, "landmark_weights of a landmark add up to"),
        ("face", "shape_counts", 7, "shape_counts adds up to"),
        ("face", "limits", -1, "limits of the shape eyeLookInRight are reversed"),
        ("face", "identity0_step", np.inf, "identity0_step holds inf"),
        ("palette", "region.brows.landmarks", 500, "region.brows.landmarks holds 500, beyond its 478"),
        ("palette", "region.brows.modes", 0.9, "region.brows.modes is not orthonormal"),
        ("palette", "style.calm.lengths", 91, "style.calm.lengths adds up to 901, but there are 900"),
        ("palette", "style.calm.head.step", 0, "style.calm.head.step holds 0; steps must be above 0"),
        ("palette", "style.calm.pitch", np.nan, "style.calm.pitch holds nan"),
        ("talker", "phones", 6, "phones holds 6, beyond its 6 phones of the inventory"),
        ("talker", "n_frames", 22, "n_frames adds up to"),
        ("talker", "edges", 0.1, "edges do not increase at"),
        ("talker", "edges", 9.0, "phones of the utterance 'u5' end after its frames"),
        ("talker", "basis", 0.9, "basis is not orthonormal"),
        ("talker", "drive.linear.context", 3, "drive.linear.context ends with 3, not one of"),
        ("talker", "drive.linear.feature", 98, "drive.linear.feature is 'mfcb', not a sum of formants"),
        ("talker", "network.weights0", np.nan, "network.weights0 holds nan"),
        ("talker", "appearance.face.pixels", 10**6, "appearance.face.pixels holds 1000000, beyond its"),
        ("talker", "appearance.mouth.triangles", 20, "appearance.mouth.triangles holds 20, beyond its 20 points"),
        ("talker", "appearance.mouth_points", 470, "appearance.mouth_points holds 470, beyond its 468"),
        ("talker", "appearance.moved_by_speech", 2, "appearance.moved_by_speech holds 2.0"),
    ],
)
def test_a_wrong_number(made: Path, tmp_path: Path, kind: str, name: str, value: float, reason: str) -> None:
    assert reason in refusal(made, tmp_path, kind, put(name, value))


def _array(name: str, make: Callable[[np.ndarray], np.ndarray]) -> Callable[[dict, dict], None]:
    return lambda arrays, header: arrays.update({name: make(arrays[name])})


def _noise(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Shapes that move every vertex by up to 3 m somewhere."""
    deltas = np.random.default_rng(0).integers(-32000, 32000, arrays["shape_deltas"].shape)
    return {"shape_deltas": deltas.astype(np.int16), "shape_steps": np.full_like(arrays["shape_steps"], 0.1)}


def _without_occlusion_bytes(arrays: dict, header: dict) -> None:
    arrays["occlusion"] = np.frombuffer(zlib.compress(b"0" * 100), np.uint8)
    del header["occlusion_bytes"]


def _deep(levels: int) -> list:
    nested: list = []
    for _ in range(levels):
        nested = [nested]
    return nested


@pytest.mark.parametrize(
    ("kind", "change", "reason"),
    [
        ("face", _array("limits", lambda a: a.astype(np.float64)), "limits is float64, not float32"),
        ("face", _array("pivot", lambda a: a[:2]), "pivot has the shape (2,), not (3)"),
        ("face", _array("colours", lambda a: a[1:]), "colours has the shape"),
        ("face", _array("texture", lambda a: a[:40]), "cannot read the texture of"),
        ("face", _array("vertices", np.zeros_like), "vertices span 0 x 0 mm"),
        ("face", _array("vertices", np.random.default_rng(0).permutation), "triangles at rest cover"),
        ("face", lambda a, h: a.update(_noise(a)), "triangles with jawOpen cover"),
        ("face", lambda a, h: a.pop("uv"), "has only one of uv and texture"),
        ("face", _without_occlusion_bytes, "the occlusion is not of"),
        ("face", lambda a, h: a.update(extra=a["pivot"]), "holds the array 'extra', which no face has"),
        ("face", lambda a, h: h["parts"][1].update(first=3), "the part 'eye_left' begins at 3, not at"),
        ("face", lambda a, h: h["parts"][0].update(opacity="1"), "parts[0]: opacity is '1', not a number from"),
        ("face", lambda a, h: h["eyes"][0].update(count=10**6), "eye 0 reaches beyond"),
        ("face", lambda a, h: h["eyes"][0].update(count=True), "eyes[0]: count is True, not a whole number"),
        ("face", lambda a, h: h["eyes"][0]["turns"].update(x=[0, 0, 1]), "turns with ['x'], which is not one of its"),
        ("face", lambda a, h: h.update(shape_names=["jawOpen"] * 4), "two shapes of the same name"),
        ("face", lambda a, h: h.update(metadata=_deep(3)), "metadata is a list of 1, not an object"),
        ("face", lambda a, h: h["metadata"].update(x=_deep(40)), "nested deeper than 16 levels"),
        ("palette", lambda a, h: h["derivations"]["quick"]["changes"]["blink"].update(tempo=1e9), "from 0.05 to 20"),
        ("palette", lambda a, h: h["derivations"]["quick"]["changes"].update(nose={}), "changes 'nose'; it must be"),
        ("palette", lambda a, h: h["styles"].clear(), "array 'style.calm.blink', which no palette has"),
        ("palette", lambda a, h: h.update(fps=10**100), "fps is a number of more than 60 digits"),
        ("talker", lambda a, h: h.update(inventory=["x1"] * 6), "inventory holds ['x1'], which is no phone"),
        ("talker", lambda a, h: h["utterances"].pop(), "names 5 utterances, but n_frames has 6"),
        ("talker", lambda a, h: h["utterances"][0][1][0].__setitem__(2, 99), "'u0' reaches beyond its phones"),
        ("talker", lambda a, h: h["utterances"][0][1].append(["a", "b", 3]), "utterances[0] holds a word that is not"),
        ("talker", lambda a, h: h.update(n_speech=9), "n_speech is 9, but there are 3 modes"),
        ("talker", lambda a, h: h.update(refused=["u9"]), "refused[0] is 'u9', not a list of 2"),
        ("talker", lambda a, h: a.pop("looks"), "lacks the array looks"),
        ("talker", lambda a, h: h.pop("network_inventory"), "its metadata lack network_inventory"),
    ],
)
def test_a_wrong_array_or_key(
    made: Path, tmp_path: Path, kind: str, change: Callable[[dict, dict], None], reason: str
) -> None:
    assert reason in refusal(made, tmp_path, kind, change)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('{"a": NaN}', "NaN is not a JSON number"),
        ('{"a": 1, "a": 2}', "'a' occurs twice in one object"),
        ("[" * 100_000 + "]" * 100_000, "cannot be read as JSON"),
        ('{"a": "\\ud800"}', "cannot be read as JSON"),
        ('{"a": ' + "9" * 5000 + "}", "cannot be read as JSON"),
        ("[1]", "the metadata are a list, not an object"),
    ],
)
def test_metadata_that_are_not_an_object(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "wrong.face"
    file.write_bytes(save({"a": np.zeros(1)}, {"kind": "face", "version": "1", "metadata": text}))
    with pytest.raises(DataError, match=reason):
        read_face(file)


def test_a_plate_with_fewer_pictures_than_points() -> None:
    talker = own_talker()
    assert talker.appearance is not None
    plate = talker.appearance.plate
    longer = replace(plate, points=np.concatenate([plate.points, plate.points]))
    wrong = replace(talker, appearance=replace(talker.appearance, plate=longer))
    with pytest.raises(DataError, match="must show 8 pictures"):
        own_face_renderer(wrong, Picture(size="64x64"))


def test_a_plate_that_is_no_video() -> None:
    talker = own_talker()
    assert talker.appearance is not None
    text = np.frombuffer(b"#EXTM3U\n#EXTINF:1,\nhttp://localhost/a.ts\n", np.uint8)
    plate = replace(talker.appearance.plate, video=text)
    wrong = replace(talker, appearance=replace(talker.appearance, plate=plate))
    with pytest.raises(DataError, match="plate cannot be decoded"):
        own_face_renderer(wrong, Picture(size="64x64"))


def test_shapes_without_motion_are_refused() -> None:
    with pytest.raises(DataError, match="linearly dependent"):
        bounded_least_squares(np.zeros((2, 2)), np.ones((1, 2)), np.array([[0.0, 1.0]] * 2))


def test_sizes_of_features_are_those_measured() -> None:
    sound = Waveform(0.1 * np.sin(np.arange(FEATURE_RATE // 10)), FEATURE_RATE)
    for kind, size in FEATURE_SIZES.items():
        assert speech_features(sound, kind, fps=25.0, n_frames=1).values.shape == (1, size)


def test_written_metadata_come_back(made: Path) -> None:
    assert json.loads(json.dumps(dict(read_talker(made / "made.talker").metadata)))["refused"] == [["u9", "no face"]]
