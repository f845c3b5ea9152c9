"""Files are read to a size and no further."""

import os
import socket
from pathlib import Path

import pytest

from lexicon.errors import DataError
from lexicon.values.files import check_regular_file, read_bounded, read_text
from lexicon.values.json_text import read_json


def test_files_are_read_to_a_size_and_no_further(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes(b"\xef\xbb\xbfHello")
    assert read_text(file, 8) == "Hello"
    with pytest.raises(DataError, match=r"a\.txt contains more than 0 MB; split it"):
        read_text(file, 7)
    with pytest.raises(DataError, match="zero contains more than 2 MB"), Path("/dev/zero").open("rb") as endless:
        read_bounded(endless, "zero", 2_000_000)
    file.write_bytes(b"h\xe9")
    with pytest.raises(DataError, match=r"a\.txt is not UTF-8 text \(byte 1\)"):
        read_json(file)


def test_a_text_is_read_of_a_file_or_of_a_pipe_given_on_purpose(tmp_path: Path) -> None:
    (tmp_path / "zero").symlink_to("/dev/zero")
    with pytest.raises(DataError, match="zero is a device, not a file"):
        read_text(tmp_path / "zero", 7)
    os.mkfifo(tmp_path / "pipe")
    end = os.open(tmp_path / "pipe", os.O_RDWR)
    try:
        os.write(end, b"Hello there.")
        with pytest.raises(DataError, match="pipe is a pipe, not a file; remove it or use a file"):
            read_text(tmp_path / "pipe", 7)
        with pytest.raises(DataError, match="pipe contains more than"):  # it is read
            read_text(tmp_path / "pipe", 7, may_be_pipe=True)
    finally:
        os.close(end)
    given, end = os.pipe()
    os.write(end, b"Hello there.")
    os.close(end)
    assert read_text(Path(f"/dev/fd/{given}")) == "Hello there."
    os.close(given)


def test_only_ordinary_files_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file.mp4").touch()
    Path("folder.mp4").mkdir()
    os.mkfifo("pipe.mp4")
    Path("loop.mp4").symlink_to("loop.mp4")
    Path("link.mp4").symlink_to("file.mp4")
    Path("astray.mp4").symlink_to("none.mp4")
    check_regular_file(Path("file.mp4"))
    check_regular_file(Path("link.mp4"))
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("socket.mp4")
        for name, reason in (
            ("folder.mp4", r"folder\.mp4 is a folder, not a file"),
            ("pipe.mp4", r"pipe\.mp4 is a pipe, not a file"),
            ("socket.mp4", r"socket\.mp4 is a socket, not a file"),
            ("/dev/null", "/dev/null is a device, not a file"),
            ("loop.mp4", r"loop\.mp4 cannot be read \(Too many levels of symbolic links\)"),
            ("astray.mp4", r"astray\.mp4 cannot be read \(No such file"),
            ("x" * 304, "cannot be read \\(File name too long"),
        ):
            with pytest.raises(DataError, match=reason):
                check_regular_file(Path(name))
