"""Word alignments of the GRID corpus: start, end and word a line, in samples of 25 kHz."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median

from lexicon.errors import DataError
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

UNITS_PER_S = 25_000  # Cooke et al. 2006: samples of the 25 kHz sound
# Units of other programs, with their names.
OTHER_UNITS = ((1000, "milliseconds"), (10_000_000, "units of 100 ns"))
WORD_S = (0.03, 5.0)  # within which half of the words and silences of speech last


def read_align(path: Path) -> list[Tier]:
    """Words of an ``.align`` file; where samples of 25 kHz cannot be meant, in the unit that can, with a note."""
    rows: list[tuple[int, int, str]] = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields:
            continue
        if len(fields) != 3 or not (fields[0].isdecimal() and fields[1].isdecimal()):
            raise DataError(f"{path}, line {number}: {line[:60]!r} is not start, end and word; correct it")
        rows.append((int(fields[0]), int(fields[1]), fields[2]))
    rate, notes = _units(rows, path)
    cues = tuple(SpokenCue(start / rate, end / rate, word) for start, end, word in rows)
    return [Tier("", cues, is_speech=True, notes=notes)]


def _units(rows: Sequence[tuple[int, int, str]], path: Path) -> tuple[int, tuple[str, ...]]:
    """Units a second of the times, and a note where they are not those of the corpus."""
    lengths = [end - start for start, end, _ in rows if end > start]
    if not lengths:
        return UNITS_PER_S, ()
    usual = median(lengths)
    if WORD_S[0] <= usual / UNITS_PER_S <= WORD_S[1]:
        return UNITS_PER_S, ()
    for rate, name in OTHER_UNITS:
        if WORD_S[0] <= usual / rate <= WORD_S[1]:
            reason = f"as samples of 25 kHz half of its words last {usual / 25:g} ms"
            return rate, (f"times of {path.name} are read as {name}: {reason}",)
    raise DataError(
        f"{path} has times that are no samples of 25 kHz: half of its words would last {usual / UNITS_PER_S:g} s; "
        "write samples, or milliseconds"
    )
