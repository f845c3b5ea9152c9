"""Motion as the 52 blend shapes of ARKit, with other shapes of the face expressed by them."""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.interchange.exports.parts import Target
from tts2face.models.face import Face
from tts2face.numeric.arrays import Float32Array
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
RIDGE = 1e-3  # of the mean curvature: prefers small changes where several shapes do the same
# By face and channels: they take a tenth of a second, and every clip of lines needs them.
_PRODUCTS: WeakKeyDictionary[Face, dict[tuple[str, ...], tuple[NDArray[np.float64], NDArray[np.float64]]]]
_PRODUCTS = WeakKeyDictionary()


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
    # the products of a face's shapes are the same for each clip of it
    products = _PRODUCTS.setdefault(face, {})
    if channels not in products:
        products[channels] = _inner_products(face, columns[helpers], others)
    return ArkitProjection(columns, others, helpers, *products[channels])


def _inner_products(
    face: Face, helpers: NDArray[np.int64], others: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    own = face.shapes[helpers].reshape(len(helpers), -1).astype(np.float64)  # the sums of single precision differ
    curvature = own @ own.T  # with the number of threads
    curvature += RIDGE * float(np.trace(curvature)) / len(curvature) * np.eye(len(curvature))
    return curvature, own @ face.shapes[others].reshape(len(others), -1).astype(np.float64).T
