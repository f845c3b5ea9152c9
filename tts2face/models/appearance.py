"""Appearance model of a talker: texture models over the landmarks, and a segment of its video as the background.

The appearance model of Theobald et al. 2007, section 2: the picture inside the landmarks' mesh, warped to a reference
shape, is ``mean + sum_i b_i basis_i`` (eq. 2). The inside of the mouth has a separate model, so that teeth and tongue
stay sharp (design of Cosker et al. 2004; measured in docs/decisions/032-own-face.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError

STEPS_PER_PARAMETER = 1000.0  # appearance parameters are stored as 16-bit integers in steps of spread / 1000


@dataclass(frozen=True, slots=True, eq=False)
class TextureModel:
    """Linear texture model on a reference shape: ``texture = mean + sum_i b_i basis_i``, sRGB values from 0 to 255.

    Parameters
    ----------
    reference : (N, 2)
        Positions of the model's points in the texture, pixels (x right, y down, from the centre of the top left one).
    triangles : (F, 3)
        Point indices.
    size
        (width, height) of the texture, pixels.
    pixels : (P,)
        Texture pixels inside the mesh, as ``y * width + x``.
    mean : (P, 3)
        Mean colours.
    basis : (A, P, 3)
        Orthonormal as rows of (A, 3 P).
    spread : (A,)
        Standard deviation of each parameter over the training frames.
    """

    reference: NDArray[np.float32]
    triangles: NDArray[np.int32]
    size: tuple[int, int]
    pixels: NDArray[np.int32]
    mean: NDArray[np.float32]
    basis: NDArray[np.float32]
    spread: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree."""
        n_modes, n_pixels = self.basis.shape[:2]
        fits = self.mean.shape == (n_pixels, 3) and self.pixels.shape == (n_pixels,) and self.spread.shape == (n_modes,)
        if not fits or self.basis.shape[2:] != (3,) or self.reference.shape[1:] != (2,):
            raise DataError("the texture model's mean, basis, spread and pixels do not fit each other; build it again")

    @property
    def n_modes(self) -> int:
        """Number of parameters."""
        return len(self.basis)

    def parameters(self, textures: NDArray[np.floating]) -> NDArray[np.float32]:
        """Parameters (T, A) of textures (T, P, 3)."""
        offsets = (textures.astype(np.float32) - self.mean).reshape(len(textures), -1)
        return np.asarray(offsets @ self.basis.reshape(self.n_modes, -1).T, np.float32)

    def textures(self, parameters: NDArray[np.floating]) -> NDArray[np.float32]:
        """Textures (T, P, 3) for parameters (T, a) of the first a modes."""
        n_modes = parameters.shape[1]
        offsets = parameters.astype(np.float32) @ self.basis[:n_modes].reshape(n_modes, -1)
        return self.mean + offsets.reshape(len(parameters), *self.mean.shape)


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """Segment of the talker's video on which synthesised frames are drawn.

    Parameters
    ----------
    video
        Bytes of an MP4 file with T frames at the recorded size.
    points : (T, N, 2)
        Landmarks followed by the ring around them, pixels.
    axes : (T, 2, 3)
        Pixels (right, down) per millimetre along each landmark axis: the head rotation and scale.
    shape : (T, M)
        Parameters of the talker's shape model.
    texture_parameters : (T, A)
        Parameters of the face's texture model.
    """

    video: NDArray[np.uint8]
    points: NDArray[np.float32]
    axes: NDArray[np.float32]
    shape: NDArray[np.float32]
    texture_parameters: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """Texture models of a talker's face and inner mouth, and the plate that they are drawn on.

    Parameters
    ----------
    face
        Texture model of the landmarks' mesh, whose points are the landmarks and a ring around them.
    mouth
        Texture model of the area between the inner lips; its points are `mouth_points`.
    mouth_points : (R,)
        Landmark indices of the inner lip contour, in the order of the mouth's reference.
    moved_by_speech : (P,)
        Weight of each face texture pixel: 1 where speech changes the picture, 0 where the plate is unchanged.
    plate
        Background video.
    """

    face: TextureModel
    mouth: TextureModel
    mouth_points: NDArray[np.int32]
    moved_by_speech: NDArray[np.float32]
    plate: Plate

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the appearance parameters: those of the face texture, then those of the mouth texture."""
        faces = tuple(f"face{i}" for i in range(self.face.n_modes))
        return faces + tuple(f"mouth{i}" for i in range(self.mouth.n_modes))

    @property
    def spread(self) -> NDArray[np.float32]:
        """Standard deviations (A + B,) of the appearance parameters."""
        return np.concatenate([self.face.spread, self.mouth.spread])


def nearest_pixels(model: TextureModel) -> NDArray[np.int64]:
    """Index (h w,) into `model.pixels` of the mesh pixel nearest to each texture pixel."""
    from scipy.ndimage import distance_transform_edt

    width, height = model.size
    empty = np.ones(width * height, bool)
    empty[model.pixels] = False
    y, x = distance_transform_edt(empty.reshape(height, width), return_distances=False, return_indices=True)
    place = np.zeros(width * height, np.int64)
    place[model.pixels] = np.arange(len(model.pixels))
    nearest: NDArray[np.int64] = place[(y * width + x).ravel()]
    return nearest


def appearance_arrays(appearance: Appearance) -> dict[str, NDArray[Any]]:
    """Arrays of an appearance for a talker file; inverse of `appearance_from_arrays`."""
    arrays: dict[str, NDArray[Any]] = {
        "appearance.mouth_points": appearance.mouth_points,
        "appearance.moved_by_speech": appearance.moved_by_speech.astype(np.float16),
    }
    for name, model in (("face", appearance.face), ("mouth", appearance.mouth)):
        arrays |= {
            f"appearance.{name}.reference": model.reference,
            f"appearance.{name}.triangles": model.triangles,
            f"appearance.{name}.size": np.array(model.size, np.int32),
            f"appearance.{name}.pixels": model.pixels,
            f"appearance.{name}.mean": model.mean.astype(np.float16),
            f"appearance.{name}.basis": model.basis.astype(np.float16),
            f"appearance.{name}.spread": model.spread,
        }
    for part in ("video", "points", "axes", "shape"):
        arrays[f"appearance.plate.{part}"] = getattr(appearance.plate, part)
    arrays["appearance.plate.looks"] = appearance.plate.texture_parameters
    return arrays


def appearance_from_arrays(arrays: Mapping[str, NDArray[Any]]) -> Appearance | None:
    """Appearance in the arrays of a talker file, or None.

    Raises
    ------
    KeyError
        A part is missing.
    """
    if "appearance.mouth_points" not in arrays:
        return None

    def model(name: str) -> TextureModel:
        def part(key: str) -> NDArray[Any]:
            return arrays[f"appearance.{name}.{key}"]

        width, height = (int(side) for side in part("size"))
        return TextureModel(
            reference=part("reference"),
            triangles=part("triangles"),
            size=(width, height),
            pixels=part("pixels"),
            mean=part("mean").astype(np.float32),
            basis=part("basis").astype(np.float32),
            spread=part("spread"),
        )

    plate = Plate(
        video=arrays["appearance.plate.video"],
        points=arrays["appearance.plate.points"],
        axes=arrays["appearance.plate.axes"],
        shape=arrays["appearance.plate.shape"],
        texture_parameters=arrays["appearance.plate.looks"],
    )
    return Appearance(
        face=model("face"),
        mouth=model("mouth"),
        mouth_points=arrays["appearance.mouth_points"],
        moved_by_speech=arrays["appearance.moved_by_speech"].astype(np.float32),
        plate=plate,
    )
