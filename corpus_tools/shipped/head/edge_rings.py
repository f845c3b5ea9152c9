"""Rings of edges around the mouth and the eyes: where lips and lids meet."""

from collections import defaultdict

import numpy as np

from lexicon.errors import DataError
from tts2face.numeric.arrays import FloatArray, IntArray

LONGEST = 400  # vertices; the head's own rings around mouth and eyes have under 100


class EdgeRings:
    """Edge rings of a quad mesh: at each vertex of four edges a ring continues with the opposite edge.

    Parameters
    ----------
    quads : (F, 4)
    places : (N, 3)
        Vertices at one position count as one, because texture seams split the mesh.
    """

    def __init__(self, quads: IntArray, places: FloatArray) -> None:
        rounded = np.rint(places * 1e6).astype(np.int64)
        _, first, where = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        self._beside: defaultdict[int, set[int]] = defaultdict(set)
        self._around: defaultdict[int, list[set[int]]] = defaultdict(list)
        for quad in first[where.ravel()][quads].tolist():
            for k, corner in enumerate(quad):
                self._beside[corner] |= {quad[k - 1], quad[(k + 1) % 4]}
                self._around[corner].append(set(quad))
        self.vertices = sorted(self._beside)

    def ring(self, start: int, towards: int) -> list[int] | None:
        """The closed ring of vertices beginning with the edge from `start` to `towards`; None if it is open."""
        path = [start, towards]
        while len(path) < LONGEST:
            onward = self._onward(path[-2], path[-1])
            if onward is None or onward == start:
                return path if onward is not None else None
            path.append(onward)
        return None

    def rings_from(self, start: int) -> list[list[int]]:
        """Closed rings through `start`."""
        found = [self.ring(start, towards) for towards in sorted(self._beside[start])]
        return [ring for ring in found if ring is not None]

    def _onward(self, before: int, here: int) -> int | None:
        passed = [quad for quad in self._around[here] if before in quad]
        ahead = [n for n in self._beside[here] if n != before and not any(n in quad for quad in passed)]
        return ahead[0] if len(ahead) == 1 and len(self._beside[here]) == 4 else None


def find_narrowest_ring(
    strips: EdgeRings, vertices: FloatArray, inside: FloatArray, reach: float, clear: float = 0.0
) -> IntArray:
    """The ring around an opening with the smallest area in the frontal view: the edge of lips or lids.

    Parameters
    ----------
    vertices : (N, 3)
    inside : (3,)
        A point in the opening, or behind it.
    reach
        Maximum distance of a ring from the point in the frontal view, mm.
    clear
        Minimum mean distance of a ring from the point, mm: an eyeball's radius.
    """
    near = np.hypot(*(vertices[strips.vertices] - inside).T[:2]) < reach
    best, least = None, np.inf
    seen: set[int] = set()
    for start in np.array(strips.vertices)[near].tolist():
        for ring in strips.rings_from(start) if start not in seen else ():
            seen.update(ring)
            flat = vertices[ring, :2] - inside[:2]
            is_clear = np.linalg.norm(vertices[ring] - inside, axis=1).mean() > clear
            if np.hypot(*flat.T).max() > reach or not _encloses_origin(flat) or not is_clear:
                continue
            area = abs(_area(flat))
            if area < least:
                best, least = ring, area
    if best is None:
        raise DataError(f"no edge ring encloses {inside}; use the pinned source mesh")
    return np.array(best, np.int64)


def _encloses_origin(flat: FloatArray) -> bool:
    """Whether a closed line winds once around the origin."""
    angles = np.unwrap(np.arctan2(*np.concatenate([flat, flat[:1]]).T[::-1]))
    return bool(abs(abs(angles[-1] - angles[0]) - 2 * np.pi) < 0.1)


def _area(flat: FloatArray) -> float:
    after = np.roll(flat, -1, axis=0)
    return float((flat[:, 0] * after[:, 1] - flat[:, 1] * after[:, 0]).sum() / 2)
