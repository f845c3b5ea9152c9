"""EBU STL (EBU Tech 3264): a block of 1,024 bytes about the programme, and blocks of 128 bytes with subtitles."""

import re
import unicodedata
from types import MappingProxyType

from lexicon.errors import DataError
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import PLAIN_MARKUP

GENERAL_BYTES = 1024
BLOCK_BYTES = 128
TEXT_AT = 16  # byte of a block at which its text begins
USER_DATA = 0xFE  # extension number of blocks without subtitles
LAST_BLOCK = 0xFF  # extension number of the last or only block of a subtitle
NEW_LINE = 0x8A
# Character code tables (CCT, bytes 12 and 13); Latin is ISO 6937, for which Python has no codec.
_TABLES = MappingProxyType({b"01": "iso8859-5", b"02": "iso8859-6", b"03": "iso8859-7", b"04": "iso8859-8"})
_ACCENTS = MappingProxyType(dict(zip(
    (0xC1, 0xC2, 0xC3, 0xC4, 0xC5, 0xC6, 0xC7, 0xC8, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF),
    "\u0300\u0301\u0302\u0303\u0304\u0306\u0307\u0308\u030a\u0327\u030b\u0328\u030c", strict=True,
)))  # fmt: skip
_UPPER = MappingProxyType({
    start + offset: character
    for start, characters in (
        (0xA1, "¡¢£$¥"), (0xA7, "§¤‘“«←↑→↓°±²³×µ¶·÷’”»¼½¾¿"), (0xD0, "―¹®©™♪¬¦"), (0xDC, "⅛⅜⅝⅞ΩÆĐªĦ"),
        (0xE6, "ĲĿŁØŒºÞŦŊŉĸæđðħıĳŀłøœßþŧŋ"),
    )
    for offset, character in enumerate(characters)
})  # fmt: skip
_TIME_CODE = re.compile(rb"\d{8}")


def read_ebu(content: bytes, name: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of a file, from the start of its programme on, without comments."""
    if len(content) < GENERAL_BYTES + BLOCK_BYTES:
        raise DataError(f"{name} is EBU STL without subtitles; export it again")
    warnings: list[SubtitleWarning] = []
    rate = 30.0 if content[3:11] == b"STL30.01" else 25.0
    table = bytes(content[12:14])
    programme = content[256:264]  # the time code at which the programme begins
    parts = [int(programme[at : at + 2]) for at in range(0, 8, 2)] if _TIME_CODE.fullmatch(programme) else [0] * 4
    start = _seconds(parts, rate)
    if start:
        warnings.append(
            SubtitleWarning(1, f"the programme begins at {start:.2f} s, as the file states; that is taken off")
        )
    cues: list[WrittenCue] = []
    text = b""
    for number, at in enumerate(range(GENERAL_BYTES, len(content) - BLOCK_BYTES + 1, BLOCK_BYTES), start=1):
        block = content[at : at + BLOCK_BYTES]
        if block[3] == USER_DATA or block[15] == 1:
            continue
        text += block[TEXT_AT:]
        if block[3] != LAST_BLOCK:
            continue
        times = _seconds(block[5:9], rate) - start, _seconds(block[9:13], rate) - start
        words = _decode(text, table)
        text = b""
        if words:
            cues.append(WrittenCue(*times, words, number, markup=PLAIN_MARKUP))
    return cues, warnings


def _seconds(code: bytes | list[int], rate: float) -> float:
    hours, minutes, seconds, frames = code
    return hours * 3600 + minutes * 60 + seconds + frames / rate


def _decode(text: bytes, table: bytes) -> str:
    """Characters of a text field; codes of teletext and of its own are spaces and line ends."""
    lines = []
    for line in text.split(bytes([NEW_LINE])):
        plain = bytes(byte if 0x20 <= byte < 0x80 or byte >= 0xA0 else 0x20 for byte in line)
        found = plain.decode(_TABLES[table], errors="replace") if table in _TABLES else _latin(plain)
        lines.append(" ".join(found.split()))
    return "\n".join(line for line in lines if line)


def _latin(text: bytes) -> str:
    """Characters of ISO 6937, in which an accent stands before its letter."""
    found: list[str] = []
    accent = ""
    for byte in text:
        if byte in _ACCENTS:
            accent = _ACCENTS[byte]
            continue
        found.append(_UPPER.get(byte, chr(byte) if byte < 0x80 else " ") + accent)
        accent = ""
    return unicodedata.normalize("NFC", "".join(found))
