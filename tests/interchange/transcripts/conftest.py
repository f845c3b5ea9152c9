"""Transcripts that tests write and read."""

import pytest

from tts2face.interchange.transcripts.reader import read_transcript


@pytest.fixture
def read(tmp_path):
    """Transcript of a file of a name and content."""

    def read_file(name, content, tier=None):
        (tmp_path / name).write_text(content, encoding="utf-8")
        return read_transcript(tmp_path / name, tier)

    return read_file
