"""Decoding of text files whose encoding is not declared."""

import codecs
import re
from pathlib import Path

from lexicon.errors import DataError, InputError
from lexicon.values.files import check_regular_file
from tts2face.interchange.subtitles.encodings import Decoded, guess_encoding

MAX_BYTES = 8 << 20  # 8 MiB; the words of a whole day of speech are below 1 MiB
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)  # in this order: the mark of UTF-32-LE begins with that of UTF-16-LE
# UTF-16 without a mark: the high byte of digits, line ends and arrows, which every subtitle file contains, is 0.
_ZERO_SHARE = 0.2  # of the bytes of one parity


_DECLARED = re.compile(rb"\s*<\?xml[^>]*\bencoding\s*=\s*[\"']([A-Za-z0-9._-]{1,40})[\"']")
# A sequence of UTF-8 beyond ASCII (RFC 3629), and a byte that belongs to none.
_SEQUENCE = re.compile(rb"[\xc2-\xdf][\x80-\xbf]|[\xe0-\xef][\x80-\xbf]{2}|[\xf0-\xf4][\x80-\xbf]{3}")
_WHOLE_SHARE = 0.8  # of the sequences: a file of UTF-8 with damaged places, not of another encoding


def read_text(path: Path, encoding: str | None = None, language: str | None = None) -> str:
    """Characters of a text file, as `decode_file`."""
    return decode_file(path, encoding, language).text


def decode_file(
    path: Path, encoding: str | None = None, language: str | None = None, *, max_bytes: int = MAX_BYTES
) -> Decoded:
    """Characters of a text file: by its byte order mark, else as UTF-8 or UTF-16, else in the likely encoding.

    Parameters
    ----------
    encoding
        Encoding of files without a byte order mark that are not UTF-8, such as ``cp1250``; None: it is guessed.
    language
        Language of the words, where it is known, which decides the guess.
    max_bytes
        Size above which a file is refused.
    """
    check_regular_file(path)
    try:
        with path.open("rb") as file:
            content = file.read(max_bytes + 1)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    if len(content) > max_bytes:
        raise DataError(f"{path} is larger than {max_bytes >> 20} MiB; give the transcript only")
    decoded = _decode(content, path, encoding, language)
    if "\0" in decoded.text:
        raise DataError(f"{path} is not text (it contains zero bytes); save it as UTF-8")
    return decoded


def check_encoding(encoding: str) -> str:
    """Name of a text encoding."""
    try:
        return codecs.lookup(encoding).name
    except LookupError as unknown:
        raise InputError(f"there is no encoding {encoding!r}; give one such as cp1250, utf-8 or shift_jis") from unknown


def _decode(content: bytes, path: Path, encoding: str | None, language: str | None) -> Decoded:
    named = None if encoding is None else check_encoding(encoding)
    try:
        for mark, name in _BYTE_ORDER_MARKS:
            if content.startswith(mark):
                return Decoded(content[len(mark) :].decode(name), name)
        if (wide := _guess_wide(content)) is not None:
            return Decoded(content.decode(wide), wide)
        try:
            return Decoded(content.decode("utf-8"), "utf-8")
        except UnicodeDecodeError:
            found = _decode_other(content, named, language)
    except UnicodeDecodeError as broken:
        if encoding is not None:
            raise DataError(f"{path} is not text in {encoding}; choose another encoding") from broken
        raise DataError(f"{path} is not text in UTF-16 or UTF-32, as it begins; save it as UTF-8") from broken
    if found is None:
        raise DataError(f"{path} is not text in UTF-8, UTF-16, UTF-32 or another known encoding; save it as UTF-8")
    return found


def _decode_other(content: bytes, named: str | None, language: str | None) -> Decoded | None:
    """Text that is not UTF-8: in the encoding that is named or declared, as damaged UTF-8, or in the likely one."""
    if named is not None:
        return Decoded(content.decode(named), named)
    declared = _DECLARED.match(content)
    if declared is not None:
        try:
            name = codecs.lookup(declared[1].decode("ascii")).name
            return Decoded(content.decode(name), name)
        except (LookupError, UnicodeDecodeError):
            pass
    text = content.decode("utf-8", errors="replace")
    n_damaged = text.count("\ufffd")
    n_whole = len(_SEQUENCE.findall(content))
    if n_whole >= _WHOLE_SHARE * (n_whole + n_damaged):
        return Decoded(text, "utf-8", n_damaged=n_damaged)
    return guess_encoding(content, language)


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
