"""What a talker's video shows at pixels of her face's texture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.appearance import TextureModel

Float32Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class TextureSamples:
    """Some pixels of a texture: where each lies in the mesh.

    ``pixels`` (Q,) are places in `TextureModel.pixels`; pixel q lies at the ``weights`` (Q, 3) of the mesh's points
    ``corners`` (Q, 3).
    """

    pixels: NDArray[np.int64]
    corners: NDArray[np.int32]
    weights: Float32Array

    def of(self, picture: NDArray[np.uint8], points: NDArray[np.floating]) -> Float32Array:
        """(Q, 3) colours of a picture (H, W, 3) whose mesh has these points (N, 2), between pixels."""
        height, width = picture.shape[:2]
        places = np.einsum("qc,qcd->qd", self.weights, points[self.corners])
        x, y = np.clip(places[:, 0], 0, width - 1.001), np.clip(places[:, 1], 0, height - 1.001)
        left, top = x.astype(np.int64), y.astype(np.int64)
        right, low = (x - left)[:, None], (y - top)[:, None]
        above = picture[top, left] * (1 - right) + picture[top, left + 1] * right
        below = picture[top + 1, left] * (1 - right) + picture[top + 1, left + 1] * right
        return np.asarray(above * (1 - low) + below * low, np.float32)


def texture_samples(model: TextureModel, chosen: NDArray[np.bool_]) -> TextureSamples:
    """Where the chosen (P,) pixels of a texture lie in its mesh; those between its triangles are left out."""
    pixels = np.flatnonzero(chosen)
    width = model.size[0]
    places = np.stack([model.pixels[pixels] % width, model.pixels[pixels] // width], axis=1).astype(np.float64)
    corners = np.zeros((len(pixels), 3), np.int32)
    weights = np.full((len(pixels), 3), -1.0)
    for triangle in model.triangles:
        a, b, c = model.reference[triangle].astype(np.float64)
        sides = np.column_stack([b - a, c - a])
        if abs(np.linalg.det(sides)) < 1e-9:
            continue
        along = (places - a) @ np.linalg.inv(sides).T
        found = np.column_stack([1 - along.sum(axis=1), along])
        better = found.min(axis=1) > weights.min(axis=1)
        corners[better], weights[better] = triangle, found[better]
    inside = weights.min(axis=1) > -1e-3
    return TextureSamples(pixels[inside], corners[inside], weights[inside].astype(np.float32))
