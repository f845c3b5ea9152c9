"""Transfer of appearance parameters from one person's texture model to another's."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.appearance.frame import rasterise_triangles
from tts2face.lips.cloning import MAX_STANDARD_DEVIATIONS
from tts2face.models.appearance import Appearance, TextureModel, nearest_pixels
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.kernels.warps import sample_triangles


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceTransfer:
    """Linear map of appearance parameters: ``relation`` (A, B) from source to target; ``limits`` (A,) of the target."""

    relation: FloatArray
    limits: FloatArray

    def parameters(self, parameters: NDArray[np.floating], *, gain: float = 1.0) -> NDArray[np.float32]:
        """(T, A) appearance parameters of the target for (T, B) of the source."""
        wanted = gain * (parameters.astype(np.float64) @ self.relation.T)
        return np.clip(wanted, -self.limits, self.limits).astype(np.float32)


def build_appearance_transfer(source: Appearance, target: Appearance) -> AppearanceTransfer:
    """Map of appearance parameters from one talker to another, face to face and mouth to mouth.

    Notes
    -----
    The source's basis textures are warped piecewise to the target's reference shape, and ``relation`` contains their
    inner products with the target's (Theobald et al. 2007, eq. 5). Textures of all talkers are sRGB.
    """
    blocks = [
        _basis_products(source.face, target.face),
        _basis_products(source.mouth, target.mouth),
    ]
    relation = np.zeros((sum(len(block) for block in blocks), sum(block.shape[1] for block in blocks)))
    (n_target, n_source), (face, mouth) = blocks[0].shape, blocks
    relation[:n_target, :n_source] = face
    relation[n_target:, n_source:] = mouth
    return AppearanceTransfer(relation, MAX_STANDARD_DEVIATIONS * target.spread.astype(np.float64))


def _basis_products(source: TextureModel, target: TextureModel) -> FloatArray:
    """(A, B) inner products of the target's basis textures with the source's, warped to the target's frame."""
    owner, weights = rasterise_triangles(target.reference.astype(np.float64), target.triangles, target.size)
    corners = target.triangles[owner[target.pixels]].astype(np.int32)
    inside = weights[target.pixels].astype(np.float32)
    fill = nearest_pixels(source)
    width, height = source.size
    own = target.basis.reshape(target.n_modes, -1).astype(np.float64)
    warped = np.zeros((len(target.pixels), 3), np.float32)
    relation = np.zeros((target.n_modes, source.n_modes))
    for number, texture in enumerate(source.basis):
        picture = np.ascontiguousarray(texture[fill].reshape(height, width, 3))
        sample_triangles(picture, source.reference.astype(np.float64), corners, inside, warped)
        relation[:, number] = own @ warped.ravel()
    return relation
