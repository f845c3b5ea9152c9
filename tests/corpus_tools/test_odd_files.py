"""What lies among recordings and is no ordinary file is refused by name; nothing waits for it, nothing else stops."""

import os
from pathlib import Path

import pytest

from corpus_tools.recordings.folder import find_recordings, pronounce_recording
from corpus_tools.recordings.observe import Observations, Refusal, _VideoReader, check_any_kept, group_by_video
from lexicon.errors import DataError, InputError
from tts2face.video.media import read_media_info, read_sound

REASONS = {
    "folder": "folder.mp4 is a folder, not a file",
    "pipe": "pipe.mp4 is a pipe, not a file",
    "loop": "loop.mp4 cannot be read (Too many levels of symbolic links)",
    "astray": "astray.mp4 cannot be read (No such file or directory)",
}


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    (tmp_path / "folder.mp4").mkdir()
    os.mkfifo(tmp_path / "pipe.mp4")
    (tmp_path / "loop.mp4").symlink_to(tmp_path / "loop.mp4")
    (tmp_path / "astray.mp4").symlink_to(tmp_path / "none.mp4")
    return tmp_path


def test_each_is_refused_by_name(recordings: Path, tmp_path: Path) -> None:
    worker = _VideoReader(tmp_path, tmp_path / "no.task")
    found = [outcome for task in group_by_video(find_recordings(recordings)) for outcome in worker(task)]
    reasons = {outcome.name: outcome.reason for outcome in found if isinstance(outcome, Refusal)}
    assert set(reasons) == set(REASONS)
    assert [name for name, reason in REASONS.items() if reason not in reasons[name]] == []
    for read in (read_media_info, lambda path: read_sound(path, 16_000)):
        for name in REASONS:
            with pytest.raises(DataError, match=rf"{name}\.mp4 (is|cannot be read)"):
                read(recordings / f"{name}.mp4")


def test_a_transcript_that_is_a_pipe_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").touch()
    os.mkfifo(tmp_path / "a.txt")
    (recording,) = find_recordings(tmp_path)
    with pytest.raises(DataError, match=r"a\.txt is a pipe, not a file"):
        pronounce_recording(recording)


def test_when_all_recordings_are_refused_the_reasons_are_listed(tmp_path: Path) -> None:
    refused = tuple(Refusal(name, f"reason {name}", tmp_path / name, 0.0) for name in "abcde")
    with pytest.raises(InputError, match=r"^no recording could be used: a: reason a$"):
        check_any_kept(Observations((), refused[:1]))
    with pytest.raises(InputError, match=r"^no recording could be used: a: reason a; b: reason b; c: reason c; and"):
        check_any_kept(Observations((), refused))
