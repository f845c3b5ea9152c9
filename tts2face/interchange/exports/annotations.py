"""Words and phones as tables, JSON and Praat TextGrids, with the times of a voice or nominal durations.

Words and phones of a clip as a Praat TextGrid.

The sound of a clip as a 16-bit .wav file.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.interchange.exports.parts import AllLabels, Part, Target, part_words
from tts2face.storage.wave_files import open_wave, pcm_bytes

if TYPE_CHECKING:
    from lexicon.pronounce import Pronunciation, Word


NOMINAL_NOTE = "nominal durations: no voice has spoken this"
Interval = tuple[float, float, str]


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
    from lexicon.sequence import nominal_phones

    phones, words = nominal_phones(pronunciation)
    return textgrid(phones, words, note=NOMINAL_NOTE)


FORMATS: Mapping[str, Callable[["Pronunciation"], str]] = MappingProxyType(
    {"text": pronunciation_table, "json": pronunciation_json, "textgrid": pronunciation_textgrid}
)


def _word_intervals(phones: "PhoneSequence", words: Sequence["WordSpan"]) -> Iterator[Interval]:
    """Yield contiguous intervals of the words and of the empty spans between them."""
    at = 0
    for word in words:
        if word.first < at or word.last > len(phones):
            raise InputError(f"the word {word.text!r} overlaps the previous word or ends after the last phone")
        if word.first > at:
            yield float(phones.edges[at]), float(phones.edges[word.first]), ""
        yield float(phones.edges[word.first]), float(phones.edges[word.last]), word.text
        at = word.last
    if at < len(phones):
        yield float(phones.edges[at]), phones.end, ""


def _tier(number: int, name: str, intervals: Sequence[Interval]) -> Iterator[str]:
    yield f"    item [{number}]:"
    yield '        class = "IntervalTier"'
    yield f'        name = "{name}"'
    yield f"        xmin = {intervals[0][0]!r}"
    yield f"        xmax = {intervals[-1][1]!r}"
    yield f"        intervals: size = {len(intervals)}"
    for at, (start, end, label) in enumerate(intervals, start=1):
        quoted = label.replace('"', '""')
        yield from (f"        intervals [{at}]:", f"            xmin = {start!r}", f"            xmax = {end!r}")
        yield f'            text = "{quoted}"'


def textgrid(phones: "PhoneSequence", words: Sequence["WordSpan"], *, note: str = "") -> str:
    """Praat TextGrid with the tiers ``words`` and ``phones``; to be saved as UTF-8.

    A tier ``confidence`` tells how probably the words of a recording are said, a tier ``note`` holds a given note.

    Raises
    ------
    InputError
        The words overlap or reach beyond the last phone.
    """
    intervals = [
        (float(phones.edges[at]), float(phones.edges[at + 1]), label) for at, label in enumerate(phones.phones)
    ]
    tiers = [("words", list(_word_intervals(phones, words))), ("phones", intervals)]
    if any(word.confidence < 1.0 for word in words):
        sure = [replace(word, text=f"{word.confidence:.2f}") for word in words]
        tiers.append(("confidence", list(_word_intervals(phones, sure))))
    if note:
        tiers.append(("note", [(phones.start, phones.end, note)]))
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", f"xmin = {phones.start!r}"]
    lines += [f"xmax = {phones.end!r}", "tiers? <exists>", f"size = {len(tiers)}", "item []:"]
    for number, (name, intervals) in enumerate(tiers, start=1):
        lines += _tier(number, name, intervals)
    return "\n".join(lines) + "\n"


class WordLinesWriter:
    """Writer of one JSON object for each word: start and end in seconds, and how probably a recording has it there."""

    def __init__(self, target: Target) -> None:
        self._file = target.open_lines()

    def add(self, part: Part) -> None:
        """Append the words of a part."""
        for word in part_words(part):
            record = {"start": round(word.start, 9), "end": round(word.end, 9), "word": word.text}
            record["confidence"] = round(word.confidence, 3)
            self._file.write(json.dumps(record, ensure_ascii=False) + "\n")

    def finish(self) -> None:
        """Close the file."""
        self._file.close()

    close = finish


class TextGridWriter:
    """Collects labels, and writes the file when their number is known; UTF-8, times in seconds."""

    def __init__(self, target: Target) -> None:
        self._path, self._labels = target.path, AllLabels()

    def add(self, part: Part) -> None:
        """Keep the labels of a part."""
        self._labels.add(part)

    def finish(self) -> None:
        """Write the file."""
        self._labels.finish()
        phones = self._labels.phones
        edges = [phone.start for phone in phones] + [phones[-1].end]
        sequence = PhoneSequence([phone.text for phone in phones], edges)
        words = []
        for word in self._labels.words:
            first = sequence.index_at(word.start + sequence.durations.min() / 4)
            last = sequence.index_at(word.end - sequence.durations.min() / 4) + 1
            words.append(WordSpan(word.text, first, last, word.confidence))
        self._path.write_text(textgrid(sequence, words), encoding="utf-8", newline="\n")

    def close(self) -> None:
        """Nothing is open."""


MAX_SAMPLES = (2**32 - 64) // 2  # a .wav file states its size in bytes in 32 bits


class WavWriter:
    """Appends sound; a clip that ended within a frame is padded with silence."""

    def __init__(self, target: Target) -> None:
        self._file = open_wave(str(target.path), target.rate)
        self._n_samples, self._name = 0, target.name

    def add(self, part: Part) -> None:
        """Append the sound of a part."""
        if part.clip is None:
            return
        samples = part.clip.speech.waveform.samples
        if part.begin_sample + len(samples) > MAX_SAMPLES:
            hours = MAX_SAMPLES / part.clip.speech.waveform.rate / 3600
            raise InputError(f"{self._name} would have more than 4 GB, {hours:.0f} hours; export shorter clips")
        padding = part.begin_sample - self._n_samples
        self._file.writeframesraw(bytes(2 * max(padding, 0)))
        self._file.writeframesraw(pcm_bytes(samples))
        self._n_samples = part.begin_sample + len(samples)

    def finish(self) -> None:
        """Complete the header."""
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
