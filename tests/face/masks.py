"""A face that is a mask: the skin of the head in front of its ears, open at the lips, with nothing in the mouth."""

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from tts2face.face.mouth_bag import LIPS
from tts2face.models.face import Face

EARS_Z = -40.0  # mm


def lip_mask(face: Face) -> Face:
    """Cut along the shortest way round the landmarks of the inner lips, without what lies behind it."""
    skin = next(part for part in face.parts if part.name == "skin")
    triangles = face.triangles[skin.first : skin.first + skin.count]
    same = np.unique(face.vertices.round(3), axis=0, return_inverse=True)[1].ravel()
    places = np.zeros((same.max() + 1, 3))
    places[same] = face.vertices
    corners = same[triangles]
    edges = np.sort(np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    lengths = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
    shape = (len(places), len(places))
    once = np.unique(edges, axis=0, return_index=True)[1]  # equal entries would add up
    graph = csr_matrix((lengths[once], edges[once].T), shape)
    known = {int(number): row for row, number in enumerate(face.landmarks)}
    stops = [int(same[face.landmark_vertices[known[n], face.landmark_weights[known[n]].argmax()]]) for n in LIPS]
    cut = set()
    for start, end in zip(stops, [*stops[1:], stops[0]], strict=True):
        _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
        at = end
        while at != start:
            cut.add((min(at, before[at]), max(at, before[at])))
            at = int(before[at])
    is_cut = np.array([tuple(edge) in cut for edge in edges.tolist()])
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort(edges[~is_cut].T)
    kept, own = edges[~is_cut][order], owner[~is_cut][order]
    beside = (kept[1:] == kept[:-1]).all(axis=1)
    joined = csr_matrix((np.ones(beside.sum()), (own[:-1][beside], own[1:][beside])), (len(triangles),) * 2)
    pieces = connected_components(joined, directed=False)[1]
    nose = int(face.vertices[triangles].mean(axis=1)[:, 2].argmax())
    front = (pieces == pieces[nose]) & (face.vertices[triangles][:, :, 2].min(axis=1) > EARS_Z)
    mask = triangles[front]
    return replace(face, triangles=mask, parts=(replace(skin, first=0, count=len(mask)),), eyes=(), occlusion=None)
