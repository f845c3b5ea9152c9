"""Words and phones of a clip as a Praat TextGrid."""

from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.exports.labels import AllLabels
from tts2face.exports.parts import Part, Target
from tts2face.exports.text import textgrid


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
            words.append(WordSpan(word.text, first, last))
        self._path.write_text(textgrid(sequence, words), encoding="utf-8", newline="\n")

    def close(self) -> None:
        """Nothing is open."""
