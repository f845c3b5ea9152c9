"""Visemes as JSON lines: Oculus Lipsync (15 visemes) and Azure Speech (22 viseme ids)."""

import json
from typing import Any

from tts2face.interchange.exports.labels import Label, PhoneLabels
from tts2face.interchange.exports.parts import Part, Target
from tts2face.interchange.exports.visemes import OCULUS, viseme_labels

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
        # nanoseconds: sums of seconds have rests in their last bits
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
