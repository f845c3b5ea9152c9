"""Expressions of a drawn character: smiles and squints without creases, and the slight smile at rest."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from corpus_tools.drawn.fields import bump
from corpus_tools.drawn.lids import keep_outside
from corpus_tools.head.lids import LidEdge
from corpus_tools.head.piece import Eyeball
from corpus_tools.head.shapes import neighbour_means, smoothed
from corpus_tools.head.skin import Skin
from tts2face.numeric import smoothstep

Floats = NDArray[np.float64]

SIDES = (("Left", 1.0), ("Right", -1.0))
SMILES, N_SMILE_MEANS = ("mouthSmile", "mouthDimple", "mouthStretch", "noseSneer", "mouthUpperUp"), 120
SQUINTS, N_SQUINT_MEANS = ("eyeSquint", "cheekSquint"), 30
LID_MM, MOUTH_MM = (1.5, 7.0), (13.0, 20.0)  # distances over which the smoothing begins
CORNER_MM, CHEEK_MM = np.array([1.5, 3.0, 1.5]), np.array([1.0, 1.6, 2.6])  # a smile lifts these more than MakeHuman's


def soften(skin: Skin, lids: Sequence[LidEdge]) -> Skin:
    """Smiles and squints whose motion of the cheeks is one smooth field; a smile lifts round cheeks."""
    means, shapes, places = neighbour_means(skin), dict(skin.shapes), skin.vertices
    rims = np.concatenate([places[np.concatenate([edge.upper, edge.lower])] for edge in lids])
    off_lids = smoothstep(np.asarray(cKDTree(rims).query(places)[0]), *LID_MM)
    off_mouth = smoothstep(np.linalg.norm((places - [0, -59, 24]) * [0.80, 1.25, 0.5], axis=1), *MOUTH_MM)
    for names, share, n_means in ((SMILES, off_mouth * off_lids, N_SMILE_MEANS), (SQUINTS, off_lids, N_SQUINT_MEANS)):
        for name in (stem + side for stem in names for side, _ in SIDES):
            shapes[name] = smoothed(shapes[name], share, means, n_means)
    for side, sign in SIDES:
        outward = np.array([sign, 1.0, 1.0])
        corner = bump(places, (sign * 22, -58, 20), (11, 9, 20))
        cheek = bump(places, (sign * 37, -32, 18), (17, 14, 24)) * off_lids
        lift = corner[:, None] * outward * CORNER_MM + cheek[:, None] * outward * CHEEK_MM
        shapes[f"mouthSmile{side}"] = shapes[f"mouthSmile{side}"] + lift
    return replace(skin, shapes=shapes)


def rest_in(skin: Skin, weights: Mapping[str, float], balls: Sequence[Eyeball]) -> Skin:
    """The skin with weights of its shapes (without sides) as the rest pose; blinks still shut."""
    lift = np.zeros_like(skin.vertices)
    for name, weight in weights.items():
        lift += weight * (skin.shapes[f"{name}Left"] + skin.shapes[f"{name}Right"])
    left = 1 - weights.get("eyeBlink", 0.0)
    shapes = {name: left * moved if name.startswith("eyeBlink") else moved for name, moved in skin.shapes.items()}
    return replace(skin, vertices=keep_outside(skin, skin.vertices + lift, balls), shapes=shapes)
