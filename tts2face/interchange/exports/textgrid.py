"""Words and phones of a clip as a Praat TextGrid."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.interchange.exports.labels import AllLabels
from tts2face.interchange.exports.parts import Part, Target

Interval = tuple[float, float, str]
DECIMALS = 6  # of seconds; a sample of 192 kHz lasts 5 microseconds


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


def _rounded(edge: float, end: float) -> float:
    """An edge in whole microseconds, not after the end of the sound."""
    rounded = round(min(edge, end), DECIMALS)
    # a file that ends behind its sound is refused by programs that open both
    return rounded if rounded <= end else round(rounded - 10**-DECIMALS, DECIMALS)


def _written(seconds: float) -> str:
    return f"{seconds:.{DECIMALS}f}".rstrip("0").rstrip(".")


def _tier(number: int, name: str, intervals: Sequence[Interval]) -> Iterator[str]:
    yield f"    item [{number}]:"
    yield '        class = "IntervalTier"'
    yield f'        name = "{name}"'
    yield f"        xmin = {_written(intervals[0][0])}"
    yield f"        xmax = {_written(intervals[-1][1])}"
    yield f"        intervals: size = {len(intervals)}"
    for at, (start, end, label) in enumerate(intervals, start=1):
        quoted = label.replace('"', '""')
        yield from (
            f"        intervals [{at}]:",
            f"            xmin = {_written(start)}",
            f"            xmax = {_written(end)}",
        )
        yield f'            text = "{quoted}"'


def textgrid(phones: "PhoneSequence", words: Sequence["WordSpan"], *, note: str = "", end: float = math.inf) -> str:
    """Praat TextGrid with the tiers ``words`` and ``phones``, with at most `DECIMALS`; to be saved as UTF-8.

    A tier ``confidence`` says how probably the words of a recording are said, a tier ``note`` holds a given note.

    Parameters
    ----------
    end
        End of the sound in seconds, after which nothing ends.

    Raises
    ------
    InputError
        The words overlap or reach beyond the last phone.
    """
    # labels that begin behind the sound keep their own end
    last = min(end, phones.end) if end > phones.edges[-2] + 10**-DECIMALS else phones.end
    edges = [_rounded(float(edge), last) for edge in phones.edges]
    phones = PhoneSequence(phones.phones, edges)
    intervals = [
        (float(phones.edges[at]), float(phones.edges[at + 1]), label) for at, label in enumerate(phones.phones)
    ]
    tiers = [("words", list(_word_intervals(phones, words))), ("phones", intervals)]
    if any(word.confidence < 1.0 for word in words):
        sure = [replace(word, text=f"{word.confidence:.2f}") for word in words]
        tiers.append(("confidence", list(_word_intervals(phones, sure))))
    if note:
        tiers.append(("note", [(phones.start, phones.end, note)]))
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", f"xmin = {_written(phones.start)}"]
    lines += [f"xmax = {_written(phones.end)}", "tiers? <exists>", f"size = {len(tiers)}", "item []:"]
    for number, (name, intervals) in enumerate(tiers, start=1):
        lines += _tier(number, name, intervals)
    return "\n".join(lines) + "\n"


class TextGridWriter:
    """Collects labels, and writes the file when their number is known; UTF-8, times in seconds."""

    def __init__(self, target: Target) -> None:
        self._path, self._labels = target.path, AllLabels()
        self._end = 0.0  # of the sound in seconds

    def add(self, part: Part) -> None:
        """Keep the labels of a part."""
        self._labels.add(part)
        if part.clip is not None:
            self._end = part.begin + part.clip.speech.waveform.duration

    def finish(self) -> None:
        """Write the file."""
        self._labels.finish()
        phones = self._labels.phones
        edges = [phone.start for phone in phones] + [phones[-1].end]
        sequence = PhoneSequence([phone.text for phone in phones], edges)
        words = []
        for word in self._labels.words:
            # inside the phone: the edge itself may lie on either side by rounding
            first = sequence.index_at(word.start + sequence.durations.min() / 4)
            last = sequence.index_at(word.end - sequence.durations.min() / 4) + 1
            words.append(WordSpan(word.text, first, last, word.confidence))
        self._path.write_text(textgrid(sequence, words, end=self._end), encoding="utf-8", newline="\n")

    def close(self) -> None:
        """Nothing is open."""
