"""Pronunciations and timed phones as text; Praat itself reads the TextGrids."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import parselmouth
import pytest
from parselmouth.praat import call

from lexicon.errors import InputError
from lexicon.nominal_durations import nominal_phones
from lexicon.pronounce import pronounce
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.interchange.exports.pronunciation import FORMATS, NOMINAL_NOTE
from tts2face.interchange.exports.textgrid import textgrid

pytestmark = pytest.mark.formats

PHONES = PhoneSequence(["sil", "p", "ɑ", "sil", "y", "sil"], [0.0, 0.1, 0.25, 0.4, 0.5, 0.75, 1.0])
WORDS = (WordSpan('pa "x"', 1, 3), WordSpan("ü", 4, 5))


def _tier(grid: Any, number: int) -> list[tuple[float, float, str]]:
    count = int(call(grid, "Get number of intervals", number))
    return [
        (
            call(grid, "Get start time of interval", number, at),
            call(grid, "Get end time of interval", number, at),
            call(grid, "Get label of interval", number, at),
        )
        for at in range(1, count + 1)
    ]


def _read(text: str, folder: Path) -> Any:
    path = folder / "made.TextGrid"
    path.write_text(text, encoding="utf-8")
    return parselmouth.read(str(path))


def test_praat_reads_times_and_labels_back(tmp_path: Path) -> None:
    grid = _read(textgrid(PHONES, WORDS), tmp_path)
    assert int(call(grid, "Get number of tiers")) == 2
    assert [call(grid, "Get tier name", number) for number in (1, 2)] == ["words", "phones"]
    phones = _tier(grid, 2)
    assert [label for _, _, label in phones] == list(PHONES.phones)
    assert np.allclose([start for start, _, _ in phones], PHONES.edges[:-1], rtol=0, atol=1e-12)
    assert [(label, start, end) for start, end, label in _tier(grid, 1)] == [
        ("", 0.0, 0.1), ('pa "x"', 0.1, 0.4), ("", 0.4, 0.5), ("ü", 0.5, 0.75), ("", 0.75, 1.0),
    ]  # fmt: skip


def test_praat_reads_nominal_times_and_their_note(tmp_path: Path) -> None:
    spoken = pronounce("Hello, Bob.")
    grid = _read(FORMATS["textgrid"](spoken), tmp_path)
    phones, _ = nominal_phones(spoken)
    assert [label for _, _, label in _tier(grid, 2)] == list(phones.phones)
    assert [label for _, _, label in _tier(grid, 3)] == [NOMINAL_NOTE]


@pytest.mark.parametrize("end", [1 - 1e-9, 0.9999994, 1 / 1.00000049, 0.98765432198])
def test_edges_have_six_decimals_and_none_is_after_the_sound(end: float) -> None:
    thirds = PhoneSequence(["sil", "p", "ɑ", "sil"], [0.0, 1 / 3, 0.1 + 0.2 + 1 / 3, 0.95, 1.0])
    written = textgrid(thirds, [WordSpan("pa", 1, 3)], end=end)
    seconds = re.findall(r"xm(?:in|ax) = (\S+)", written)
    assert max(len(number.partition(".")[2]) for number in seconds) == 6
    assert end - 1e-6 <= max(map(float, seconds)) <= end
    assert seconds.count("0.333333") == 4


def test_words_in_disorder_are_refused() -> None:
    with pytest.raises(InputError, match="the word 'b' overlaps the previous word"):
        textgrid(PHONES, [WordSpan("a", 1, 3), WordSpan("b", 2, 4)])
    with pytest.raises(InputError, match=r"word 'c' .* ends after the last phone"):
        textgrid(PHONES, [WordSpan("c", 1, 9)])


def test_json_of_a_pronunciation() -> None:
    content = json.loads(FORMATS["json"](pronounce("$5!")))
    assert [word["text"] for word in content["words"]] == ["five", "dollars"]
    assert content["words"][1] == {
        "text": "dollars", "source": "$5", "ipa": "ˈdɑ.lɚz", "phones": ["d", "ɑ", "l", "ɚ", "z"],
        "stress": [0, 1, 0, 0, 0],
        "arpabet": ["D", "AA1", "L", "ER0", "Z"], "syllables": [[0, 2], [2, 5]], "mark": "!",
    }  # fmt: skip


def test_table_of_a_pronunciation() -> None:
    assert FORMATS["text"](pronounce("Pay $5.")).splitlines() == [
        "written  said      IPA      ARPABET",
        "Pay      Pay       ˈpeɪ     P EY1",
        "$5       five      ˈfaɪv    F AY1 V",
        "$5       dollars.  ˈdɑ.lɚz  D AA1 L ER0 Z",
    ]
