"""Text as users keep it: bytes of unknown encoding become characters."""

import codecs
from pathlib import Path

from lexicon.errors import DataError
from lexicon.inputs import check_regular_file

MAX_BYTES = 8 << 20  # 8 MiB; the words of a whole day of speech are below 1 MiB
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)  # in this order: the mark of UTF-32-LE begins with that of UTF-16-LE


def read_text(path: Path) -> str:
    """Characters of a text file: by its byte order mark, else as UTF-8, else as Windows 1252.

    Raises
    ------
    DataError
        It cannot be read, is too large, or is no text.
    """
    check_regular_file(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    if len(content) > MAX_BYTES:
        raise DataError(f"{path} is larger than {MAX_BYTES >> 20} MiB; a transcript holds words only")
    text = _decode(content, path)
    if "\0" in text:
        raise DataError(f"{path} is no text (it holds zero bytes); save it as UTF-8")
    return text


def _decode(content: bytes, path: Path) -> str:
    try:
        for mark, encoding in _BYTE_ORDER_MARKS:
            if content.startswith(mark):
                return content[len(mark) :].decode(encoding)
        try:
            return content.decode("utf-8")
        except UnicodeDecodeError:
            return content.decode("cp1252")
    except UnicodeDecodeError as broken:
        raise DataError(f"{path} is no text in UTF-8, UTF-16, UTF-32 or Windows 1252; save it as UTF-8") from broken
