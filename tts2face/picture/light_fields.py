"""Visibility of light around each vertex as a smooth function of its direction, for renderers without shadow bits.

The hidden directions of a vertex (`tts2face.picture.occlusion`) are fitted by spherical harmonics up to order 2: nine
numbers instead of 128 bits, enough for the soft shadows of large lamps from any side. Source: Sloan, Kautz and Snyder
2002, Precomputed radiance transfer.
"""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.numeric.arrays import Float32Array
from tts2face.picture.light import HIDDEN_EYE_LIGHT, HIDDEN_TOOTH_LIGHT, N_SMOOTHING_PASSES, smooth_values
from tts2face.picture.occlusion import occlusion_of, occlusion_poses, pose_normals, sphere_directions
from tts2face.picture.surface import Surface

N_HARMONICS = 9


def harmonics(directions: NDArray[np.floating]) -> NDArray[np.float64]:
    """Values (D, 9) of the polynomials 1, x, y, z, xy, yz, zx, x^2 - y^2, 3 z^2 - 1 at unit vectors (D, 3)."""
    x, y, z = np.asarray(directions, np.float64).T
    return np.column_stack([np.ones(len(x)), x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1])


def light_fields(face: Face, surface: Surface, threads: int) -> Float32Array:
    """Visibility (V, 20): share of the sky and nine coefficients of `harmonics`, and how they grow as the mouth opens.

    The last ten are added with the square root of the lip opening, as in `tts2face.picture.light`.
    """
    hidden = occlusion_of(face, surface, threads)
    poses = [
        _pose_field(surface, pose_normals(surface, pose), bits)
        for pose, bits in zip(occlusion_poses(face), hidden, strict=True)
    ]
    for part in face.parts:
        if part.name.startswith("teeth"):
            _raise(poses[-1], np.unique(face.triangles[part.first : part.first + part.count]), HIDDEN_TOOTH_LIGHT, 90)
    return np.concatenate([poses[0], poses[-1] - poses[0]], axis=1)


def _pose_field(surface: Surface, normals: Float32Array, bits: NDArray[np.uint8]) -> Float32Array:
    directions = sphere_directions(8 * bits.shape[1])
    seen = (1 - np.unpackbits(bits, axis=1)).astype(np.float32)
    facing = np.maximum(normals @ directions.T.astype(np.float32), np.float32(0.02))
    sky = (facing * seen).sum(axis=1) / facing.sum(axis=1)
    fit = np.linalg.pinv(harmonics(directions)).T.astype(np.float32)
    field = np.ascontiguousarray(np.column_stack([sky, seen @ fit]), np.float32)
    sums = np.zeros((len(surface.triangles), field.shape[1]), np.float32)
    for _ in range(N_SMOOTHING_PASSES):
        smooth_values(surface.triangles, surface.starts, surface.members, field, sums)
    for first, end in surface.rig.eye_spans:
        _raise(field, np.arange(first, end), HIDDEN_EYE_LIGHT, 85)
    return field


def _raise(field: Float32Array, rows: NDArray[np.integer], share: float, percentile: float) -> None:
    """Give some vertices at least a share of the mean light of the brightest of them, in place."""
    if not len(rows):
        return
    for column in (0, 1):
        least = share * np.percentile(field[rows, column], percentile)
        low = field[rows, column] < least
        if column == 1:
            field[np.ix_(rows[low], range(2, 1 + N_HARMONICS))] = 0.0  # the same light from all directions
        field[rows[low], column] = least
