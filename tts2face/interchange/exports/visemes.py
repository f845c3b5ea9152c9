"""Visemes of phones in the inventories of Oculus, Azure and Rhubarb.

The data are in `visemes.tsv`, one phone per line; a cell with several visemes divides the phone into equal parts.

Visemes as JSON lines: Oculus Lipsync (15 visemes) and Azure Speech (22 viseme ids).

Mouth cues of Rhubarb Lip Sync: JSON, TSV and XML.
"""

import functools
import json
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any
from xml.sax.saxutils import escape

from lexicon.phones import look_up_phone
from lexicon.sequence import SILENCE
from tts2face.interchange.exports.parts import AllLabels, Label, Part, PhoneLabels, Target

OCULUS = ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U")  # index = id
AZURE = tuple(str(number) for number in range(22))
RHUBARB = ("A", "B", "C", "D", "E", "F", "G", "H", "X")
INVENTORIES: Mapping[str, tuple[str, ...]] = MappingProxyType({"oculus": OCULUS, "azure": AZURE, "rhubarb": RHUBARB})


@functools.cache
def viseme_table(inventory: str) -> Mapping[str, tuple[str, ...]]:
    """Visemes of each phone in one of `INVENTORIES`."""
    lines = (
        resources.files("tts2face.interchange.exports").joinpath("visemes.tsv").read_text(encoding="utf-8").splitlines()
    )
    heading, *rows = [line.split("\t") for line in lines]
    column = heading.index(inventory)
    return MappingProxyType({row[0]: tuple(row[column].split()) for row in rows})


def viseme_labels(phone: Label, inventory: str) -> Iterator[Label]:
    """Visemes of a phone, in equal parts of its time.

    Raises
    ------
    InputError
        The phone is not in the phone table.
    """
    visemes = viseme_table(inventory)[look_up_phone(phone.text).symbol]
    step = (phone.end - phone.start) / len(visemes)
    for number, viseme in enumerate(visemes):
        end = phone.end if number + 1 == len(visemes) else phone.start + (number + 1) * step
        yield Label(viseme, phone.start + number * step, end)


TICKS_PER_SECOND = 10_000_000  # Azure states offsets in units of 100 ns


class _VisemeLines:
    """Writer of one JSON object for each viseme, in order of time."""

    inventory: str

    def __init__(self, target: Target) -> None:
        self._file = target.open_lines()
        self._phones = PhoneLabels()

    def add(self, part: Part) -> None:
        """Append the visemes of the phones that are complete."""
        for phone in self._phones.add(part):
            self._write(phone)

    def finish(self) -> None:
        """Append the last phone."""
        for phone in self._phones.finish():
            self._write(phone)
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, phone: Label) -> None:
        for viseme in viseme_labels(phone, self.inventory):
            self._file.write(json.dumps(self._record(viseme, phone.text), ensure_ascii=False) + "\n")

    def _record(self, viseme: Label, phone: str) -> dict[str, Any]:
        raise NotImplementedError


class OculusWriter(_VisemeLines):
    """Lines with start and end in seconds, name and number of the viseme, and the phone."""

    inventory = "oculus"

    def _record(self, viseme: Label, phone: str) -> dict[str, Any]:
        times = {"start": round(viseme.start, 9), "end": round(viseme.end, 9)}
        return times | {"viseme": viseme.text, "id": OCULUS.index(viseme.text), "phone": phone}


class AzureWriter(_VisemeLines):
    """Lines with the fields of Azure's viseme event: offset in ticks of 100 ns, and viseme id; with the phone."""

    inventory = "azure"

    def _record(self, viseme: Label, phone: str) -> dict[str, Any]:
        return {
            "audio_offset": round(viseme.start * TICKS_PER_SECOND),
            "viseme_id": int(viseme.text),
            "duration": round(viseme.end * TICKS_PER_SECOND) - round(viseme.start * TICKS_PER_SECOND),
            "phone": phone,
        }


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
