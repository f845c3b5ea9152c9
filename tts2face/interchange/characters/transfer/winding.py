"""Triangles of a scan that face inwards, turned over: neighbours agree, and the whole faces outwards."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, connected_components

from tts2face.interchange.characters.head_mesh import HeadMesh
from tts2face.numeric.arrays import FloatArray, IntArray, Mask

MIXED = 0.01  # of the edges of a piece at which neighbours disagree, from which it is no slip of a modeller
HOLLOW = 0.02  # six volumes of a piece over the power 1.5 of its area, below which it is a sheet; a ball has 0.56


def facing_outwards(head: HeadMesh) -> HeadMesh:
    """Mesh whose triangles face outwards.

    Pieces whose neighbours disagree are decided one by one. Others are turned over all or none, since the inside of a
    hollow statue faces inwards by right.
    """
    size = float(np.ptp(head.vertices, axis=0).max())
    place = np.unique(np.rint(head.vertices / size * 1e5), axis=0, return_inverse=True)[1].reshape(-1)
    graph, piece = _neighbours(place[head.triangles])
    is_mixed, is_turned = _against_neighbours(graph, piece)
    triangles = np.where(is_turned[:, None], head.triangles[:, ::-1], head.triangles)
    share, area = _volume_shares(head.vertices[triangles], piece)
    solid = np.abs(share) > HOLLOW
    all_inwards = (np.sign(share) * area)[solid & ~is_mixed].sum() < 0
    turned = np.where(is_mixed, share < 0, all_inwards)[piece]
    return replace(head, triangles=np.where(turned[:, None], triangles[:, ::-1], triangles))


def _neighbours(corners: IntArray) -> tuple[sp.csr_matrix, IntArray]:
    """Graph (F, F) of triangles that share an edge of two, 1 where they agree and 2 where not; their pieces (F,)."""
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    _, number, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(number.reshape(-1), kind="stable")
    pairs = order[np.repeat(counts == 2, counts)].reshape(-1, 2)
    disagree = edges[pairs[:, 0], 0] == edges[pairs[:, 1], 0]
    ends, first = np.unique(pairs % len(corners), axis=0, return_index=True)
    half = sp.coo_matrix((1.0 + disagree[first], ends.T), (len(corners),) * 2).tocsr()
    graph: sp.csr_matrix = half.maximum(half.T)
    return graph, connected_components(graph, False)[1].astype(np.int64)


def _against_neighbours(graph: sp.csr_matrix, piece: IntArray) -> tuple[Mask, Mask]:
    """Pieces (P,) in which neighbours disagree, and their triangles (F,) that do not face as their first one."""
    of = piece[np.repeat(np.arange(len(piece)), np.diff(graph.indptr))]
    n = int(piece.max()) + 1
    is_mixed = np.bincount(of, graph.data > 1, n) > MIXED * np.maximum(np.bincount(of, minlength=n), 1)
    is_turned = np.zeros(len(piece), bool)
    for number in np.flatnonzero(is_mixed).tolist():
        order, before = breadth_first_order(graph, int((piece == number).argmax()), directed=False)
        disagrees = np.asarray(graph[order[1:], before[order[1:]]]).reshape(-1) > 1
        for row, differs in zip(order[1:].tolist(), disagrees.tolist(), strict=True):
            is_turned[row] = is_turned[before[row]] ^ differs
    return is_mixed, is_turned


def _volume_shares(corners: FloatArray, piece: IntArray) -> tuple[FloatArray, FloatArray]:
    """Six volumes of each piece about its middle over the power 1.5 of its area, and the areas (P,)."""
    n, n_own = int(piece.max()) + 1, np.bincount(piece)
    middle = np.stack([np.bincount(piece, corners[:, :, k].mean(axis=1), n) for k in range(3)], axis=1) / n_own[:, None]
    off = corners - middle[piece][:, None]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area: FloatArray = np.bincount(piece, np.linalg.norm(flat, axis=1) / 2, n).astype(np.float64)
    six = np.bincount(piece, (np.cross(off[:, 0], off[:, 1]) * off[:, 2]).sum(axis=1), n)
    return six / np.maximum(area, 1e-30) ** 1.5, area
