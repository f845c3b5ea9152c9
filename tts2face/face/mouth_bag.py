"""A bag behind the lips of a face whose mesh ends at them, so that nothing behind the head is seen between them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face, FacePart
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray, connected_pieces

BAG_PART = "mouth bag"
LIPS = (*INNER_LIP_UPPER, *INNER_LIP_LOWER[-2:0:-1])
NEAR_SHARE = 0.12  # of the mouth's width: most median distance of an edge of the mesh from the landmarks of the lips
# Rings of the bag behind that edge, in widths of the mouth: depth, and how much further they are from the middle; the
# share of the lips' motion that they follow, and their sRGB.
DEPTHS = (0.06, 0.2, 0.55, 0.9)
WIDER = (0.03, 0.14, 0.18, 0.1)
FOLLOWED = (1.0, 0.9, 0.6, 0.3)
COLOURS = ((150, 70, 64), (120, 52, 48), (84, 36, 34), (48, 20, 19))
DECIMALS = 3  # of mm: vertices of a seam lie at one place


def close_mouth(face: Face) -> Face:
    """A face with a bag behind the edge of its mesh at the lips, if it has one; `face` without occlusion."""
    edges = _lip_edges(face)
    if not len(edges):
        return face
    rows, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(-1, 2)
    n, n_vertices = len(rows), len(face.vertices)
    places = face.vertices[rows].astype(np.float64)
    middle = places.mean(axis=0)
    width = float(np.ptp(places[:, 0]))
    out = (places - middle) * (1.0, 1.0, 0.0)
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-6)
    added: list[NDArray[np.floating]] = []
    moved: list[NDArray[np.floating]] = []
    colours: list[NDArray[np.uint8]] = []
    triangles: list[NDArray[np.int64]] = []
    before = rows
    for number, (depth, wider, follow, colour) in enumerate(zip(DEPTHS, WIDER, FOLLOWED, COLOURS, strict=True)):
        added.append(places + width * (wider * out - (0.0, 0.0, depth)))
        moved.append(follow * face.shapes[:, rows])
        colours.append(np.tile(np.array(colour, np.uint8), (n, 1)))
        ring = n_vertices + number * n + np.arange(n)
        (a, b), (c, d) = before[ends].T, ring[ends].T
        triangles += [np.column_stack([b, a, c]), np.column_stack([b, c, d])]
        before = ring
    end = n_vertices + len(DEPTHS) * n
    added.append((middle - (0.0, 0.0, width * DEPTHS[-1]))[None])
    moved.append(np.zeros((len(face.shapes), 1, 3)))
    colours.append(np.array(COLOURS[-1:], np.uint8))
    triangles.append(np.column_stack([before[ends[:, 1]], before[ends[:, 0]], np.full(len(ends), end)]))
    bag = np.concatenate(triangles).astype(np.int32)
    n_added = len(DEPTHS) * n + 1
    return replace(
        face,
        vertices=np.concatenate([face.vertices, *added]).astype(np.float32),
        triangles=np.concatenate([face.triangles, bag]),
        parts=(*face.parts, FacePart(BAG_PART, len(face.triangles), len(bag))),
        shapes=np.concatenate([face.shapes, *moved], axis=1).astype(np.float32),
        colours=np.concatenate([face.colours, *colours]),
        uv=None if face.uv is None else np.pad(face.uv, ((0, n_added), (0, 0))),
        tangents=None if face.tangents is None else np.pad(face.tangents, ((0, n_added), (0, 0))),
    )


def _lip_edges(face: Face) -> NDArray[np.int64]:
    """(E, 2) directed edges of one triangle alone, of the piece of them that runs along the lips; none without."""
    known = {int(number): row for row, number in enumerate(face.landmarks)}
    if not set(LIPS) <= set(known):
        return np.zeros((0, 2), np.int64)
    lips = [known[number] for number in LIPS]
    ring: FloatArray = np.einsum("lc,lcx->lx", face.landmark_weights[lips], face.vertices[face.landmark_vertices[lips]])
    same = np.unique(face.vertices.round(DECIMALS), axis=0, return_inverse=True)[1].ravel()
    edges: NDArray[np.int64] = np.concatenate([face.triangles[:, [k, (k + 1) % 3]] for k in range(3)]).astype(np.int64)
    ends = np.sort(same[edges], axis=1)
    _, which, counts = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    open_edges = (counts[which.ravel()] == 1) & (ends[:, 0] != ends[:, 1])
    edges, ends = edges[open_edges], ends[open_edges]
    none: NDArray[np.int64] = np.zeros((0, 2), np.int64)
    if not len(edges):
        return none
    piece_of = connected_pieces(np.column_stack([ends, ends[:, 1]]), int(same.max()) + 1)[ends[:, 0]]
    width = float(np.ptp(ring[:, 0]))
    off = np.linalg.norm(face.vertices[edges[:, 0]][:, None] - ring[None], axis=2)
    for piece in np.unique(piece_of):
        own = off[piece_of == piece]
        # the edge runs along all landmarks, and has no other part
        if max(np.median(own.min(axis=0)), np.median(own.min(axis=1))) < NEAR_SHARE * width:
            found: NDArray[np.int64] = edges[piece_of == piece]
            return found
    return none
