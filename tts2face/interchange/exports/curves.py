"""Motion as the 52 blend shapes of ARKit, with other shapes of the face expressed by them.

ARKit weights and head angles as a CSV file of Live Link Face; `tts2face.video.take` reads it back.

ARKit weights as JSON in the layout of Audio2Face's blend shape export.

ARKit weights and head pose as JSON lines, one for each frame.
"""

import json
from dataclasses import dataclass
from fractions import Fraction
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.interchange.exports.parts import Float32Array, Part, Target, frame_rows
from tts2face.models.face import Face
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.types import HEAD_CHANNELS
from tts2face.video.take import TIMECODE_RATES

# ARFaceAnchor.BlendShapeLocation, in the order of the columns of Live Link Face.
ARKIT_SHAPES = (
    "eyeBlinkLeft", "eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeSquintLeft",
    "eyeWideLeft", "eyeBlinkRight", "eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight",
    "eyeSquintRight", "eyeWideRight", "jawForward", "jawRight", "jawLeft", "jawOpen", "mouthClose", "mouthFunnel",
    "mouthPucker", "mouthRight", "mouthLeft", "mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft", "mouthFrownRight",
    "mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight", "mouthRollLower", "mouthRollUpper",
    "mouthShrugLower", "mouthShrugUpper", "mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft",
    "mouthLowerDownRight", "mouthUpperUpLeft", "mouthUpperUpRight", "browDownLeft", "browDownRight", "browInnerUp",
    "browOuterUpLeft", "browOuterUpRight", "cheekPuff", "cheekSquintLeft", "cheekSquintRight", "noseSneerLeft",
    "noseSneerRight", "tongueOut",
)  # fmt: skip
# Shapes that express other channels, which are gestures of brows and cheeks; lips, jaw, lids and gaze keep their own.
HELPER_PREFIXES = ("brow", "cheek", "noseSneer", "eyeSquint", "eyeWide")
RIDGE = 1e-3  # of the mean curvature: prefers small changes where several shapes do the same


@dataclass(frozen=True, slots=True, eq=False)
class ArkitProjection:
    """Weights of the ARKit shapes from a clip's channels.

    Parameters
    ----------
    columns : (52,)
        Index of each ARKit shape among the channels; -1 for a shape that the face lacks, whose weight is 0.
    others : (M,)
        Channels that are not ARKit shapes.
    helpers : (H,)
        ARKit shapes (of the 52) that express the other channels.
    curvature, cross : (H, H), (H, M)
        Inner products of the helpers with themselves, ridge included, and with the other shapes.
    """

    columns: NDArray[np.int64]
    others: NDArray[np.int64]
    helpers: NDArray[np.int64]
    curvature: NDArray[np.float64]
    cross: NDArray[np.float64]

    def weights(self, motion: Float32Array) -> Float32Array:
        """Weights (T, 52) in [0, 1] from motion (T, K).

        Notes
        -----
        The change d of the helpers' weights minimises ``|A d - S g|^2 + ridge |d|^2`` over the vertices, where S g is
        the displacement by the other channels, so that all weights stay in [0, 1]; solved by one bounded least-squares
        problem for each frame.
        """
        known = np.where(self.columns >= 0, motion[:, self.columns], 0.0).astype(np.float64).clip(0.0, 1.0)
        if len(self.helpers) and len(motion):
            extra = motion[:, self.others].astype(np.float64)
            moved = np.flatnonzero(extra.any(axis=1))
            start = known[np.ix_(moved, self.helpers)]
            linear = start @ self.curvature + extra[moved] @ self.cross.T
            limits = np.tile([0.0, 1.0], (len(self.helpers), 1))
            known[np.ix_(moved, self.helpers)] = bounded_least_squares(self.curvature, linear, limits)
        return known.astype(np.float32)


def build_arkit_projection(target: Target) -> ArkitProjection:
    """Projection for the channels of an export; errors as `arkit_projection`."""
    return arkit_projection(target.channels, target.face, target.name)


def arkit_projection(channels: tuple[str, ...], face: Face | None, name: str) -> ArkitProjection:
    """Projection for channels of a face.

    Parameters
    ----------
    name
        Name of the output in messages.

    Raises
    ------
    InputError
        No channel is an ARKit shape, or there are other channels and no face whose shapes they are.
    """
    columns = np.array([channels.index(name) if name in channels else -1 for name in ARKIT_SHAPES])
    others = np.array([at for at, name in enumerate(channels) if name not in ARKIT_SHAPES], np.int64)
    if (columns < 0).all():
        raise InputError(
            f"{name} holds ARKit shapes, and the clip has none of them (its channels are "
            f"{', '.join(channels[:3])}, ...); choose a face with ARKit shapes, such as head or ada"
        )
    none = np.zeros((0, 0))
    if not len(others):
        return ArkitProjection(columns, others, np.zeros(0, np.int64), none, none)
    if face is None:
        raise InputError(
            f"{len(others)} channels of the clip ({', '.join(channels[at] for at in others[:3])}, ...) are not ARKit "
            f"shapes; to express them in {name}, give the clip's face, as in face=session.face"
        )
    helpers = np.array([
        at for at, name in enumerate(ARKIT_SHAPES) if columns[at] >= 0 and name.startswith(HELPER_PREFIXES)
    ])  # fmt: skip
    if not len(helpers):
        return ArkitProjection(columns, others, helpers, none, none)
    products = _PRODUCTS.setdefault(face, {})
    if channels not in products:
        products[channels] = _inner_products(face, columns[helpers], others)
    return ArkitProjection(columns, others, helpers, *products[channels])


# By face and channels: they take a tenth of a second, and every clip of lines needs them.
_PRODUCTS: WeakKeyDictionary[Face, dict[tuple[str, ...], tuple[NDArray[np.float64], NDArray[np.float64]]]]
_PRODUCTS = WeakKeyDictionary()


def _inner_products(
    face: Face, helpers: NDArray[np.int64], others: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    own = face.shapes[helpers].reshape(len(helpers), -1).astype(np.float64)  # the sums of single precision differ
    curvature = own @ own.T  # with the number of threads
    curvature += RIDGE * float(np.trace(curvature)) / len(curvature) * np.eye(len(curvature))
    return curvature, own @ face.shapes[others].reshape(len(others), -1).astype(np.float64).T


HEAD_COLUMNS = ("HeadYaw", "HeadPitch", "HeadRoll")
EYES = ("Left", "Right")
DEFAULT_TIMECODE_RATE = 60  # for other frame rates, with fractions of frames
# Signs of the angles in the file relative to `HEAD_CHANNELS`: pitch down, yaw to the right, roll alike.
HEAD_SIGNS = {"yaw": -1.0, "pitch": 1.0, "roll": 1.0}
# Angles of the eyes at weight 1 of the gaze shapes: pitch follows eyeLookDown, yaw eyeLookIn of the left and
# eyeLookOut of the right eye; slopes of a recorded capture of 20 s (correlations 0.98 and 0.99).
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
