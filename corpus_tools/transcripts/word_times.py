"""Word alignments as the GRID corpus keeps them: start, end and word a line, in units of 1/25000 s."""

from pathlib import Path

from corpus_tools.recordings.subtitles import Cue
from corpus_tools.transcripts.decoding import read_text
from corpus_tools.transcripts.textgrid import SILENT_LABELS
from lexicon.errors import DataError

UNITS_PER_S = 25_000  # Cooke et al. 2006: samples of the 25 kHz sound


def read_word_times(path: Path) -> tuple[Cue, ...]:
    """The words of an .align file with their times, without silences.

    Raises
    ------
    DataError
        A line is not start, end and word, or there is no word.
    """
    cues = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields:
            continue
        if len(fields) != 3 or not (fields[0].isdecimal() and fields[1].isdecimal()):
            raise DataError(f"{path}, line {number}: {line[:60]!r} is not start, end and word; mend it")
        if fields[2].lower() not in SILENT_LABELS:
            cues.append(Cue(int(fields[0]) / UNITS_PER_S, int(fields[1]) / UNITS_PER_S, fields[2]))
    if not cues:
        raise DataError(f"{path} holds no word; check the file")
    return tuple(cues)
