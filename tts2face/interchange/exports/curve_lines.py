"""ARKit weights and head pose as JSON lines, one for each frame."""

import json

import numpy as np

from tts2face.interchange.exports.arkit import ARKIT_SHAPES, build_arkit_projection
from tts2face.interchange.exports.parts import Part, Target
from tts2face.types import HEAD_CHANNELS

N_DECIMALS = 5


class CurveLinesWriter:
    """Writes a line with the names, then for each frame its time in seconds, 52 weights, and 6 values of the head."""

    def __init__(self, target: Target) -> None:
        self._projection = build_arkit_projection(target)
        self._fps, self._n_frames = target.fps, 0
        self._file = target.open_lines()
        self._write({"fps": float(target.fps), "weights": list(ARKIT_SHAPES), "head": list(HEAD_CHANNELS)})

    def add(self, part: Part) -> None:
        """Append frames."""
        weights = self._projection.weights(part.motion)
        for row, head in zip(_rounded(weights), _rounded(part.head), strict=True):
            self._write({"time": round(float(self._n_frames / self._fps), 6), "weights": row, "head": head})
            self._n_frames += 1

    def finish(self) -> None:
        """Complete the file."""
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, content: dict[str, object]) -> None:
        self._file.write(json.dumps(content, separators=(",", ":")) + "\n")


def _rounded(values: "np.ndarray[tuple[int, ...], np.dtype[np.float32]]") -> list[list[float]]:
    rounded: list[list[float]] = np.round(values.astype(np.float64), N_DECIMALS).tolist()
    return rounded
