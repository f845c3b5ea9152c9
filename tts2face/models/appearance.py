"""Appearance model of a talker: texture models over the landmarks, and a segment of its video as the background.

The appearance model of Theobald et al. 2007, section 2: the picture inside the landmarks' mesh, warped to a reference
shape, is ``mean + sum_i b_i basis_i`` (eq. 2). The inside of the mouth has a separate model, so that teeth and tongue
stay sharp (design of Cosker et al. 2004; measured in docs/decisions/032-own-face.md).
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.codec import Stored, StoredModel, Submodel, half
from tts2face.models.landmarks import FACE_OVAL, N_MESH_LANDMARKS
from tts2face.storage.schema import Contents, Tensor, millimetres

STEPS_PER_PARAMETER = 1000.0  # appearance parameters are stored as 16-bit integers in steps of spread / 1000
APPEARANCE = "appearance"  # name of an appearance before those of its arrays
# of any place in a picture
MAX_PX = 1e5
# of a frame of the video
MAX_SIDE_PX = 4096
# of any appearance parameter: a damaged file must not overflow
MAX_PARAMETER = 1e6
N_POINTS = N_MESH_LANDMARKS + len(FACE_OVAL)


def _whole_numbers(array: NDArray[np.int32]) -> tuple[int, ...]:
    return tuple(int(number) for number in array)


@dataclass(frozen=True, slots=True, eq=False)
class TextureModel(StoredModel):
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

    reference: Annotated[NDArray[np.float32], Tensor("float32", ("points of {own}", 2), -MAX_PX, MAX_PX)]
    triangles: Annotated[NDArray[np.int32], Tensor("int32", ("triangles of {own}", 3))]
    size: Annotated[tuple[int, int], Stored(Tensor("int32", (2,), 1, MAX_SIDE_PX), decode=_whole_numbers)]
    pixels: Annotated[NDArray[np.int32], Tensor("int32", ("pixels of {own}",))]
    mean: Annotated[NDArray[np.float32], half("pixels of {own}", 3, low=-1e4, high=1e4)]
    basis: Annotated[NDArray[np.float32], half("{own} parameters", "pixels of {own}", 3, low=-1.01, high=1.01)]
    spread: Annotated[NDArray[np.float32], Tensor("float32", ("{own} parameters",), 0.0, MAX_PARAMETER)]

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree."""
        n_modes, n_pixels = self.basis.shape[:2]
        fits = self.mean.shape == (n_pixels, 3) and self.pixels.shape == (n_pixels,) and self.spread.shape == (n_modes,)
        if not fits or self.basis.shape[2:] != (3,) or self.reference.shape[1:] != (2,):
            raise DataError("the texture model's mean, basis, spread and pixels do not fit each other; build it again")

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse numbers of points and pixels that there are not."""
        own = prefix.rpartition(".")[2]
        width, height = (int(side) for side in contents.arrays[f"{prefix}.size"])
        contents.indices(f"{prefix}.triangles", contents.sizes[f"points of {own}"], "points")
        contents.indices(f"{prefix}.pixels", width * height, "pixels")
        contents.distinct(f"{prefix}.pixels")

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
class Plate(StoredModel):
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

    video: Annotated[NDArray[np.uint8], Tensor("uint8", ("bytes",))]
    points: Annotated[NDArray[np.float32], Tensor("float32", ("{own}", N_POINTS, 2), -MAX_PX, MAX_PX)]
    axes: Annotated[NDArray[np.float32], Tensor("float32", ("{own}", 2, 3), -MAX_PX, MAX_PX)]
    shape: Annotated[NDArray[np.float32], millimetres("{own}", "modes", most=1e6)]
    texture_parameters: Annotated[
        NDArray[np.float32],
        Stored(Tensor("float32", ("{own}", "face parameters"), -MAX_PARAMETER, MAX_PARAMETER), "looks"),
    ]


@dataclass(frozen=True, slots=True, eq=False)
class Appearance(StoredModel):
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

    face: Annotated[TextureModel, Submodel(TextureModel)]
    mouth: Annotated[TextureModel, Submodel(TextureModel)]
    mouth_points: Annotated[NDArray[np.int32], Tensor("int32", ("points of mouth",))]
    moved_by_speech: Annotated[NDArray[np.float32], half("pixels of face", low=0.0, high=1.0)]
    plate: Annotated[Plate, Submodel(Plate)]

    @classmethod
    def prepare_check(cls, contents: Contents, prefix: str) -> None:
        """Points of the face are landmarks of its mesh."""
        contents.sizes["points of face"] = N_MESH_LANDMARKS

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse points of the mouth that the face has not."""
        contents.indices(f"{prefix}.mouth_points", N_MESH_LANDMARKS, "points of the face")

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
