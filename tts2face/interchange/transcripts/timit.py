"""Words of TIMIT: ``.wrd`` with start, end and word in samples of 16 kHz, and prompts behind the span of a file."""

import re
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

RATE = 16_000  # Hz; Garofolo et al. 1993
_PROMPT = re.compile(r"\s*(0) (\d{4,7}) ([^\W\d].*)\s*")


def is_timit_prompt(text: str) -> bool:
    """Whether a text is one line of a span in samples and a sentence."""
    return _PROMPT.fullmatch(text) is not None


def read_timit(path: Path) -> list[Tier]:
    """Words of a ``.wrd``, or the sentence of a prompt."""
    text = read_text(path)
    prompt = _PROMPT.fullmatch(text)
    rows = [prompt.groups()] if prompt else [line.split(maxsplit=2) for line in text.splitlines() if line.strip()]
    labels = []
    for row in rows:
        if len(row) != 3 or not (row[0].isdecimal() and row[1].isdecimal()):
            raise DataError(f"{path}: {' '.join(row)[:60]!r} is not start, end and word in samples; correct it")
        labels.append(SpokenCue(int(row[0]) / RATE, int(row[1]) / RATE, row[2].strip()))
    return [Tier("", tuple(labels), is_speech=True, notes=(f"times of {path.name} are read as samples of 16 kHz",))]
