"""A voice of your own: any program that writes a sound file. The variable VOICE_COMMAND names another than espeak-ng.

pyproject.toml:

    [project]
    name = "command-voice"
    version = "1.0"
    [project.entry-points."tts2face.voices"]
    command = "own_voice:COMMAND"

With this file beside it, alone in a folder:

    pip install .
    tts2face "We were away a year ago." --voice command --out away.mp4
"""

import os
import shlex
import subprocess
import tempfile
from pathlib import Path

from lexicon.errors import BackendError
from tts2face.sound.alignment import Aligner
from tts2face.sound.voice import VoiceInfo, pronounce_content
from tts2face.types import Speech
from tts2face.video.media import read_sound

PROGRAM = os.environ.get("VOICE_COMMAND", "espeak-ng -v en-us -s {speed} -w {out} {text}")


class CommandVoice:
    sample_rate = 22_050  # Hz

    def __init__(self, setting):
        self._setting, self._align = setting, setting.align or Aligner().align

    def speak(self, content, *, rate=1.0, seed=0):
        words = pronounce_content(content, self._setting.language, self._setting.own_words)
        sound = self._say(" ".join(word.text + word.mark for word in words), rate)
        found = self._align(sound, [(word.text, [tuple(word.phones)]) for word in words])
        return Speech(sound, found.phones, found.words)

    def sound(self, content, *, rate=1.0, seed=0):
        return self.speak(content, rate=rate, seed=seed).waveform

    def _say(self, text, rate):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "out.wav")
            command = [word.format(text=text, out=out, speed=round(175 * rate)) for word in shlex.split(PROGRAM)]
            try:
                subprocess.run(command, check=True, capture_output=True)
            except (OSError, subprocess.CalledProcessError) as failed:
                raise BackendError(f"the voice's program failed ({failed}); check VOICE_COMMAND") from failed
            return read_sound(out, self.sample_rate)


COMMAND = VoiceInfo("a program of this machine", CommandVoice, "command", "tts2face", "-", "-", ("en-us",))
