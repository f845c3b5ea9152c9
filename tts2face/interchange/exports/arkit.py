"""Motion as the 52 blend shapes of ARKit, with other shapes of the face expressed by them."""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.combinations import PREFIX
from tts2face.face.lip_constraints import CORNER_CARRIERS, CORNER_SHAPE, SPEECH_SHAPE_PREFIXES
from tts2face.face.mouth import NO_VISEME, mouth_products
from tts2face.face.shape_transfer import add_missing_shapes
from tts2face.face.stand_in import stand_in
from tts2face.interchange.exports.parts import Target
from tts2face.models.face import Face
from tts2face.numeric.arrays import Float32Array, FloatArray
from tts2face.numeric.least_squares import bounded_least_squares

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
SPREAD = 0.02  # ridge of the mouth, over the median curvature: jaw and pucker alone, not ten small shapes together
RIDGE = 1e-3  # of the mean curvature: prefers small changes where several shapes do the same
# By face and channels: they take a tenth of a second, and every clip of lines needs them.
_PARTS: "WeakKeyDictionary[Face, dict[tuple[str, ...], tuple[Expressed, ...]]]" = WeakKeyDictionary()


@dataclass(frozen=True, slots=True, eq=False)
class Expressed:
    """Channels of a face that ARKit shapes express.

    Parameters
    ----------
    others : (M,)
        Channels that are not ARKit shapes.
    helpers : (H,)
        ARKit shapes (of the 52) that express them.
    curvature, cross : (H, H), (H, M)
        Inner products of the helpers with themselves, ridge included, and with the other shapes.
    """

    others: NDArray[np.int64]
    helpers: NDArray[np.int64]
    curvature: FloatArray
    cross: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ArkitProjection:
    """Weights of the ARKit shapes from a clip's channels.

    Parameters
    ----------
    columns : (52,)
        Index of each ARKit shape among the channels; -1 for a shape that the face lacks.
    parts
        Other channels: gestures of brows and cheeks by their vertices, visemes by the landmarks of the mouth.
    """

    columns: NDArray[np.int64]
    parts: tuple[Expressed, ...] = ()

    def weights(self, motion: Float32Array) -> Float32Array:
        """Weights (T, 52) in [0, 1] from motion (T, K).

        Notes
        -----
        The change d of the helpers' weights minimises ``|A d - S g|^2 + ridge |d|^2`` over the vertices, where S g is
        the displacement by the other channels, so that all weights stay in [0, 1]; solved by one bounded least-squares
        problem for each frame.
        """
        known = np.where(self.columns >= 0, motion[:, self.columns], 0.0).astype(np.float64).clip(0.0, 1.0)
        for part in self.parts:
            extra = motion[:, part.others].astype(np.float64)
            moved = np.flatnonzero(extra.any(axis=1))
            if not len(moved):
                continue
            start = known[np.ix_(moved, part.helpers)]
            linear = start @ part.curvature + extra[moved] @ part.cross.T
            limits = np.tile([0.0, 1.0], (len(part.helpers), 1))
            known[np.ix_(moved, part.helpers)] = bounded_least_squares(part.curvature, linear, limits)
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
    # combinations correct what ARKit's weights say already
    added = [at for at, name in enumerate(channels) if name not in ARKIT_SHAPES and not name.startswith(PREFIX)]
    others = np.array(added, np.int64)
    spoken = np.array([channels[at].startswith(SPEECH_SHAPE_PREFIXES) for at in others], bool)
    if (columns < 0).all() and (face is None or not spoken.any()):
        raise InputError(
            f"{name} holds ARKit shapes, and the clip has none of them (its channels are "
            f"{', '.join(channels[:3])}, ...); choose a face with ARKit shapes, such as head or ada"
        )
    if not len(others):
        return ArkitProjection(columns)
    if face is None:
        raise InputError(
            f"{len(others)} channels of the clip ({', '.join(channels[at] for at in others[:3])}, ...) are not ARKit "
            f"shapes; to express them in {name}, give the clip's face, as in face=session.face"
        )
    # the products of a face's shapes are the same for each clip of it
    known = _PARTS.setdefault(face, {})
    if channels not in known:
        bent = np.array([channels[at] == CORNER_SHAPE for at in others], bool)
        made = (
            _by_vertices(face, columns, others[~spoken]),
            _by_mouth(face, channels, others[spoken & ~bent], SPEECH_SHAPE_PREFIXES),
            _by_mouth(face, channels, others[bent], CORNER_CARRIERS),
        )
        known[channels] = tuple(part for part in made if part is not None)
    return ArkitProjection(columns, known[channels])


def _by_vertices(face: Face, columns: NDArray[np.int64], others: NDArray[np.int64]) -> Expressed | None:
    """Gestures by the vertices of the face's own helpers; None without any."""
    helpers = np.array([
        at for at, name in enumerate(ARKIT_SHAPES) if columns[at] >= 0 and name.startswith(HELPER_PREFIXES)
    ], np.int64)  # fmt: skip
    if not len(helpers) or not len(others):
        return None
    own = face.shapes[columns[helpers]].reshape(len(helpers), -1).astype(np.float64)
    # a face without landmarks has no shapes for gestures that it lacks
    if not own.any():
        return None
    # the sums of single precision differ with the number of threads
    curvature = own @ own.T
    curvature += RIDGE * float(np.trace(curvature)) / len(curvature) * np.eye(len(curvature))
    cross = own @ face.shapes[others].reshape(len(others), -1).astype(np.float64).T
    return Expressed(others, helpers, curvature, cross)


def _by_mouth(
    face: Face, channels: tuple[str, ...], others: NDArray[np.int64], prefixes: tuple[str, ...]
) -> Expressed | None:
    """Visemes and a bent mouth by its visible motion; jaw and lips that the face lacks move as on the default head."""
    if not len(others):
        return None
    names = [name for name in ARKIT_SHAPES if name.startswith(prefixes) and name not in NO_VISEME]
    complete = add_missing_shapes(stand_in(face), names)
    rows = np.array([complete.shape_names.index(name) for name in (*names, *(channels[at] for at in others))])
    products = mouth_products(complete, rows)
    helpers, curvature = np.array([ARKIT_SHAPES.index(name) for name in names]), products[: len(names), : len(names)]
    curvature += SPREAD * float(np.median(np.diag(curvature))) * np.eye(len(names))
    return Expressed(others, helpers, curvature, products[: len(names), len(names) :])
