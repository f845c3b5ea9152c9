"""Twelve requests whose motion, sound and pictures must not change, and the fingerprint of each result.

Run as a script it measures all of them and writes `requests.json` beside this file.
"""

import hashlib
import json
import platform
import sys
import tempfile
import wave
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from tests.render.tiny_talker import own_talker
from tts2face.models.face_loading import load_face
from tts2face.models.talker import Talker, load_talker
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.session import Session
from tts2face.types import Clip

KEPT = Path(__file__).with_name("requests.json")
DECIDES = ("numpy", "scipy", "numba", "onnxruntime", "hibari-tts", "espeakng-loader", "pocketsphinx", "pillow", "soxr")
SSML = """<speak version="1.0"><p><s>We were <emphasis level="strong">away</emphasis>.</s>
<s><prosody rate="120%" volume="soft">A year <break time="300ms"/> ago.</prosody><mark name="end"/></s></p></speak>"""


@dataclass(frozen=True)
class Golden:
    """One request: its options, face, and picture."""

    options: Mapping[str, Any]
    face: str | None = "head"
    identity: str | None = None
    picture: Mapping[str, Any] = field(default_factory=dict)
    is_own: bool = False
    is_recorded: bool = False


GOLDEN: dict[str, Golden] = {
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
    "cartoon": Golden({"text": "Five ships shall measure joy.", "fps": 25.0}, face="cartoon"),
    "identity_transparent": Golden(
        {"text": "Hello.", "rate": 1.2, "gestures": "noise"},
        identity="kofi",
        picture={"background": "transparent", "camera": "three-quarter"},
    ),
    "own_face": Golden({"text": "Bob may move.", "fps": 25.0}, is_own=True),
    "recording": Golden({}, is_recorded=True),
    "recording_with_words": Golden({"text": "Bob may move five big maps."}, is_recorded=True),
    "idle": Golden({"idle": 2.0, "style": "depressed"}),
    "ssml": Golden({"text": SSML, "style": "exaggerated"}),
}


@lru_cache(maxsize=1)
def starter() -> Talker:
    """The shipped talker."""
    return load_talker("grid_s1")


@lru_cache(maxsize=1)
def starter_with_pictures() -> Talker:
    """The shipped talker with made pictures of 96 x 96, whose parameters vary with the lips."""
    talker, appearance = starter(), own_talker().appearance
    assert appearance is not None
    n_modes = len(talker.model.basis)
    plate = replace(appearance.plate, shape=np.tile(talker.model.rest[:n_modes], (4, 1)))
    spoken = tuple(replace(one, appearance_parameters=one.shape[:, :4].astype(np.float32)) for one in talker.utterances)
    return replace(talker, utterances=spoken, appearance=replace(appearance, plate=plate))


@lru_cache(maxsize=1)
def recording() -> Path:
    """A sentence as a voice's own package speaks it, in a WAV file."""
    from hibari import Hibari

    voice = Hibari(voice="heart", threads=1)
    (letters,) = voice.phonemize("Bob may move five big maps.")
    samples = np.asarray(voice.from_phonemes(letters, seed=0), np.float32)
    out = Path(tempfile.mkdtemp()) / "speech.wav"
    with wave.open(str(out), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(voice.sample_rate)
        file.writeframes((samples * 32767).astype("<i2").tobytes())
    return out


def fingerprint(golden: Golden) -> dict[str, Any]:
    """SHA-256 of motion, sound and PNG files, and figures by which machines that differ can be compared."""
    options = dict(golden.options) | ({"audio": recording()} if golden.is_recorded else {})
    talker = starter_with_pictures() if golden.is_own else starter()
    face = None if golden.is_own else load_face(golden.face or "head", golden.identity)
    clips: list[Clip] = []
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "frames"
        picture = Picture(**{"size": "96x96", **golden.picture})
        session = Session(talker, face or "self")
        session.write(Request(**options), out, picture=picture, on_piece=lambda piece: clips.append(piece.clip))
        pictures = hashed(*(path.read_bytes() for path in sorted(out.glob("*.png"))))
        n_pictures = len(list(out.glob("*.png")))
    motion = np.concatenate([clip.motion.values for clip in clips])
    head = np.concatenate([clip.head.values for clip in clips])
    sound = np.concatenate([clip.speech.waveform.samples for clip in clips])
    return {
        "motion": hashed(",".join(clips[0].motion.channels).encode(), motion.tobytes(), head.tobytes()),
        "sound": hashed(sound.tobytes()),
        "pictures": pictures,
        "n_frames": n_pictures,
        "n_samples": len(sound),
        "motion_mean": [round(float(mean), 4) for mean in np.abs(motion).mean(axis=0)],
    }


def hashed(*parts: bytes) -> str:
    """First half of the SHA-256 of some bytes."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:32]


def environment() -> dict[str, str]:
    """What the bytes depend on besides the code: machine and versions of the libraries that compute."""
    return {"machine": f"{platform.machine()} {_processor()}"} | {name: version(name) for name in DECIDES}


def _processor() -> str:
    facts = Path("/proc/cpuinfo")
    if not facts.is_file():
        return platform.processor()
    lines = dict(line.split(":", 1) for line in facts.read_text().splitlines() if ":" in line)
    named = {key.strip(): value.strip() for key, value in lines.items()}
    wide = [flag for flag in ("avx2", "avx512f", "avx512_vnni") if flag in named.get("flags", "").split()]
    return " ".join([named.get("vendor_id", ""), *wide])


def measure_all(tell: Callable[[str], object] = lambda name: None) -> dict[str, Any]:
    """Fingerprints of all requests, by name."""
    found = {}
    for name, golden in GOLDEN.items():
        tell(name)
        found[name] = fingerprint(golden)
    return found


if __name__ == "__main__":
    measured = {"environment": environment(), "requests": measure_all(lambda name: sys.stderr.write(f"{name}\n"))}
    KEPT.write_text(json.dumps(measured, indent=1) + "\n", encoding="utf-8")
