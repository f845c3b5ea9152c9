"""Correction of a picture's light to that of a reference texture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array

GAIN_LIMITS = (0.5, 2.0)  # beyond them it is another scene, not another light


@dataclass(frozen=True, slots=True, eq=False)
class LightingCorrection:
    """``texture in the reference's light = gain * texture + offset``, each (3,)."""

    gain: Float32Array
    offset: Float32Array

    def apply(self, texture: Float32Array) -> Float32Array:
        """(P, 3) a texture in the reference's light."""
        return self.gain * texture + self.offset


def fit_lighting(texture: Float32Array, reference: Float32Array, still: NDArray[np.bool_]) -> LightingCorrection:
    """The light of a recording whose mean texture (P, 3) this is, by least squares on the pixels that speech leaves.

    Parameters
    ----------
    still : (P,)
        Pixels to compare.
    """
    here, there = texture[still].astype(np.float64), reference[still].astype(np.float64)
    centred = here - here.mean(axis=0)
    gain = (centred * (there - there.mean(axis=0))).sum(axis=0) / np.maximum((centred**2).sum(axis=0), 1e-9)
    gain = np.clip(gain, *GAIN_LIMITS)
    offset = there.mean(axis=0) - gain * here.mean(axis=0)
    return LightingCorrection(gain.astype(np.float32), offset.astype(np.float32))
