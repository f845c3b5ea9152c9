"""Head motion as BVH (Biovision Hierarchy): one joint, degrees and centimetres."""

import numpy as np

from tts2face.interchange.exports.parts import Part, Target
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
        # BVH has degrees; its readers take lengths for centimetres
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
