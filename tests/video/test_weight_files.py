"""Weights in JSON that a reader cannot take are refused with the name of their file."""

import json
from pathlib import Path
from typing import Any

import pytest

from lexicon.errors import DataError
from tts2face.types import HEAD_CHANNELS
from tts2face.video.weight_files import read_weight_file

SHAPES = ["JawOpen", "mouthClose"]


def write(folder: Path, suffix: str, names: list[str], weights: list[Any], head: float = 0.0) -> Path:
    path = folder / f"take{suffix}"
    if suffix == ".a2f.json":
        path.write_text(json.dumps({"exportFps": 30, "facsNames": names, "weightMat": weights}))
        return path
    lines = [
        {"fps": 30, "weights": names, "head": list(HEAD_CHANNELS)},
        *({"weights": row, "head": [head] * 6} for row in weights),
    ]
    path.write_text("\n".join(map(json.dumps, lines)))
    return path


@pytest.mark.parametrize("suffix", [".a2f.json", ".curves.jsonl"])
@pytest.mark.parametrize(
    ("names", "row", "reason"),
    [
        (["JawOpen", "jawOpen"], [0.1, 0.2], "names the shape jawOpen twice"),
        (["a", "b", "a"], [0.1, 0.2, 0.3], "names the shape a twice"),
        (SHAPES, [0.1, 1e40], r"frame 1 of .*take.* has a value of 1e\+40"),
        (SHAPES, [-1e7, 0.0], r"frame 1 of .*take.* has a value of -1e\+07"),
        (SHAPES, [0.1], r"frame 1 of .*take.* does not have 2 numbers"),
    ],
)
def test_what_is_no_take_is_refused_by_name(
    suffix: str, names: list[str], row: list[float], reason: str, tmp_path: Path
) -> None:
    with pytest.raises(DataError, match=reason):
        read_weight_file(write(tmp_path, suffix, names, [[0.0] * len(names), row]))


def test_a_head_beyond_all_numbers_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"the head in frame 0 of .*take\.curves\.jsonl has a value of 1e\+40"):
        read_weight_file(write(tmp_path, ".curves.jsonl", SHAPES, [[0.0, 0.5]], head=1e40))
