"""An export format of your own: the mouth switch of Moho and OpenToonz, in the shapes of Preston Blair.

pyproject.toml:

    [project]
    name = "moho-export"
    version = "1.0"
    [project.entry-points."tts2face.exports"]
    moho = "export_format:MOHO"

With this file beside it, alone in a folder:

    pip install .
    tts2face "We were away a year ago." --export away.moho.dat --fps 24
"""

from lexicon.phones import look_up_phone
from tts2face.interchange.exports.labels import PhoneLabels
from tts2face.interchange.exports.table import FormatInfo

SHAPES = {"silence": "rest", "lateral": "L", "bilabial": "MBP", "labiodental": "FV", "labial-velar": "WQ"}


def mouth_shape(label):
    """Shape of a phone of any language, by its features; of a diphthong, that of its first part."""
    phone = look_up_phone(label)
    if not phone.is_vowel:
        return SHAPES.get(phone.kind) or SHAPES.get(phone.place, "etc")
    vowel = look_up_phone(phone.parts[0]) if phone.parts else phone
    if vowel.rounding == "rounded":
        return "U" if vowel.height in ("close", "near-close") else "O"
    return "E" if "front" in vowel.backness and vowel.height not in ("open", "near-open") else "AI"


class MohoWriter:
    def __init__(self, target):
        self._target, self._phones, self._shapes = target, PhoneLabels(), {1: "rest"}

    def add(self, part):
        self._place(self._phones.add(part))

    def finish(self):
        self._place(self._phones.finish())
        frames = list(self._shapes.items())
        changes = [now for now, before in zip(frames, [(0, ""), *frames], strict=False) if now[1] != before[1]]
        lines = "".join(f"{frame} {shape}\n" for frame, shape in changes)
        self._target.path.write_text(f"MohoSwitch1\n{lines}", encoding="utf-8")

    def close(self):
        pass  # no file is open

    def _place(self, phones):
        for phone in phones:  # with start and end in seconds of the whole
            frame = round(phone.start * float(self._target.fps)) + 1
            if self._shapes.get(frame) != "MBP":  # closed lips win over another phone of their frame
                self._shapes[frame] = mouth_shape(phone.text)


MOHO = FormatInfo("moho", (".moho.dat",), "mouth switch of Moho", MohoWriter, has_frames=True)
