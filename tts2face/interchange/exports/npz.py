"""All arrays of a clip in one NumPy .npz file, without pickles."""

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np

from tts2face.interchange.exports.labels import AllLabels
from tts2face.interchange.exports.parts import Part, Target
from tts2face.storage.spool import Spool
from tts2face.types import HEAD_CHANNELS


class NpzWriter:
    """Keeps frames and sound in temporary files, and packs them when their number is known."""

    def __init__(self, target: Target) -> None:
        self._target, self._labels = target, AllLabels()
        self._motion, self._head = Spool(len(target.channels)), Spool(len(HEAD_CHANNELS))
        self._sound = Spool(1)

    def add(self, part: Part) -> None:
        """Append frames, sound and labels."""
        self._motion.add(part.motion)
        self._head.add(part.head)
        self._labels.add(part)
        if part.clip is not None:
            padding = part.begin_sample - self._sound.n_rows
            self._sound.add(np.zeros(max(padding, 0), np.float32))
            self._sound.add(part.clip.speech.waveform.samples)

    def finish(self) -> None:
        """Write the archive."""
        self._labels.finish()
        with zipfile.ZipFile(self._target.path, "w", allowZip64=True) as archive:
            for name, (spool, shape) in {
                "motion": (self._motion, (self._motion.n_rows, self._motion.width)),
                "head": (self._head, (self._head.n_rows, self._head.width)),
                "samples": (self._sound, (self._sound.n_rows,)),
            }.items():
                with archive.open(_member(name), "w", force_zip64=True) as file:
                    header = {"descr": spool.dtype.str, "fortran_order": False, "shape": shape}
                    np.lib.format.write_array_header_1_0(file, header)
                    spool.copy_to(file)
            for name, values in self._small_arrays().items():
                content = io.BytesIO()
                np.save(content, np.asarray(values), allow_pickle=False)
                archive.writestr(_member(name), content.getvalue())

    def close(self) -> None:
        """Remove the temporary files."""
        for spool in (self._motion, self._head, self._sound):
            spool.close()

    def _small_arrays(self) -> Mapping[str, Any]:
        phones, words = self._labels.phones, self._labels.words
        return {
            "channels": np.array(self._target.channels, dtype=str),
            "head_channels": np.array(HEAD_CHANNELS),
            "fps": np.float64(self._target.fps),
            "rate": np.int64(self._target.rate),
            "phones": np.array([phone.text for phone in phones], dtype=str),
            "phone_edges": np.array([phone.start for phone in phones] + [self._labels.duration], np.float64),
            "words": np.array([word.text for word in words], dtype=str),
            "word_confidence": np.array([word.confidence for word in words], np.float64),
            "word_times": np.array([(word.start, word.end) for word in words], np.float64).reshape(-1, 2),
        }


def _member(name: str) -> zipfile.ZipInfo:
    """Member of an array, dated 1980 rather than by the clock, so that equal clips are equal bytes."""
    return zipfile.ZipInfo(f"{name}.npy")
