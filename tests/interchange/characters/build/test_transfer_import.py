"""Shapes carried over by a whole import, which the tracker reads."""

from pathlib import Path

import numpy as np
import pytest

from tests.interchange.characters.made import Variant, head_without_mouth, write_character_file
from tests.interchange.characters.test_transfer import shapeless_head
from tts2face.interchange.characters.importing import import_face


@pytest.mark.usefixtures("face_model")
def test_the_shapes_of_a_head_come_back(tmp_path: Path) -> None:
    """The shipped head without its shapes, turned aside: its own are carried over to it."""
    path = write_character_file(tmp_path / "bare.glb", Variant(turn_deg=22.0), face=shapeless_head())
    steps: list[tuple[int, int]] = []
    imported = import_face(path, shapes="transfer", on_progress=lambda done, of: steps.append((done, of)))
    face, head = imported.face, head_without_mouth()
    assert face.metadata["shapes_from"] == "head"
    assert "character" not in face.metadata
    assert len(face.eyes) == 2
    assert steps[-1][0] == len(steps) <= steps[-1][1]
    jaw = face.shapes[face.shape_names.index("jawOpen")]
    assert np.abs(jaw).max() == pytest.approx(np.abs(head.shapes[head.shape_names.index("jawOpen")]).max(), rel=0.1)
