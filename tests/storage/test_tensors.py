"""Validation of the JSON metadata of model files."""

from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from lexicon.errors import DataError
from tts2face.storage.tensors import read_tensors


@pytest.mark.parametrize(
    ("metadata", "reason"),
    [
        ("[" * 100_000, "is nested too deep"),
        ('{"fps": ' + "3" * 5000 + "}", "a number of 5000 characters is too long"),
        ('{"fps": 1e999}', "the number 1e999 is too large"),
        ('{"fps": 1, "fps": 2}', "'fps' occurs twice"),
        ("{", "line 1: not JSON"),
    ],
)
def test_metadata_that_is_wrong_is_refused(metadata: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "a.talker"
    header = {"kind": "talker", "version": "1", "metadata": metadata}
    save_file({"mean": np.zeros(3, np.float32)}, path, header)
    with pytest.raises(DataError, match=rf"a\.talker: the metadata cannot be read as JSON .* {reason}"):
        read_tensors(path, "talker", 1)
