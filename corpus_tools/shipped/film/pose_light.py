"""Light of a character in its poses and from several cameras, as the path tracer saw it."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array
from tts2face.picture.camera_view import CameraView

CAMERA_YAWS_DEG = (-35, -20, 20, 35)  # about the face at rest
SKIN, FAR = ("skin",), ("hair", "shirt")  # parts with a texture of light: those that speak, and those that do not
MOUTH = ("teeth", "gums", "tongue")
FRONT = CameraView(0, 3, share=0.86)  # that sees the poses


@dataclass(frozen=True, slots=True, eq=False)
class PoseLight:
    """Light of P poses, the first at rest, of T turns of the head among them, and of C cameras round the pose at rest.

    Colours are as displayed, 0..1; those of eyeballs are linear light on white.

    Attributes
    ----------
    names : (P,)
    weights : (P, K)
    heads : (P, 6)
    skin_rest, far_rest : (S, S, 3)
        In texels at rest.
    skin : (P, s, s, 3)
    far : (T + C + 1, s, s, 3)
        Of hair and clothes at rest, in the turns of the head, then from the cameras.
    skin_from : (C, s, s, 3)
        Of the skin from the cameras.
    far_other : (C, h, S / 2, 3)
        Of hair at rest in other colours, to the bottom of its tiles.
    other_colours : (1 + C, 3)
        The hair's own colour and the others, sRGB.
    other_vertices : (C, N, 3)
        Colours of the face's last vertices, those of the hair, in the others.
    rows : (N,)
        Vertices of the face whose light ``small`` (P, N, 3) holds: of all other parts; in turns of the head, as at
        rest.
    view : (33, 33, 33, 3)
        View transform at `tts2face.models.baked_light.table_levels`.
    lamps : (L, 17)
        As eyes mirror them (`tts2face.models.baked_light`).
    backdrop : (S, S, 3)
        The wall, out of focus.
    """

    names: NDArray[np.str_]
    weights: Float32Array
    heads: Float32Array
    skin_rest: Float32Array
    far_rest: Float32Array
    skin: Float32Array
    far: Float32Array
    skin_from: Float32Array
    far_other: Float32Array
    other_colours: Float32Array
    other_vertices: NDArray[np.uint8]
    rows: NDArray[np.int64]
    small: Float32Array
    view: Float32Array
    lamps: Float32Array
    backdrop: NDArray[np.uint8]

    def save(self, path: Path) -> None:
        """Write into an .npz file."""
        np.savez_compressed(path, **{field.name: getattr(self, field.name) for field in fields(self)})

    @classmethod
    def load(cls, path: Path) -> "PoseLight":
        """Read what `save` wrote."""
        with np.load(path) as stored:
            return cls(**{field.name: stored[field.name] for field in fields(cls)})
