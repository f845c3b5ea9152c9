"""The sound of a clip as a 16-bit .wav file."""

from lexicon.errors import InputError
from tts2face.interchange.exports.parts import Part, Target
from tts2face.storage.wave_files import open_wave, pcm_bytes

MAX_SAMPLES = (2**32 - 64) // 2  # a .wav file states its size in bytes in 32 bits


class WavWriter:
    """Appends sound; a clip that ended within a frame is padded with silence."""

    def __init__(self, target: Target) -> None:
        self._file = open_wave(str(target.path), target.rate)
        self._n_samples, self._name = 0, target.name

    def add(self, part: Part) -> None:
        """Append the sound of a part."""
        if part.clip is None:
            return
        samples = part.clip.speech.waveform.samples
        if part.begin_sample + len(samples) > MAX_SAMPLES:
            hours = MAX_SAMPLES / part.clip.speech.waveform.rate / 3600
            raise InputError(f"{self._name} would have more than 4 GB, {hours:.0f} hours; export shorter clips")
        padding = part.begin_sample - self._n_samples
        self._file.writeframesraw(bytes(2 * max(padding, 0)))
        self._file.writeframesraw(pcm_bytes(samples))
        self._n_samples = part.begin_sample + len(samples)

    def finish(self) -> None:
        """Complete the header."""
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
