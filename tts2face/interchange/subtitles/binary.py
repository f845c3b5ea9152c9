"""Files of subtitles that are no text: pictures and archives, of which one sentence says what they are."""

from lexicon.errors import DataError

HEAD_BYTES = 512
_PICTURES = "pictures of subtitles, no text"
_READ_BY = "read them with a program that recognises text in pictures (OCR), and export .srt"
_HEADS = (
    (b"PG", f"holds {_PICTURES} (PGS of a Blu-ray); {_READ_BY}"),
    (b"\x00\x00\x01\xba", f"holds {_PICTURES} (VobSub of a DVD); {_READ_BY}"),
    (b"# VobSub index file", f"is the index of {_PICTURES} (VobSub of a DVD); {_READ_BY}"),
    (b"PK\x03\x04", "is a ZIP archive; unpack it and give the file within"),
    (b"Rar!", "is a RAR archive; unpack it and give the file within"),
    (b"7z\xbc\xaf\x27\x1c", "is a 7z archive; unpack it and give the file within"),
    (b"\x1f\x8b", "is a gzip archive; unpack it and give the file within"),
    (b"%PDF", "is a PDF file; export the subtitles as .srt"),
)
_PGS_SEGMENTS = (b"\x14", b"\x15", b"\x16", b"\x17", b"\x80")  # their types
_FILM_HEADS = (b"\x1aE\xdf\xa3", b"OggS", b"RIFF")  # Matroska and WebM, Ogg, AVI
_FILM_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")  # ISO base media file format, QuickTime
EBU_STL = b"STL"


def check_text(head: bytes, name: str) -> None:
    """Refuse the head of a file that is known to hold no text (`DataError`)."""
    for mark, reason in _HEADS:
        if head.startswith(mark) and (mark != b"PG" or head[10:11] in _PGS_SEGMENTS):
            raise DataError(f"{name} {reason}")


def is_film(head: bytes) -> bool:
    """Whether a file is a container of films, in which a track of subtitles may lie."""
    is_transport = len(head) > 188 and head[0] == head[188] == 0x47
    return head.startswith(_FILM_HEADS) or head[4:8] in _FILM_BOXES or is_transport


def is_ebu(head: bytes) -> bool:
    """Whether a file is EBU STL (EBU Tech 3264): its first block names the frames a second."""
    return head[3:6] == EBU_STL and head[8:11] == b".01"
