"""Twenty requests whose motion, sound, pictures and files must not change: twelve clips, and eight of other doors.

``python -m tests.golden.requests`` measures all of them and keeps the fingerprints in `requests.json`.
"""

import sys
import tempfile
import wave
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.golden.doors import DOORS, SESSIONS
from tests.golden.fingerprints import Fingerprint, of_clips, of_pictures, read_machines, renewed, write_machines
from tests.picture.tiny_talker import own_talker
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.named_models import Models
from tts2face.session.session import Session
from tts2face.types import Clip

SSML = """<speak version="1.0"><p><s>We were <emphasis level="strong">away</emphasis>.</s>
<s><prosody rate="120%" volume="soft">A year <break time="300ms"/> ago.</prosody><mark name="end"/></s></p></speak>"""


@dataclass(frozen=True)
class Golden:
    """One clip: its options, models (None: the talker's own face, with made pictures), and picture."""

    options: Mapping[str, Any]
    models: Models | None = field(default_factory=Models)
    picture: Mapping[str, Any] = field(default_factory=dict)
    is_recorded: bool = False


CLIPS: dict[str, Golden] = {
    "heart": Golden({"text": "We were away a year ago, but Bob may move five big maps."}),
    "espeak_as_published": Golden(
        {"text": "Big maps move.", "voice": "espeak", "synthesis": "theobald2007", "gestures": "none"}
    ),
    "german": Golden({"text": "Guten Morgen, liebe Welt.", "language": "de"}),
    "delighted": Golden(
        {"text": "Hello there.", "style": "delighted", "gain": "head=1.5,jaw=1.2", "expression": "happy=0.4@0.2-1"}
    ),
    "styles_by_feature": Golden(
        {"text": "Well, [pause 0.4] no [nod] more.", "style": "brows=annoyed,head=delighted", "pitch": True, "seed": 3}
    ),
    "recording": Golden({}, is_recorded=True),
    "recording_with_words": Golden({"text": "Bob may move five big maps."}, is_recorded=True),
    "idle": Golden({"idle": 2.0, "style": "depressed"}),
    "ssml": Golden({"text": SSML, "style": "exaggerated"}),
    "realistic": Golden({"text": "Five ships shall measure joy.", "fps": 25.0}, Models(face="head")),
    "identity_transparent": Golden(
        {"text": "Hello.", "voice": "heart", "rate": 1.2, "gestures": "noise"},  # his own would be joe, where it is
        Models(identity="kofi"),
        {"background": "transparent", "camera": "three-quarter"},
    ),
    "own_face": Golden({"text": "Bob may move.", "fps": 25.0}, None),
}
NAMES = (*CLIPS, *DOORS)


def starter_with_pictures() -> Talker:
    """The shipped talker with made pictures."""
    return with_pictures(load_talker("grid_s1"))


def with_pictures(talker: Talker) -> Talker:
    """A talker with made pictures of 96 x 96, whose parameters vary with the lips."""
    appearance = own_talker().appearance
    assert appearance is not None
    n_modes = len(talker.model.basis)
    plate = replace(appearance.plate, shape=np.tile(talker.model.rest[:n_modes], (4, 1)))
    spoken = tuple(replace(one, appearance_parameters=one.shape[:, :4].astype(np.float32)) for one in talker.utterances)
    return replace(talker, utterances=spoken, appearance=replace(appearance, plate=plate))


def write_recording(out: Path) -> Path:
    """A sentence as a voice's own package speaks it, in a WAV file."""
    from hibari import Hibari

    voice = Hibari(voice="heart", threads=1)
    (letters,) = voice.phonemize("Bob may move five big maps.")
    samples = np.asarray(voice.from_phonemes(letters, seed=0), np.float32)
    with wave.open(str(out), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(voice.sample_rate)
        file.writeframes((samples * 32767).astype("<i2").tobytes())
    return out


def clip_fingerprint(golden: Golden, folder: Path) -> Fingerprint:
    """Motion, sound and PNG files of a clip that is written to a folder."""
    options = dict(golden.options)
    if golden.is_recorded:
        options["audio"] = write_recording(folder / "speech.wav")
    clips: list[Clip] = []
    session = Session(starter_with_pictures(), "self") if golden.models is None else SESSIONS.get(golden.models)
    session.write(
        Request(**options),
        folder / "frames",
        picture=Picture(**{"size": "96x96", **golden.picture}),
        on_piece=lambda piece: clips.append(piece.clip),
    )
    return of_clips(clips) | of_pictures(folder / "frames")


def fingerprint(name: str) -> Fingerprint:
    """The result of one of the requests."""
    with tempfile.TemporaryDirectory() as folder:
        return clip_fingerprint(CLIPS[name], Path(folder)) if name in CLIPS else DOORS[name](Path(folder))


def main() -> None:
    """Measure all requests and keep them."""
    found = {}
    for name in NAMES:
        sys.stderr.write(f"{name}\n")
        found[name] = fingerprint(name)
    write_machines(renewed(read_machines(), found))


if __name__ == "__main__":
    main()
