"""Decoding of text files whose encoding is not declared."""

import codecs
from pathlib import Path

from lexicon.errors import DataError, InputError
from lexicon.values.files import check_regular_file

MAX_BYTES = 8 << 20  # 8 MiB; the words of a whole day of speech are below 1 MiB
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)  # in this order: the mark of UTF-32-LE begins with that of UTF-16-LE
# UTF-16 without a mark: the high byte of digits, line ends and arrows, which every subtitle file contains, is 0.
# of the bytes of one parity: Latin letters in UTF-16 have a zero byte each
_ZERO_SHARE = 0.2


def read_text(path: Path, encoding: str | None = None) -> str:
    """Characters of a text file: by its byte order mark, else as UTF-8, UTF-16 or Windows 1252.

    Parameters
    ----------
    encoding
        Encoding of files without a byte order mark that are not UTF-8, such as ``cp1250``; None: Windows 1252.

    Raises
    ------
    InputError
        There is no such encoding.
    DataError
        The file cannot be read, is too large, or is not text.
    """
    check_regular_file(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    if len(content) > MAX_BYTES:
        raise DataError(f"{path} is larger than {MAX_BYTES >> 20} MiB; give the transcript only")
    text = _decode(content, path, encoding)
    if "\0" in text:
        raise DataError(f"{path} is not text (it contains zero bytes); save it as UTF-8")
    return text


def check_encoding(encoding: str) -> str:
    """Name of a text encoding."""
    try:
        return codecs.lookup(encoding).name
    except LookupError as unknown:
        raise InputError(f"there is no encoding {encoding!r}; give one such as cp1250, utf-8 or shift_jis") from unknown


def _decode(content: bytes, path: Path, encoding: str | None) -> str:
    fallback = "cp1252" if encoding is None else check_encoding(encoding)
    try:
        for mark, name in _BYTE_ORDER_MARKS:
            if content.startswith(mark):
                return content[len(mark) :].decode(name)
        if (wide := _guess_wide(content)) is not None:
            return content.decode(wide)
        try:
            return content.decode("utf-8")
        except UnicodeDecodeError:
            # Windows 1252 is what old subtitle programs of the West wrote
            return content.decode(fallback)
    except UnicodeDecodeError as broken:
        if encoding is not None:
            raise DataError(f"{path} is not text in {encoding}; choose another encoding") from broken
        raise DataError(
            f"{path} is not text in UTF-8, UTF-16, UTF-32 or Windows 1252; save it as UTF-8 or name its encoding"
        ) from broken


def _guess_wide(content: bytes) -> str | None:
    """UTF-16 without a byte order mark, by the places of its zero bytes; None for other text."""
    # UTF-16 has pairs of bytes
    if len(content) % 2:
        return None
    half = max(len(content) // 2, 1)
    first, second = content[::2].count(0) / half, content[1::2].count(0) / half
    if second > _ZERO_SHARE and first < _ZERO_SHARE / 10:
        return "utf-16-le"
    return "utf-16-be" if first > _ZERO_SHARE and second < _ZERO_SHARE / 10 else None
