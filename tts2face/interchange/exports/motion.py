"""Head motion as BVH (Biovision Hierarchy): one joint, degrees and centimetres.

All arrays of a clip in one NumPy .npz file, without pickles.
"""

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np

from tts2face.interchange.exports.parts import AllLabels, Part, Target
from tts2face.storage.spool import Spool
from tts2face.types import HEAD_CHANNELS

MM_PER_CM = 10.0
HEAD_LENGTH_CM = 20.0  # of the bone that viewers draw
N_DIGITS = 10  # digits reserved for the number of frames, which is known last
# The channels in the order in which BVH multiplies them: translation, then Y X Z, the order of
# `tts2face.face.deformation.head_rotation`.
_ORDER = [HEAD_CHANNELS.index(name) for name in ("x", "y", "z", "yaw", "pitch", "roll")]
_HIERARCHY = f"""HIERARCHY
ROOT Head
{{
\tOFFSET 0 0 0
\tCHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation
\tEnd Site
\t{{
\t\tOFFSET 0 {HEAD_LENGTH_CM:g} 0
\t}}
}}
MOTION
Frames: """


class BvhWriter:
    """Writes frames as they arrive; the number of frames is written into its reserved place at the end."""

    def __init__(self, target: Target) -> None:
        self._file = target.path.open("w+b")
        self._n_frames = 0
        self._file.write(_HIERARCHY.encode())
        self._place = self._file.tell()
        self._file.write(f"{'':{N_DIGITS}}\nFrame Time: {float(1 / target.fps):.9f}\n".encode())

    def add(self, part: Part) -> None:
        """Append frames."""
        units = np.array([1 / MM_PER_CM] * 3 + [180 / np.pi] * 3)
        rows = part.head[:, _ORDER].astype(np.float64) * units
        pattern = " ".join(["%.6f"] * len(_ORDER)) + "\n"
        self._file.write("".join([pattern % tuple(row) for row in rows.tolist()]).encode())
        self._n_frames += len(rows)

    def finish(self) -> None:
        """Write the number of frames."""
        self._file.seek(self._place)
        self._file.write(f"{self._n_frames:<{N_DIGITS}d}".encode())
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


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
