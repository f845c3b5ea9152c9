"""ARKit weights and head angles as a CSV file of Live Link Face; `tts2face.video.livelink` reads it back."""

from fractions import Fraction

import numpy as np

from tts2face.interchange.exports.arkit import ARKIT_SHAPES, build_arkit_projection
from tts2face.interchange.exports.frame_grid import frame_rows
from tts2face.interchange.exports.parts import Part, Target
from tts2face.numeric.arrays import Float32Array
from tts2face.types import HEAD_CHANNELS
from tts2face.video.timecode import DEFAULT_TIMECODE_RATE, TIMECODE_RATES

HEAD_COLUMNS = ("HeadYaw", "HeadPitch", "HeadRoll")
EYES = ("Left", "Right")
# Signs of the angles in the file relative to `HEAD_CHANNELS`: pitch down, yaw to the right, roll alike.
HEAD_SIGNS = {"yaw": -1.0, "pitch": 1.0, "roll": 1.0}
# Angles of the eyes at weight 1 of the gaze shapes: pitch follows eyeLookDown, yaw eyeLookIn of the left and
# eyeLookOut of the right eye; slopes of a recorded capture of 20 s (correlations 0.98 and 0.99).
# turns of an eye at weight 1 of ARKit's eyeLook shapes
EYE_PITCH_RAD, EYE_YAW_RAD = 0.50, 0.64


class LiveLinkWriter:
    """Appends rows: timecode, 61, the 52 weights, and angles in radians of head, left and right eye."""

    def __init__(self, target: Target) -> None:
        self._projection = build_arkit_projection(target)
        self._fps, self._n_frames = target.fps, 0
        self._file = target.open_lines()
        columns = [name[0].upper() + name[1:] for name in ARKIT_SHAPES]
        columns += [*HEAD_COLUMNS, *(f"{side}Eye{angle}" for side in EYES for angle in ("Yaw", "Pitch", "Roll"))]
        self._file.write(f"Timecode,BlendshapeCount,{','.join(columns)}\n")
        self._count = len(columns)

    def add(self, part: Part) -> None:
        """Append frames."""
        weights = self._projection.weights(part.motion)
        head = [HEAD_SIGNS[name] * part.head[:, HEAD_CHANNELS.index(name)] for name in HEAD_SIGNS]
        rows = np.column_stack([weights, *head, *(eye_angles(weights, side) for side in EYES)])
        for number, row in enumerate(frame_rows(rows, "%.6f"), start=self._n_frames):
            self._file.write(f"{timecode(number, self._fps)},{self._count},{row}\n")
        self._n_frames += len(rows)

    def finish(self) -> None:
        """Complete the file."""
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def eye_angles(weights: Float32Array, side: str) -> Float32Array:
    """Yaw, pitch and roll (T, 3) of an eye in radians from the weights (T, 52) of its gaze shapes."""
    down, up, inward, outward = (
        weights[:, ARKIT_SHAPES.index(f"eyeLook{way}{side}")] for way in ("Down", "Up", "In", "Out")
    )
    to_right = inward - outward if side == "Left" else outward - inward
    return np.column_stack([EYE_YAW_RAD * to_right, EYE_PITCH_RAD * (down - up), np.zeros(len(weights))]).astype(
        np.float32
    )


def timecode(frame: int, fps: Fraction) -> str:
    """``hours:minutes:seconds:frames.thousandths``; other rates than `TIMECODE_RATES` are counted at 60."""
    base = int(fps) if fps in TIMECODE_RATES else DEFAULT_TIMECODE_RATE
    thousandths = round(Fraction(frame) / fps * base * 1000)
    seconds, part = divmod(thousandths, base * 1000)
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}:{part // 1000:02d}.{part % 1000:03d}"
