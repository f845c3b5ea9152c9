"""Every table that a user gives is read up to a size only."""

from collections.abc import Callable
from pathlib import Path

import pytest

from corpus_tools.decomposition.marker_files import read_markers
from corpus_tools.decomposition.marker_sets import read_marker_set
from corpus_tools.recordings.folder import find_recordings
from corpus_tools.studies.evaluation.tracks import read_tracks
from lexicon.errors import DataError
from lexicon.values.tables import LARGEST_TABLE_BYTES
from tts2face.video.livelink import read_livelink


@pytest.mark.parametrize(
    "read",
    [read_livelink, read_markers, read_tracks, read_marker_set, lambda path: find_recordings(path.parent)],
    ids=["Live Link", "markers", "tracks", "marker set", "manifest"],
)
def test_every_table_of_a_user_has_a_limit(read: Callable[[Path], object], tmp_path: Path) -> None:
    table = tmp_path / "manifest.csv"
    with table.open("wb") as file:
        file.truncate(LARGEST_TABLE_BYTES + 1)  # a sparse file; nothing is parsed
    with pytest.raises(DataError, match=r"manifest\.csv contains more than \d+ MB; split it into smaller files"):
        read(table)
