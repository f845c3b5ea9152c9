"""Mouth cues of Rhubarb Lip Sync: JSON, TSV and XML."""

import json
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape

from lexicon.sequence import SILENCE
from tts2face.interchange.exports.labels import AllLabels
from tts2face.interchange.exports.parts import Part, Target
from tts2face.interchange.exports.visemes import viseme_labels

Cue = tuple[str, str, str]  # start and end in seconds with two decimals, as Rhubarb writes them, and shape
REST = "X"
MIN_REST_S = 0.1  # a shorter silence keeps the shape before it, so that the mouth does not flicker; chosen


def mouth_cues(labels: AllLabels) -> list[Cue]:
    """Contiguous cues; equal neighbours are merged, and cues that vanish at two decimals are omitted."""
    cues: list[list[str]] = []
    for number, phone in enumerate(labels.phones):
        if phone.text == SILENCE and phone.end - phone.start < MIN_REST_S and 0 < number < len(labels.phones) - 1:
            cues[-1][1] = f"{phone.end:.2f}"
            continue
        for viseme in viseme_labels(phone, "rhubarb"):
            start, end = f"{viseme.start:.2f}", f"{viseme.end:.2f}"
            # Rhubarb writes two decimals: a cue may vanish by rounding
            if cues and (cues[-1][2] == viseme.text or start == end):
                cues[-1][1] = end
            else:
                cues.append([start, end, viseme.text])
    return [(start, end, shape) for start, end, shape in cues]


class _RhubarbWriter:
    """Collects labels, and writes the file when all are known: the duration comes first."""

    def __init__(self, target: Target) -> None:
        self._path, self._sound_name = target.path, target.sound_name
        self._labels = AllLabels()

    def add(self, part: Part) -> None:
        """Keep the labels of a part."""
        self._labels.add(part)

    def finish(self) -> None:
        """Write the file."""
        self._labels.finish()
        _write(self._path, self._content(mouth_cues(self._labels), f"{self._labels.duration:.2f}"))

    def close(self) -> None:
        """Nothing is open."""

    def _content(self, cues: Sequence[Cue], duration: str) -> str:
        raise NotImplementedError


class RhubarbJsonWriter(_RhubarbWriter):
    """Object with ``metadata`` and ``mouthCues``."""

    def _content(self, cues: Sequence[Cue], duration: str) -> str:
        lines = ",\n".join(
            f'    {{ "start": {start}, "end": {end}, "value": "{shape}" }}' for start, end, shape in cues
        )
        name = json.dumps(self._sound_name, ensure_ascii=False)
        metadata = f'  "metadata": {{\n    "soundFile": {name},\n    "duration": {duration}\n  }},\n'
        return f'{{\n{metadata}  "mouthCues": [\n{lines}\n  ]\n}}\n'


class RhubarbTsvWriter(_RhubarbWriter):
    """Lines of start and shape; the last line states the end."""

    def _content(self, cues: Sequence[Cue], duration: str) -> str:
        return "".join(f"{start}\t{shape}\n" for start, _, shape in cues) + f"{duration}\t{REST}\n"


class RhubarbXmlWriter(_RhubarbWriter):
    """Element ``rhubarbResult`` with ``metadata`` and ``mouthCues``."""

    def _content(self, cues: Sequence[Cue], duration: str) -> str:
        lines = "".join(f'    <mouthCue start="{start}" end="{end}">{shape}</mouthCue>\n' for start, end, shape in cues)
        return (
            '<?xml version="1.0" encoding="utf-8"?>\n<rhubarbResult>\n  <metadata>\n'
            f"    <soundFile>{escape(self._sound_name)}</soundFile>\n    <duration>{duration}</duration>\n"
            f"  </metadata>\n  <mouthCues>\n{lines}  </mouthCues>\n</rhubarbResult>\n"
        )


def _write(path: Path, content: str) -> None:
    path.write_text(content, encoding="utf-8", newline="\n")
