"""Texels of the skin that are visible from the front: the face without eyes, inner mouth and hidden parts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.mesh_fit import OPEN_JAW_WEIGHT, face_landmarks
from corpus_tools.dense.texels import ISLANDS_TOP, Texels, find_texels
from lexicon.errors import DataError
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LID_RINGS,
    N_MESH_LANDMARKS,
)
from tts2face.numeric.arrays import FloatArray, smoothstep
from tts2face.numeric.kernels import kernel

INNER_LIPS = (*INNER_LIP_UPPER, *INNER_LIP_LOWER[-2:0:-1])
CELL_MM = 0.75  # of the grid in which the foremost surface is found
HIDDEN_MM = 5.0  # depth behind the foremost surface from which a texel is hidden; slopes within a cell are less
RIM_MM = (3.0, 16.0)  # inside the face's oval: the share of the talker's colour is 0 up to the first, 1 from the second
LID_MM = (0.8, 2.2)  # from the lids' edge, where lashes and the wet rim mix with the skin
LIP_MM = (0.4, 1.4)  # from the inner lips' edge, where the dark between them does
MASK_BLUR = 2.0  # texels


@dataclass(frozen=True, slots=True, eq=False)
class SkinCanvas:
    """The skin texture of a head, to be painted.

    Parameters
    ----------
    texture : (S, S, 3)
        The head's texture, sRGB.
    texels
        Texels of the textured parts, P of them.
    opened : (V, 3)
        The face with its jaw slightly open.
    share : (P,)
        Share of the talker's colour in each texel, 0 to 1.
    in_mouth : (P,)
        Texels of the inner mouth, which are not changed.
    """

    texture: NDArray[np.uint8]
    texels: Texels
    opened: FloatArray
    share: FloatArray
    in_mouth: NDArray[np.bool_]


def build_canvas(face: Face) -> SkinCanvas:
    """The canvas of an adapted head."""
    if face.uv is None or not face.textures:
        raise DataError("the head has no texture to paint a talker's skin on; build the shipped faces again")
    spans = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.texture == 0]
    triangles = np.concatenate(spans).astype(np.int64)
    skin = face.textures[0].pixels
    side = len(skin)
    texels = find_texels(face.uv.astype(np.float64), triangles, side)
    jaw = face.shapes[face.shape_names.index("jawOpen")]
    opened = face.vertices.astype(np.float64) + OPEN_JAW_WEIGHT * jaw
    island = texels.rows > ISLANDS_TOP * side - 1
    share = _front_share(face, texels, opened)
    share[island] = 0.0
    # where the layout of the shipped heads has the mouth
    in_mouth = island & (texels.columns < 0.24 * side)
    return SkinCanvas(skin, texels, opened, soften_edges(share, texels, side), in_mouth)


def _front_share(face: Face, texels: Texels, opened: FloatArray) -> FloatArray:
    place = texels.interpolate(opened)
    marks = face_landmarks(face, opened)[:N_MESH_LANDMARKS]
    share = smoothstep(polygon_depth(place[:, :2], marks[list(FACE_OVAL), :2], RIM_MM[1] + 1), *RIM_MM)
    share[place[:, 2] < float(marks[list(FACE_OVAL), 2].min())] = 0.0
    share[_is_hidden(place)] = 0.0
    seen = np.flatnonzero(share)
    for edge, limits in ((INNER_LIPS, LIP_MM), *((lids, LID_MM) for lids in LID_RINGS)):
        depth = polygon_depth(place[seen, :2], marks[list(edge), :2], limits[1] + 1)
        share[seen] *= smoothstep(-depth, *limits)
    return share


def _is_hidden(place: FloatArray) -> NDArray[np.bool_]:
    """(P,) whether a texel is hidden by another."""
    cells = np.floor(place[:, :2] / CELL_MM).astype(np.int64)
    cells -= cells.min(axis=0)
    foremost = np.full(tuple(cells.max(axis=0) + 1), -np.inf)
    np.maximum.at(foremost, (cells[:, 0], cells[:, 1]), place[:, 2])
    hidden: NDArray[np.bool_] = place[:, 2] < foremost[cells[:, 0], cells[:, 1]] - HIDDEN_MM
    return hidden


def polygon_depth(places: FloatArray, polygon: FloatArray, most: float) -> FloatArray:
    """(P,) signed distance of points (P, 2) from a polygon's edge, positive inside, limited to `most`."""
    low, high = polygon.min(axis=0) - most, polygon.max(axis=0) + most
    near = np.flatnonzero(((places > low) & (places < high)).all(axis=1))
    depth = np.full(len(places), -most)
    found = np.zeros(len(near))
    _polygon_depths(places[near], polygon, found)
    depth[near] = found
    clipped: FloatArray = np.clip(depth, -most, most)
    return clipped


@kernel
def _polygon_depths(places, polygon, depths):  # type: ignore[no-untyped-def]
    """Write signed distances (P,) of points (P, 2) from a polygon's edge, positive inside (even-odd rule)."""
    for number in range(len(places)):
        x, y = places[number]
        least, is_inside = np.inf, False
        ax, ay = polygon[-1]
        for corner in range(len(polygon)):
            bx, by = polygon[corner]
            along_x, along_y = bx - ax, by - ay
            length = max(along_x * along_x + along_y * along_y, 1e-12)
            t = min(max(((x - ax) * along_x + (y - ay) * along_y) / length, 0.0), 1.0)
            least = min(least, np.hypot(x - ax - t * along_x, y - ay - t * along_y))
            if (ay > y) != (by > y) and x < ax + (y - ay) * along_x / along_y:
                is_inside = not is_inside
            ax, ay = bx, by
        depths[number] = least if is_inside else -least


def soften_edges(share: FloatArray, texels: Texels, side: int) -> FloatArray:
    """Blurred shares (P,) that do not exceed the original ones."""
    return np.minimum(share, texels.blurred(share[:, None], side, MASK_BLUR)[:, 0])
