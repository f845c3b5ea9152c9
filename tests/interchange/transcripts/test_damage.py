"""Damaged files of every format are read or refused, whatever is broken."""

import contextlib
import json

import numpy as np
import parselmouth
import pytest
from parselmouth.praat import call

from lexicon.errors import DataError
from tests.interchange.transcripts.grids import WORDS, textgrid
from tests.interchange.transcripts.test_annotations import CHA, EXB, UTTERANCES, WORD_TIER, eaf, tier
from tests.interchange.transcripts.test_recogniser_json import GENTLE, SEGMENTS
from tests.interchange.transcripts.test_tables import CTM, HTK, TIMIT, XLABEL
from tests.interchange.transcripts.test_written_words import PANEL, PRAAT_TABLE, TSV, WHISPER
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.interchange.transcripts.written_words import read_written_words

WHOLE = {
    "v.TextGrid": textgrid(words=WORDS), "v.eaf": eaf(WORD_TIER.format("") + tier(UTTERANCES)), "v.exb": EXB,
    "v.cha": CHA, "v.ctm": CTM, "v.lab": HTK, "x.lab": XLABEL, "v.wrd": TIMIT, "v.stm": "v 1 a 0.5 1.5 <o> bin red\n",
    "v.tsv": TSV, "w.tsv": PRAAT_TABLE, "v.json": json.dumps({"segments": SEGMENTS, "words": GENTLE}), "x.log": WHISPER,
    "y.log": PANEL,
}  # fmt: skip


@pytest.mark.parametrize("name", [*WHOLE, "binary.TextGrid"])
def test_damage_is_read_or_refused(name, tmp_path):
    generator = np.random.default_rng(7)
    path = tmp_path / name
    path.write_text(WHOLE.get(name, WHOLE["v.TextGrid"]), encoding="utf-8")
    if name.startswith("binary"):
        call(parselmouth.read(str(path)), "Save as binary file...", str(path))
    whole = np.frombuffer(path.read_bytes(), np.uint8)
    for number in range(150):
        damaged = whole[: generator.integers(1, len(whole) + 1)].copy() if number % 2 else whole.copy()
        for at in generator.integers(0, len(damaged), generator.integers(1, 6)):
            damaged[at] = generator.choice([*b'0123456789.-"<>\n\t e', generator.integers(0, 256)])
        path.write_bytes(damaged.tobytes())
        with contextlib.suppress(DataError):
            read_written_words(path)


@pytest.mark.parametrize("number", ["1e999", "-1", "0.5", "--undefined--", "1e400/2", "5/0"])
def test_wrong_numbers_of_intervals(number, tmp_path):
    path = tmp_path / "v.TextGrid"
    path.write_text(textgrid(words=WORDS).replace("intervals: size = 8", f"intervals: size = {number}"))
    with pytest.raises(DataError, match="damaged TextGrid: line 14"):
        read_transcript(path)
