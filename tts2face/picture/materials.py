"""Materials of the parts of a face, and the scattering of light in its skin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.picture.kernels.shade import N_SCATTER_PASSES, SCATTER_MM
from tts2face.picture.kernels.tables import (
    DARK_GLOSS,
    EYE,
    GLOSS,
    N_MATERIAL_COLUMNS,
    OPACITY,
    OPEN_SURFACE,
    ROUGHNESS,
    SECOND_LOBE,
    TEXTURE,
    WRAP,
)

SKIN, EYE_KIND, STRANDS = "skin", "eye", "strands"  # kinds of parts
OPEN_SHARE = 0.05  # parts with a larger share of boundary edges are open sheets, lit from both sides
SKIN_ROUGHNESS = 0.0448  # squared width of the wide lobe of skin: a roughness of 0.46
SKIN_GLOSS = 0.5  # wide lobe of skin, as a share of the part's specular
SKIN_SECOND_LOBE = 0.42  # narrow lobe of skin, relative to the wide one
DARK_SKIN_GLOSS = 0.75  # share of the gloss that the darkest skin lacks
SKIN_WRAP = 0.6  # of skin, as a share of the part's wrap: light scatters to the vertices around, too


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Vertices of skin ``vertices`` (S,), their ``share`` (S, 3) for `scatter_light`, and the skin's triangles."""

    vertices: NDArray[np.int32]
    share: NDArray[np.float32]
    triangles: NDArray[np.int32]


NO_SKIN = Skin(np.zeros(0, np.int32), np.zeros((0, 3), np.float32), np.zeros(0, np.int32))


def material_table(face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32]) -> NDArray[np.float32]:
    """Materials (P, 9) of the parts, with the columns of `tts2face.picture.kernels.tables`."""
    rows = np.zeros((len(face.parts), N_MATERIAL_COLUMNS), np.float32)
    for number, (part, row) in enumerate(zip(face.parts, rows, strict=True)):
        row[GLOSS], row[ROUGHNESS] = part.specular, 2 / (part.shininess + 2)  # as wide as a Blinn-Phong highlight
        row[OPACITY], row[WRAP] = part.opacity, part.wrap
        row[TEXTURE] = part.texture if face.uv is not None else -1
        row[OPEN_SURFACE] = _free_edge_share(triangles[part_of == number]) > OPEN_SHARE
        if part.kind == SKIN:
            row[GLOSS], row[ROUGHNESS] = SKIN_GLOSS * part.specular, SKIN_ROUGHNESS
            row[SECOND_LOBE], row[DARK_GLOSS], row[WRAP] = SKIN_SECOND_LOBE, DARK_SKIN_GLOSS, SKIN_WRAP * part.wrap
        row[EYE] = part.kind == EYE_KIND
    return rows


def vertex_wrap(
    face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32], materials: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Wrap (V,) of diffuse light; negative on open sheets, which are lit from the side that the camera sees."""
    wrap = np.zeros(len(face.vertices), np.float32)
    of_part = np.where(materials[:, OPEN_SURFACE] > 0, -1 - materials[:, WRAP], materials[:, WRAP])
    wrap[triangles.ravel()] = np.repeat(of_part[part_of], 3)
    return wrap


def find_skin(face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32]) -> Skin:
    """Skin, whose light scatters over the distances of `SCATTER_MM` on the face at rest."""
    of_skin = np.flatnonzero(np.array([part.kind == SKIN for part in face.parts], bool)[part_of]).astype(np.int32)
    used = np.unique(triangles[of_skin]).astype(np.int32)
    if not len(used):
        return NO_SKIN
    corners = face.vertices[triangles].astype(np.float64)
    edges = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2)  # of corner k to its predecessor
    sums = np.zeros((len(face.vertices), 2))
    for k in range(3):
        np.add.at(sums[:, 0], triangles[:, k], edges[:, k] + edges[:, (k + 1) % 3])
        np.add.at(sums[:, 1], triangles[:, k], 2.0)
    squared = np.maximum(sums[used, 0] / np.maximum(sums[used, 1], 1.0), 1e-6)
    share = 2 * np.square(SCATTER_MM)[None, :] / (N_SCATTER_PASSES * squared[:, None])
    return Skin(used, np.minimum(share, 1.0).astype(np.float32), of_skin)


def _free_edge_share(triangles: NDArray[np.int32]) -> float:
    if not len(triangles):
        return 0.0
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    _, uses = np.unique((edges[:, 0] << 32) | edges[:, 1], return_counts=True)
    return float((uses == 1).mean())
