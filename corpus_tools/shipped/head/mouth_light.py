"""Light inside the mouth: wet flesh scatters the light that enters between the lips."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.models.face import Face
from tts2face.picture.occlusion import sphere_directions

MOUTH_PARTS = ("teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue")
AHEAD_Z = 0.2  # directions from which light enters the mouth, by their z
LIT_SHARE, TONGUE_LIT_SHARE = 0.45, 0.7  # of these directions, open to each vertex in addition to those seen from it
MOUTH_U, MOUTH_V = (0.75, 0.93), 0.14  # MakeHuman's island of the mouth's cavity
SEED = 5


def scatter_in_mouth(face: Face, skin: HeadSkin) -> Face:
    """A face whose mouth is lit from inside: as with open lips at rest, where it is hidden, and by scattered light.

    `skin` is that of the reference head, whose vertices correspond to the face's first ones.
    """
    if face.occlusion is None:
        return face
    bits = np.unpackbits(face.occlusion, axis=2)
    inside = mouth_vertices(face, skin)
    bits[0, inside] = bits[-1, inside]
    ahead = np.flatnonzero(sphere_directions(bits.shape[2])[:, 2] > AHEAD_Z)
    lit_share = np.where(np.isin(inside, part_vertices(face, ("tongue",))), TONGUE_LIT_SHARE, LIT_SHARE)
    is_lit = np.random.default_rng(SEED).random((len(inside), len(ahead))) < lit_share[:, None]
    for pose in bits:
        pose[np.ix_(inside, ahead)] &= ~is_lit
    return replace(face, occlusion=np.packbits(bits, axis=2))


def mouth_vertices(face: Face, skin: HeadSkin) -> NDArray[np.int64]:
    """Vertices of teeth, gums, tongue and the cavity."""
    u, v = skin.source_uv.T
    cavity = np.flatnonzero((u > MOUTH_U[0]) & (u < MOUTH_U[1]) & (v < MOUTH_V))
    return np.union1d(cavity, part_vertices(face, MOUTH_PARTS))


def part_vertices(face: Face, names: tuple[str, ...]) -> NDArray[np.int64]:
    """Vertices of the parts with these names."""
    triangles = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.name in names]
    return np.unique(np.concatenate(triangles)).astype(np.int64)
