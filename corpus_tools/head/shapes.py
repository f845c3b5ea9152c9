"""Mends to MakeHuman's face units: folds that a strong smile breaks the cheek into are smoothed, brows rise more."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from corpus_tools.head.noise import ramp
from corpus_tools.head.skin import Skin

Floats = NDArray[np.float64]

SOFTENED = ("mouthSmileLeft", "mouthSmileRight", "mouthDimpleLeft", "mouthDimpleRight", "cheekPuff")
STRONGER = {  # a real brow rises 8 mm, theirs 5; their upper lids hardly follow a gaze that goes up
    "browInnerUp": 1.6,
    "browOuterUpLeft": 1.4,
    "browOuterUpRight": 1.4,
    "eyeLookUpLeft": 1.7,
    "eyeLookUpRight": 1.7,
}
N_MEANS = 14  # means over neighbours: folds narrower than about 10 mm go
MOUTH = np.array([0.0, 6.585, 1.50])  # on the source's base mesh, its units
NEAR, FAR = 0.30, 0.46  # lips closer than this keep their shape; cheeks further than that are smoothed
BELOW_EYES = 7.10


def softened(skin: Skin) -> Skin:
    """The skin with smoother cheeks and livelier brows."""
    beside = neighbours(skin)
    off = (skin.base - MOUTH) * [0.85, 1.25, 0.6]
    share = ramp(np.linalg.norm(off, axis=1), NEAR, FAR) * ramp(skin.base[:, 1], BELOW_EYES, BELOW_EYES - 0.12)
    shapes = dict(skin.shapes)
    for name in SOFTENED:
        smooth = shapes[name]
        for _ in range(N_MEANS):
            smooth = 0.3 * smooth + 0.7 * (beside @ smooth)
        shapes[name] = shapes[name] + share[:, None] * (smooth - shapes[name])
    for name, factor in STRONGER.items():
        shapes[name] = factor * shapes[name]
    return replace(skin, shapes=shapes)


def neighbours(skin: Skin) -> sparse.csr_array:
    """(N, N) means over the vertices that share an edge, those of a seam counting as one."""
    _, weld = np.unique(np.rint(skin.base * 1e6).astype(np.int64), axis=0, return_inverse=True)
    weld = weld.ravel()
    n, m = len(weld), int(weld.max()) + 1
    sides = weld[np.stack([skin.quads, np.roll(skin.quads, -1, axis=1)], axis=-1).reshape(-1, 2)]
    pairs = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0)
    one = sparse.csr_array((np.ones(len(pairs)), pairs.T), shape=(m, m))
    first = np.zeros(m, np.int64)
    first[weld] = np.arange(n)
    mean = sparse.csr_array(sparse.diags_array(1.0 / one.sum(axis=1)) @ one).tocoo()
    rows = sparse.csr_array((mean.data, (mean.row, first[mean.col])), shape=(m, n))
    return sparse.csr_array(rows[weld])
