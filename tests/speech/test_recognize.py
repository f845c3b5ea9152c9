"""Recognition of phones in real speech without a transcript."""

from pathlib import Path

import numpy as np
import pytest

from corpus_tools.recordings.folder import Recording, pronounce_recording
from lexicon.errors import InputError
from tests.rendered_takes import manifest_rows
from tts2face.sound.alignment import acoustic_phones
from tts2face.sound.listener import MAX_SOUND_S, PhoneRecogniser
from tts2face.types import Waveform
from tts2face.video.media import read_sound

EDITED = 0.4  # of the phones: 0.285 over 100 sentences of this talker (docs/decisions/036-raw-recordings.md)


@pytest.fixture(scope="module")
def recogniser() -> PhoneRecogniser:
    pytest.importorskip("hama", reason="needs `pip install 'tts2face[capture]'`")
    return PhoneRecogniser()


def edits(written: list[str], recognised: list[str]) -> int:
    """Levenshtein distance."""
    row = list(range(len(recognised) + 1))
    for phone in written:
        before, row = row, [row[0] + 1]
        for number, other in enumerate(recognised):
            row.append(min(before[number] + (phone != other), before[number + 1] + 1, row[-1] + 1))
    return row[-1]


def test_most_phones_of_sentences_are_recognised(recogniser: PhoneRecogniser, takes: Path) -> None:
    rows = manifest_rows(takes)
    rows = rows[::80] if len(rows) >= 80 else rows
    wrong = total = 0
    for row in rows:
        video = takes / "clips" / f"{row['clip']}.mkv"
        words = pronounce_recording(Recording(row["clip"], video, row["transcript"], is_spelling=True))
        assert words is not None
        written = acoustic_phones([phone for _, ways in words for phone in ways[0]])
        recognised = acoustic_phones([phone for word in recogniser.words(read_sound(video, 16_000)) for phone in word])
        wrong, total = wrong + edits(written, recognised), total + len(written)
    assert wrong / total < EDITED


def test_silence_holds_no_word(recogniser: PhoneRecogniser) -> None:
    assert recogniser.words(Waveform(np.zeros(0), 16_000)) == ()


def test_a_sound_that_is_too_long(recogniser: PhoneRecogniser) -> None:
    with pytest.raises(InputError, match="in sounds of at most 30 s"):
        recogniser.words(Waveform(np.zeros(round((MAX_SOUND_S + 1) * 16_000)), 16_000))
