"""The texture layout: MakeHuman's, with the head enlarged so that eyes, nose and mouth get most pixels."""

import numpy as np

from corpus_tools.dense.texels import ISLANDS_TOP
from tts2face.numeric.arrays import FloatArray

SIDE = 1280  # pixels of the square texture
HEAD_BOTTOM = 0.80  # v at which the rows of the head end; the other islands begin at `ISLANDS_TOP`
# Where MakeHuman's layout has the head, and within it the face from brows to chin and from eye to eye.
HEAD_BOX = ((0.638, 0.997), (0.145, 0.822))
FACE = ((0.872, 0.055), (0.4835, 0.085))  # centre and half width along u and v
FACE_GAIN = 4.0
ISLANDS = {  # box in MakeHuman's layout -> box in this one, both (u low, u high, v low, v high)
    "mouth": ((0.75, 0.93, 0.0, 0.14), (0.005, 0.235, ISLANDS_TOP, 0.995)),
    "neck": ((0.15, 0.62, 0.80, 1.0), (0.245, 0.695, ISLANDS_TOP, 0.995)),
    "sockets": ((0.008, 0.155, 0.54, 0.64), (0.705, 0.995, ISLANDS_TOP, 0.995)),
}


def layout_coordinates(source_uv: FloatArray) -> FloatArray:
    """(N, 2) texture coordinates, v down, for MakeHuman's (N, 2), v up."""
    u, v = source_uv[:, 0], source_uv[:, 1]
    placed = np.column_stack([_stretch(u, HEAD_BOX[0], FACE[0]), HEAD_BOTTOM * (1 - _stretch(v, HEAD_BOX[1], FACE[1]))])
    for (low_u, high_u, low_v, high_v), (left, right, top, bottom) in ISLANDS.values():
        inside = (u > low_u) & (u < high_u) & (v > low_v) & (v < high_v)
        across = left + (u - low_u) / (high_u - low_u) * (right - left)
        down = bottom - (v - low_v) / (high_v - low_v) * (bottom - top)
        placed[inside] = np.column_stack([across, down])[inside]
    return placed


def _stretch(values: FloatArray, box: tuple[float, float], face: tuple[float, float]) -> FloatArray:
    """A box mapped monotonically to 0..1, with a higher density about the face's centre."""
    grid = np.linspace(box[0], box[1], 2001)
    density = 1.0 + FACE_GAIN * np.exp(-(((grid - face[0]) / face[1]) ** 4))
    share = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    placed: FloatArray = np.interp(values, grid, share / share[-1])
    return placed
