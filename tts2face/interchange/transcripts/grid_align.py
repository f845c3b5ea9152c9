"""Word alignments of the GRID corpus: start, end and word a line, in samples of 25 kHz."""

from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.subtitles.decoding import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

UNITS_PER_S = 25_000  # Cooke et al. 2006: samples of the 25 kHz sound


def read_align(path: Path) -> list[Tier]:
    """Words of an ``.align`` file."""
    cues = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields:
            continue
        if len(fields) != 3 or not (fields[0].isdecimal() and fields[1].isdecimal()):
            raise DataError(f"{path}, line {number}: {line[:60]!r} is not start, end and word; correct it")
        cues.append(SpokenCue(int(fields[0]) / UNITS_PER_S, int(fields[1]) / UNITS_PER_S, fields[2]))
    return [Tier("", tuple(cues), is_speech=True)]
