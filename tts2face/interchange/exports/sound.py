"""The sound of a clip as a 16-bit .wav file."""

from tts2face.interchange.exports.parts import Part, Target
from tts2face.storage.wave_files import WaveFile


class WavWriter:
    """Appends sound; a clip that ended within a frame is padded with silence."""

    def __init__(self, target: Target) -> None:
        self._file = WaveFile(target.path, target.rate, target.sound_mark)
        self._n_samples = 0

    def add(self, part: Part) -> None:
        """Append the sound of a part."""
        if part.clip is None:
            return
        samples = part.clip.speech.waveform.samples
        padding = part.begin_sample - self._n_samples
        self._file.write_pcm(bytes(2 * max(padding, 0)))
        self._file.write(samples)
        self._n_samples = part.begin_sample + len(samples)

    def finish(self) -> None:
        """Complete the header."""
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
