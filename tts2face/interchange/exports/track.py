"""Lossless track of a clip as JSON, one piece of the clip on each line, and its reader.

Numbers are written so that they are read back to the same 32 or 64 bits. The sound of each piece is the base64 of its
little-endian 32-bit samples.
"""

import base64
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.values.checks import EXPECTED, Place, check_type, list_of, typed
from lexicon.values.files import check_regular_file
from lexicon.values.json_text import parse_json
from tts2face.interchange.exports.frame_grid import frame_rows
from tts2face.interchange.exports.parts import Part, Target
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

FORMAT_NAME = "tts2face-track"
VERSION = 1
FLOAT32_FORMAT = "%.9g"  # nine digits identify every 32-bit number
MAX_LINE_BYTES = 2_000_000_000  # of a piece: an hour at 48 kHz and 30 frames/s in one piece takes 1.1 GB
_NEGATIVE_ZERO = re.compile(r"(?<![^,])-0(?![^,])")  # a JSON integer, which would lose its sign
OPENING, CLOSING = '"pieces": [', "]}"
RECORDED = "is_recorded"  # in the header, where the sound is that of a recording
_TEXTS, _NUMBERS = (list_of(typed(kind), expected=EXPECTED[list]) for kind in (str, float))
_PIECE_NAMES = ("motion", "head", "phones", "edges", "words", "text", "samples")


@dataclass(frozen=True, slots=True, eq=False)
class TrackPiece:
    """A piece of a track: a clip, and its written text, which may be empty."""

    clip: Clip
    text: str


class TrackWriter:
    """Appends pieces as they arrive."""

    def __init__(self, target: Target) -> None:
        self._file = target.path.open("w", encoding="utf-8", newline="\n")
        self._is_empty = True
        header = {
            "format": FORMAT_NAME,
            "version": VERSION,
            "channels": list(target.channels),
            "head_channels": list(HEAD_CHANNELS),
        }
        self._header, self._target = header, target

    def add(self, part: Part) -> None:
        """Append a piece."""
        if part.clip is None:
            return
        if self._is_empty:
            header = self._header | {"fps": part.clip.fps, "rate": self._target.rate}
            header |= {RECORDED: True} if part.clip.speech.is_recorded else {}
            self._file.write(f"{json.dumps(header, ensure_ascii=False)[:-1]}, {OPENING}\n")
        else:
            self._file.write(",\n")
        self._is_empty = False
        self._write_piece(part.clip, part.text)

    def finish(self) -> None:
        """Complete the file."""
        self._file.write(f"\n{CLOSING}\n")
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write_piece(self, clip: Clip, text: str) -> None:
        speech = clip.speech
        self._file.write('{"motion": [')
        self._write_rows(clip.motion.values)
        self._file.write('], "head": [')
        self._write_rows(clip.head.values)
        labels = {
            "phones": list(speech.phones.phones),
            "edges": speech.phones.edges.tolist(),
            "words": [[word.text, word.first, word.last, word.confidence] for word in speech.words],
            "text": text,
        }
        self._file.write(f"], {json.dumps(labels, ensure_ascii=False)[1:-1]}, ")
        encoded = base64.b64encode(speech.waveform.samples.astype("<f4").tobytes()).decode()
        self._file.write(f'"samples": "{encoded}"}}')

    def _write_rows(self, values: NDArray[np.float32]) -> None:
        rows = frame_rows(values, FLOAT32_FORMAT)
        # -0.0 and 0.0 are written alike, but the track is lossless
        if (np.signbit(values) & (values == 0)).any():
            rows = (_NEGATIVE_ZERO.sub("-0.0", row) for row in rows)
        self._file.write(",".join(f"[{row}]" for row in rows))


def read_track(path: Path) -> Iterator[TrackPiece]:
    """Read the pieces of a track one after another, each of bounded size.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        It cannot be read, or is not a track.
    """
    if not path.exists():
        raise InputError(f"there is no track {path}; check the path")
    check_regular_file(path)
    try:
        with path.open(encoding="utf-8-sig") as file:
            yield from _read_pieces(file, path)
    except UnicodeDecodeError as broken:
        raise DataError(f"{path} is not UTF-8 text (byte {broken.start}); export it again") from broken
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused


def _read_pieces(file: TextIO, path: Path) -> Iterator[TrackPiece]:
    first = _read_line(file, path)
    if not first.endswith(OPENING):  # written by another program: read as a whole
        content = first + "\n" + file.read(MAX_LINE_BYTES)
        whole = _parse_object(content, str(path), path)
        header = _check_header(whole, path)
        pieces = whole.get("pieces")
        if not isinstance(pieces, list) or not pieces:
            raise _not_a_track(path, "it has no list of pieces")
        for number, piece in enumerate(pieces, start=1):
            yield _parse_piece(piece, header, f"{path}, piece {number}")
        return
    header = _check_header(_parse_object(first + CLOSING, str(path), path), path)
    number = 0
    while (line := _read_line(file, path)) != CLOSING:
        number += 1
        if not line:
            raise _not_a_track(path, "it ends before its last piece is complete")
        name = f"{path}, piece {number}"
        yield _parse_piece(_parse_object(line.removesuffix(","), name, path), header, name)
    if number == 0:
        raise _not_a_track(path, "it has no piece")


def _read_line(file: TextIO, path: Path) -> str:
    line = file.readline(MAX_LINE_BYTES + 1)
    if len(line) > MAX_LINE_BYTES:
        raise DataError(f"a line of {path} has more than {MAX_LINE_BYTES / 1e6:.0f} MB; divide it into smaller pieces")
    return line.strip()


def _parse_object(text: str, name: str, path: Path) -> Mapping[str, Any]:
    parsed = parse_json(text, name)
    if not isinstance(parsed, dict):
        raise _not_a_track(path, "it is not a JSON object")
    return parsed


def _not_a_track(path: Path, why: str) -> DataError:
    return DataError(f"{path} is not a track of tts2face: {why}; write it with --export clip.track.json")


def _check_header(header: Mapping[str, Any], path: Path) -> Mapping[str, Any]:
    if header.get("format") != FORMAT_NAME:
        raise _not_a_track(path, f"its format is {str(header.get('format'))[:40]!r}, not {FORMAT_NAME!r}")
    if header.get("version") != VERSION:
        raise DataError(f"{path} has version {header.get('version')} of the track format; this program reads {VERSION}")
    if header.get("head_channels") != list(HEAD_CHANNELS):
        raise _not_a_track(path, f"its head_channels are not {', '.join(HEAD_CHANNELS)}")
    try:
        _TEXTS(header.get("channels"), Place("channels"))
        for name, kind in (("fps", float), ("rate", int)):
            check_type(name, header.get(name), kind)
    except InputError as wrong:
        raise _not_a_track(path, str(wrong)) from wrong
    return header


def _parse_piece(piece: Any, header: Mapping[str, Any], name: str) -> TrackPiece:
    if not isinstance(piece, dict) or set(piece) != set(_PIECE_NAMES):
        raise DataError(f"{name}: a piece needs exactly {', '.join(_PIECE_NAMES)}; export the track again")
    try:
        samples = np.frombuffer(base64.b64decode(piece["samples"], validate=True), "<f4")
        phones = PhoneSequence(_TEXTS(piece["phones"], Place("phones")), _NUMBERS(piece["edges"], Place("edges")))
        words = tuple(_word(*check_type("each word", word, list)) for word in check_type("words", piece["words"], list))
        fps = float(header["fps"])
        return TrackPiece(
            Clip(
                Trajectory(header["channels"], _rows(piece["motion"], len(header["channels"])), fps),
                Trajectory(HEAD_CHANNELS, _rows(piece["head"], len(HEAD_CHANNELS)), fps),
                Speech(Waveform(samples, header["rate"]), phones, words, header.get(RECORDED) is True),
            ),
            check_type("text", piece["text"], str),
        )
    # a track may come from anybody
    except (TypeError, ValueError) as wrong:  # InputError, wrong base64, rows of unequal length
        raise DataError(f"{name}: {wrong}; export the track again") from wrong


def _word(text: Any, first: Any, last: Any, confidence: Any = 1.0) -> WordSpan:
    return WordSpan(
        check_type("a word", text, str),
        check_type("a phone of a word", first, int),
        check_type("a phone of a word", last, int),
        check_type("the confidence of a word", confidence, float),
    )


def _rows(values: Any, width: int) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):  # infinity is refused
        rows = np.array(values, np.float64).astype(np.float32)
    return rows.reshape(-1, width) if not rows.size else rows
