"""Forced alignment."""

from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tests.rendered_takes import manifest_rows
from tts2face.sound.alignment import Aligner, acoustic_phones, enforce_increasing
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Waveform

WORDS = [("bob", [("b", "ɑ", "b")]), ("may", [("m", "eɪ")]), ("read", [("ɹ", "i", "d"), ("ɹ", "ɛ", "d")])]


@pytest.fixture(scope="module")
def aligner() -> Aligner:
    return Aligner()


@pytest.fixture(scope="module")
def sound() -> Waveform:
    return load_voice("heart", "en-us").speak("Bob may read.").waveform


def test_phones_cover_the_sound_and_words_their_phones(aligner: Aligner, sound: Waveform) -> None:
    found = aligner.align(sound, WORDS)
    assert found.phones.start == 0.0
    assert found.phones.end == sound.duration
    spoken = ["".join(found.phones.phones[word.first : word.last]) for word in found.words]
    assert spoken == ["bɑb", "meɪ", "ɹid"]


def test_of_several_pronunciations_the_fitting_one_is_taken(aligner: Aligner, sound: Waveform) -> None:
    swapped = [*WORDS[:2], ("read", [("ɹ", "ɛ", "d"), ("ɹ", "i", "d")])]
    found = aligner.align(sound, swapped)
    assert found.phones.phones[found.words[2].first : found.words[2].last] == ("ɹ", "i", "d")


def test_silence_before_moves_every_edge_by_its_length(aligner: Aligner, sound: Waveform) -> None:
    """20 ms: two frames of the model on either side."""
    later = Waveform(np.concatenate([np.zeros(round(0.3 * sound.rate)), sound.samples]), sound.rate)
    plain, moved = aligner.align(sound, WORDS), aligner.align(later, WORDS)
    first, last = plain.words[0].first, plain.words[-1].last
    shift = moved.words[0].first - first
    edges = moved.phones.edges[first + shift : last + shift + 1] - plain.phones.edges[first : last + 1]
    assert edges == pytest.approx(np.full(len(edges), 0.3), abs=0.02)


def test_level_does_not_matter(aligner: Aligner, sound: Waveform) -> None:
    quiet = Waveform(sound.samples * 0.1, sound.rate)
    assert aligner.align(quiet, WORDS).phones.edges == pytest.approx(aligner.align(sound, WORDS).phones.edges, abs=0.02)


def test_no_words_are_refused(aligner: Aligner, sound: Waveform) -> None:
    with pytest.raises(DataError, match="no word to align"):
        aligner.align(sound, [])


def test_sound_without_these_words_is_refused(aligner: Aligner) -> None:
    with pytest.raises(DataError, match="check the transcript"):
        aligner.align(Waveform(np.zeros(1600), 16000), [WORDS[0]] * 30)


def test_phones_that_the_model_lacks_are_aligned_as_the_nearest_ones() -> None:
    assert acoustic_phones(["y", "p", "ə"])[1:] == ["P", "AH"]


@pytest.mark.parametrize(
    ("edges", "moved"),
    [
        ([0.0, 0.1, 0.2], [0.0, 0.1, 0.2]),
        ([0.0, 0.1, 0.1, 0.2], [0.0, 0.1, 0.105, 0.2]),
        ([0.0, 0.2, 0.1, 0.3], [0.0, 0.2, 0.205, 0.3]),
        ([0.0, 0.3, 0.3, 0.3], [0.0, 0.29, 0.295, 0.3]),
        ([0.0, 0.0, 0.001], [0.0, 0.0005, 0.001]),
    ],
)
def test_edges_increase(edges: list[float], moved: list[float]) -> None:
    assert enforce_increasing(np.array(edges)) == pytest.approx(moved)


def test_recordings_agree_with_their_word_times(aligner: Aligner, takes: Path) -> None:
    """GRID's own word times: median within 30 ms (they are themselves automatic); a wrong transcript fits worse."""
    from lexicon.dictionary import cmudict_lookup
    from tts2face.video.media import read_sound

    rows = manifest_rows(takes)
    rows = rows[:200:20] if len(rows) >= 200 else rows[:10]
    errors: list[float] = []
    right: list[float] = []
    wrong: list[float] = []
    for row, other in zip(rows, rows[1:] + rows[:1], strict=True):
        sound = read_sound(takes / "clips" / f"{row['clip']}.mkv", 16000)
        transcripts = []
        for transcript in (row["transcript"], other["transcript"]):
            words = [word for word in transcript.split() if len(word) > 1]
            transcripts.append([(word, [tuple(s.phone for s in cmudict_lookup(word) or ())]) for word in words])
        found = aligner.align(sound, transcripts[0])
        right.append(found.confidence)
        try:
            wrong.append(aligner.align(sound, transcripts[1]).confidence)
        except DataError:  # the words are not found at all
            wrong.append(-np.inf)
        known = [line.split() for line in (takes / "align" / f"{row['clip']}.align").read_text().splitlines()]
        starts = {word: int(start) / 25000 for start, _, word in known}
        errors += [found.phones.edges[word.first] - starts[word.text] for word in found.words if word.text in starts]
    assert np.median(np.abs(errors)) < 0.03
    assert np.mean(np.array(right) > np.array(wrong)) >= 0.9
