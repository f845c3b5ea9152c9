"""Words and phones of a text as a table, JSON and a Praat TextGrid, with nominal durations or those of a voice."""

import json
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from tts2face.interchange.exports.textgrid import textgrid

if TYPE_CHECKING:
    from lexicon.pronounce import Pronunciation, Word

NOMINAL_NOTE = "nominal durations: no voice has spoken this"


def pronunciation_table(pronunciation: "Pronunciation") -> str:
    """Table with one line for each word: written form, spoken form, IPA, and ARPABET for English."""
    rows = [("written", "said", "IPA", "ARPABET")]
    rows += [(w.source, w.text + w.mark, w.ipa, " ".join(w.arpabet)) for w in pronunciation.words]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = [
        "  ".join([*(cell.ljust(width) for cell, width in zip(row[:3], widths, strict=True)), row[3]]) for row in rows
    ]
    return "".join(f"{line.rstrip()}\n" for line in lines)


def _word_json(word: "Word") -> dict[str, Any]:
    return {
        "text": word.text,
        "source": word.source,
        "ipa": word.ipa,
        "phones": list(word.phones),
        "stress": list(word.stress),
        "arpabet": list(word.arpabet),
        "syllables": [list(span) for span in word.syllables],
        "mark": word.mark,
    }


def pronunciation_json(pronunciation: "Pronunciation") -> str:
    """Words as JSON with phones, stress and syllables (half-open ranges of the word's phones)."""
    content = {
        "text": pronunciation.text,
        "language": pronunciation.language,
        "words": [_word_json(word) for word in pronunciation.words],
    }
    return json.dumps(content, ensure_ascii=False, indent=2) + "\n"


def pronunciation_textgrid(pronunciation: "Pronunciation") -> str:
    """TextGrid with nominal durations, for a text without synthesised speech, and a tier that states this."""
    from lexicon.nominal_durations import nominal_phones

    phones, words = nominal_phones(pronunciation)
    return textgrid(phones, words, note=NOMINAL_NOTE)


FORMATS: Mapping[str, Callable[["Pronunciation"], str]] = MappingProxyType(
    {"text": pronunciation_table, "json": pronunciation_json, "textgrid": pronunciation_textgrid}
)
