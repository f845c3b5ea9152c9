"""Facial captures are recognised by their content."""

from pathlib import Path

import pytest

from corpus_tools.decomposition.capture_files import MarkerOptions, read_capture_file
from lexicon.errors import DataError, InputError
from tests.corpus_tools.decomposition.made_markers import Made, write_table
from tts2face.models.face import Face


def test_live_link_and_marker_tables_are_distinguished(capture: Path, made: Made, face: Face, tmp_path: Path) -> None:
    arkit = read_capture_file(capture, face)
    assert arkit.missing_features == frozenset()
    table = write_table(tmp_path / "take.csv", made.names, made.points, first="frame")
    with pytest.raises(InputError, match="has frame numbers"):
        read_capture_file(table, face)
    assert read_capture_file(table, face, options=MarkerOptions(neutral=table, fps=120.0)).missing_features == {"gaze"}


def test_a_table_of_another_format_is_refused(face: Face, tmp_path: Path) -> None:
    (tmp_path / "take.csv").write_text("a,b\n1,2\n3,4\n")
    with pytest.raises(DataError, match="needs the columns time or frame"):
        read_capture_file(tmp_path / "take.csv", face)
    with pytest.raises(InputError, match=r"take\.bvh is not a facial capture"):
        read_capture_file(tmp_path / "take.bvh", face)
    with pytest.raises(InputError, match="there is no capture"):
        read_capture_file(tmp_path / "none.csv", face)
