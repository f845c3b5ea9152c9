"""Linear face model with everything needed to draw it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError


@dataclass(frozen=True, slots=True)
class Part:
    """Named part of the surface with one material: the triangles [first, first + count) of the face.

    ``specular`` is the strength of the highlight (0 = matt), ``shininess`` its Blinn-Phong exponent, ``wrap`` the wrap
    of diffuse light around the shape (0 = hard, 1 = very soft, an approximation of subsurface scattering), ``opacity``
    is in (0, 1]. ``textured`` parts take their colour from the texture, the others from the vertex colours.
    """

    name: str
    first: int
    count: int
    specular: float = 0.0
    shininess: float = 16.0
    wrap: float = 0.0
    opacity: float = 1.0
    textured: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Eye:
    """Eyeball that rotates rigidly about its centre (3,), mm: the vertices [first, first + count).

    ``turns`` gives for each gaze shape (ARKit ``eyeLook...``) the rotation vector (3,), radians, at weight 1.
    """

    first: int
    count: int
    centre: NDArray[np.float32]
    turns: Mapping[str, NDArray[np.float32]]


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A linear face model with everything needed to draw it.

    Axes: x to the face's own left, y up, z out of the face; millimetres; origin midway between the eyeball centres.

    Parameters
    ----------
    vertices : (V, 3)
        The face at rest.
    triangles : (F, 3)
        Vertex indices, counter-clockwise seen from outside, in the order of `parts`.
    parts
        Cover all triangles in order.
    shape_names, shapes : (K,), (K, V, 3)
        Named basis (ARKit-52 names); displacement in mm at weight 1.
    limits : (K, 2)
        Least and greatest plausible weight.
    eyes
        Eyeballs; gaze shapes rotate them by `Eye.turns`, not by `shapes`.
    colours : (V, 3)
        sRGB, 0-255.
    uv, texture : (V, 2), (H, W, 3)
        Texture coordinates in [0, 1] from the top left corner of the texture, and its sRGB pixels; or None.
    landmarks, landmark_vertices, landmark_weights : (L,), (L, 3), (L, 3)
        Landmark `landmarks[i]` of `tts2face.models.landmarks` lies at the barycentric weights of three vertices.
    pivot : (3,)
        The point about which the head turns.
    metadata
        Name, licence, attribution, and the command that built it.
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    parts: tuple[Part, ...]
    shape_names: tuple[str, ...]
    shapes: NDArray[np.float32]
    limits: NDArray[np.float32]
    eyes: tuple[Eye, ...]
    colours: NDArray[np.uint8]
    uv: NDArray[np.float32] | None
    texture: NDArray[np.uint8] | None
    landmarks: NDArray[np.int32]
    landmark_vertices: NDArray[np.int32]
    landmark_weights: NDArray[np.float32]
    pivot: NDArray[np.float32]
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the arrays agree, then make them read-only."""
        n_vertices, n_shapes = len(self.vertices), len(self.shape_names)
        fits = (
            self.vertices.shape == (n_vertices, 3)
            and self.shapes.shape == (n_shapes, n_vertices, 3)
            and self.limits.shape == (n_shapes, 2)
            and self.colours.shape == (n_vertices, 3)
            and (self.uv is None or self.uv.shape == (n_vertices, 2))
            and self.landmark_vertices.shape == self.landmark_weights.shape == (len(self.landmarks), 3)
            and sum(part.count for part in self.parts) == len(self.triangles)
        )
        if not fits:
            raise DataError("the face's vertices, shapes, colours and landmarks do not fit each other; build it again")
        if self.triangles.size and not 0 <= int(self.triangles.min()) <= int(self.triangles.max()) < n_vertices:
            raise DataError(
                f"a triangle of the face has a vertex index beyond its {n_vertices} vertices; build it again"
            )
        for name in ("vertices", "triangles", "shapes", "limits", "colours", "uv", "texture", "pivot",
                     "landmarks", "landmark_vertices", "landmark_weights"):  # fmt: skip
            array = getattr(self, name)
            if array is not None:
                array.setflags(write=False)
