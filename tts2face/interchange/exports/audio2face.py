"""ARKit weights as JSON in the layout of Audio2Face's blend shape export."""

import json

from tts2face.interchange.exports.arkit import ARKIT_SHAPES, build_arkit_projection
from tts2face.interchange.exports.frame_grid import frame_rows
from tts2face.interchange.exports.parts import Part, Target

N_DIGITS = 10  # digits reserved for the number of frames, which is known last


class Audio2FaceWriter:
    """Appends rows of ``weightMat``; ``numFrames`` is written into its reserved place at the end."""

    def __init__(self, target: Target) -> None:
        self._projection = build_arkit_projection(target)
        self._file = target.path.open("w+b")
        self._n_frames = 0
        self._write(f'{{"exportFps": {float(target.fps)!r}, "numFrames": ')
        self._place = self._file.tell()
        names = json.dumps(list(ARKIT_SHAPES))
        self._write(f'{"":{N_DIGITS}}, "numPoses": {len(ARKIT_SHAPES)},\n"facsNames": {names},\n"weightMat": [')

    def add(self, part: Part) -> None:
        """Append frames."""
        weights = self._projection.weights(part.motion)
        for row in frame_rows(weights, "%.6g"):
            self._write(f"{',' if self._n_frames else ''}\n[{row}]")
            self._n_frames += 1

    def finish(self) -> None:
        """Write the number of frames."""
        self._write("\n]}\n")
        self._file.seek(self._place)
        self._write(f"{self._n_frames:>{N_DIGITS}d}")
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, text: str) -> None:
        self._file.write(text.encode())
