"""Times between others, and words without sound."""

import pytest

from lexicon.errors import DataError
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.interchange.transcripts.slots import interpolated
from tts2face.interchange.transcripts.spoken import SpokenCue
from tts2face.interchange.transcripts.utterances import shared_words


def test_runs_without_times_are_divided_evenly() -> None:
    assert interpolated([None, 1.0, None, None, 4.0, None]) == [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]
    assert interpolated([None, None]) == [0.0, 0.0]


def test_punctuation_takes_no_time() -> None:
    words, _ = shared_words([SpokenCue(0.0, 1.0, "we go , now .")])
    assert [word.text for word in words] == ["we", "go", "now"]
    assert words[-1].end == 1.0


def test_a_chat_without_times_is_refused(tmp_path) -> None:
    (tmp_path / "v.cha").write_text("@UTF8\n@Begin\n*CHI:\tI want it .\n*MOT:\tno .\n@End\n")
    with pytest.raises(DataError, match="has no times"):
        read_transcript(tmp_path / "v.cha")
