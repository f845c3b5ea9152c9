"""Recognition of phones in real speech without a transcript."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.recordings.folder import Recording, pronounce_recording
from tests.rendered_takes import manifest_rows
from tests.sound.conftest import HEARD_TOGETHER
from tts2face.sound.alignment import Aligner, HeardSound
from tts2face.sound.recogniser import ENGLISH, FRAME_S, PhoneRecogniser
from tts2face.sound.voice import Voice
from tts2face.types import Waveform

pytestmark = HEARD_TOGETHER
PART_S = 7.0  # of a sound in one call, instead of 24
EDITED = 0.4  # of the phones: 0.285 over 100 sentences of this talker (docs/decisions/036-raw-recordings.md)


@pytest.fixture(scope="module")
def recogniser(aligner: Aligner) -> PhoneRecogniser:
    return aligner.recogniser


def edits(written: list[str], recognised: list[str]) -> int:
    """Levenshtein distance."""
    row = list(range(len(recognised) + 1))
    for phone in written:
        before, row = row, [row[0] + 1]
        for number, other in enumerate(recognised):
            row.append(min(before[number] + (phone != other), before[number + 1] + 1, row[-1] + 1))
    return row[-1]


def test_most_phones_of_sentences_are_recognised(hear_take: Callable[[Path], HeardSound], takes: Path) -> None:
    rows = manifest_rows(takes)
    rows = rows[::80] if len(rows) >= 80 else rows
    wrong = total = 0
    for row in rows:
        video = takes / "clips" / f"{row['clip']}.mkv"
        words = pronounce_recording(Recording(row["clip"], video, row["transcript"], is_spelling=True))
        assert words is not None
        written = [phone for _, ways in words for phone in ways[0]]
        recognised = [phone for word in hear_take(video).words() for phone in word]
        wrong, total = wrong + edits(written, recognised), total + len(written)
    assert wrong / total < EDITED


def test_silence_holds_no_word(recogniser: PhoneRecogniser) -> None:
    assert recogniser.hear(Waveform(np.zeros(0), 16_000)).words() == ()


def test_a_long_sound_is_heard_as_its_parts(
    recogniser: PhoneRecogniser, heart: Voice, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tts2face.sound.recogniser.PART_S", PART_S)
    spoken = heart.speak("Nobody saw the dog again.").waveform.samples
    long = Waveform(np.concatenate([spoken] * int(1.5 * PART_S / (len(spoken) / heart.sample_rate))), heart.sample_rate)
    heard = recogniser.hear(long)
    assert len(heard.log_probabilities(tuple(ENGLISH))) == pytest.approx(long.duration / FRAME_S, abs=3)
    once = recogniser.hear(Waveform(spoken, heart.sample_rate)).words()
    words = heard.words()
    assert len(words) == pytest.approx(len(once) * len(long.samples) / len(spoken), abs=2)
