"""Phones and words of consecutive clips on the time axis of the whole."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from lexicon.sequence import SILENCE
from tts2face.interchange.exports.parts import Part


@dataclass(frozen=True, slots=True)
class Label:
    """A phone or word from `start` to `end`, in seconds of the whole, and the probability that it is said there."""

    text: str
    start: float
    end: float
    confidence: float = 1.0


@dataclass(slots=True)
class PhoneLabels:
    """Contiguous phones of parts that arrive one after another; adjacent silences are merged."""

    _pending: Label | None = None

    def add(self, part: Part) -> Iterator[Label]:
        """Yield the phones that are complete after a part; its last one may still be continued by the next part."""
        if part.clip is None:
            return
        phones, shift = part.clip.speech.phones, part.begin
        half_sample = 0.5 / part.clip.speech.waveform.rate
        starts = [shift + float(edge) for edge in phones.edges]
        yield from self._reach(starts[0], half_sample)
        for text, start, end in zip(phones.phones, starts[:-1], starts[1:], strict=True):
            # the silence at the end of a part and that at the start of the next are one pause
            if self._pending is not None and text == SILENCE == self._pending.text:
                self._pending = Label(SILENCE, self._pending.start, end)
                continue
            if self._pending is not None:
                yield self._pending
            self._pending = Label(text, start, end)

    def finish(self) -> Iterator[Label]:
        """Yield the last phone."""
        if self._pending is not None:
            yield self._pending
        self._pending = None

    def _reach(self, start: float, half_sample: float) -> Iterator[Label]:
        """Extend the last phone to the next clip: by rounding, or by silence where a clip ended within a frame."""
        last = self._pending
        if last is None:
            return
        if last.text == SILENCE or abs(start - last.end) <= half_sample:
            self._pending = Label(last.text, last.start, start)
            return
        yield last
        self._pending = Label(SILENCE, last.end, start)


def part_words(part: Part) -> list[Label]:
    """Words of a part."""
    if part.clip is None:
        return []
    edges = part.clip.speech.phones.edges
    return [
        Label(word.text, part.begin + float(edges[word.first]), part.begin + float(edges[word.last]), word.confidence)
        for word in part.clip.speech.words
    ]


@dataclass(slots=True)
class AllLabels:
    """Phones and words of all parts, for formats that state their number or the duration first.

    They take about 10 MB for an hour of speech; motion and sound are not kept.
    """

    phones: list[Label] = field(default_factory=list)
    words: list[Label] = field(default_factory=list)
    _incoming: PhoneLabels = field(default_factory=PhoneLabels)

    def add(self, part: Part) -> None:
        """Append the labels of a part."""
        self.phones += self._incoming.add(part)
        self.words += part_words(part)

    def finish(self) -> None:
        """Append the last phone."""
        self.phones += self._incoming.finish()

    @property
    def duration(self) -> float:
        """End of the last phone in seconds."""
        return self.phones[-1].end if self.phones else 0.0
