"""Terms on which the baked light of a vertex depends: how it turns, moves and is uncovered, in the frame of the head.

Light depends on the shape that is posed, not on the names of its shapes: skin that turns from a lamp darkens whichever
shape turns it. Fitted to all poses but one, that leaves half of the error of modes that are predicted from the shapes'
weights. Teeth, gums and tongue are lit through the opening of the lips: by its form factor. Sources: Lambert 1760
(light from a polygon); Heitz, Dupuy, Hill and Neubelt 2016 (an edge's share of it without trigonometry).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import FaceRig
from tts2face.models.baked_light import LIMIT_STEP, LIP_RING, N_MOUTH_TERMS, N_TERMS, BakedLight
from tts2face.models.face import Face
from tts2face.numeric.arrays import Array, Float32Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, vectorized_kernel
from tts2face.picture.kernels.fragments import face_normals, vertex_normals
from tts2face.picture.kernels.tables import NORMAL
from tts2face.picture.surface import triangles_by_vertex

MOVE_MM = np.float32(8.0)  # movement that counts as much as a turn of 1 rad
GAP_MM = np.float32(2.0)  # of an opening that is half as good as a wide one
HALF_FACTOR = np.float32(0.2)  # form factor of an opening through which teeth are displayed half as light as they get
PLACE_KEY = np.array([1, 1 << 21, 1 << 42])  # of a place in um, each coordinate below 1 m


@dataclass(frozen=True, slots=True, eq=False)
class LightTerms:
    """Terms of a face's lit vertices: those of ``light.rows``, then of ``light.ball_rows``, and those of its mouth.

    Attributes
    ----------
    source, partners : (N,)
        The vertices, and those across the lips or lids from them; themselves where there is none.
    mouth : (M,)
    triangles : (F, 3)
        Those around all of these.
    starts, members : (N + M + 1,), (n,)
        Numbers of the triangles around each of them.
    ring, ring_weights : (20, 3)
        Vertices of the landmarks of the opening of the lips.
    rest : (T, N)
        Terms at rest.
    """

    source: NDArray[np.int32]
    partners: NDArray[np.int32]
    mouth: NDArray[np.int32]
    triangles: NDArray[np.int32]
    starts: NDArray[np.int64]
    members: NDArray[np.int32]
    ring: NDArray[np.int32]
    ring_weights: Float32Array
    rest: Float32Array

    @classmethod
    def of_rows(
        cls, face: Face, rig: FaceRig, rows: NDArray[np.int32], partners: NDArray[np.int32], mouth: NDArray[np.int32]
    ) -> "LightTerms":
        """Terms of vertices (N,) with their partners (N,), and of those of the mouth (M,)."""
        every = np.concatenate([rows, mouth])
        wanted = np.zeros(len(face.vertices), bool)
        wanted[every] = True
        same = np.unique(np.rint(face.vertices * 1000).astype(np.int64) @ PLACE_KEY, return_inverse=True)[1]
        at_place = np.zeros(int(same.max(initial=-1)) + 1, bool)
        at_place[same[wanted]] = True
        used = at_place[same[face.triangles]].any(axis=1)
        part_of = np.repeat(np.arange(len(face.parts), dtype=np.int32), [part.count for part in face.parts])
        triangles = np.array(face.triangles[used], np.int32)
        starts, members = triangles_by_vertex(face, triangles, part_of[used], rig)
        counts = (starts[1:] - starts[:-1])[every]
        ends = np.cumsum(counts)
        first = np.concatenate([[0], ends])
        own = np.repeat(starts[every] - first[:-1], counts) + np.arange(ends[-1] if len(ends) else 0)
        numbers = {int(number): row for row, number in enumerate(face.landmarks)}
        lips = [numbers[number] for number in LIP_RING]
        made = cls(
            source=rows,
            partners=partners,
            mouth=mouth,
            triangles=triangles,
            starts=first.astype(np.int64),
            members=members[own],
            ring=np.array(face.landmark_vertices[lips], np.int32),
            ring_weights=np.array(face.landmark_weights[lips], np.float32),
            rest=np.zeros((N_TERMS, len(rows)), np.float32),
        )
        buffers = made.allocate_buffers()
        made.update(np.array(face.vertices, np.float32), buffers)
        made.rest[1:] = buffers.terms[1:]
        return made

    def ring_of(self, points: Float32Array) -> Float32Array:
        """(L, 3) landmarks of the opening of the lips of vertices (V, 3)."""
        places: Float32Array = np.einsum("lc,lcx->lx", self.ring_weights, points[self.ring])
        return places

    def allocate_buffers(self) -> "TermBuffers":
        """Buffers for the terms of one pose at a time."""
        n, m = len(self.source), len(self.mouth)
        return TermBuffers(
            flat=np.zeros((len(self.triangles), 3), np.float32),
            table=np.zeros((n + m, NORMAL + 3), np.float32),
            terms=np.ones((N_TERMS, n), np.float32),
            mouth=np.ones((N_MOUTH_TERMS, m), np.float32),
            ways=np.zeros((6, m), np.float32),
            ring=np.zeros((len(self.ring), 3), np.float32),
        )

    def update(self, points: Float32Array, buffers: "TermBuffers") -> None:
        """Write the terms of vertices (V, 3) of a head that has not moved, mm."""
        face_normals(points, self.triangles, buffers.flat)
        vertex_normals(buffers.flat, self.starts, self.members, buffers.table)
        n = len(self.source)
        write_terms(points, self.source, self.partners, buffers.table[:n], self.rest, buffers.terms)
        buffers.ring[:] = self.ring_of(points)
        write_mouth_terms(points, self.mouth, buffers.table[n:], buffers.ring, buffers.mouth, buffers.ways)


@dataclass(slots=True, eq=False)
class TermBuffers:
    """Normals of triangles (F, 3), table of vertices, terms (T, N); of the mouth terms and ways (6, M), ring (L, 3)."""

    flat: Float32Array
    table: Float32Array
    terms: Float32Array
    mouth: Float32Array
    ways: Float32Array
    ring: Float32Array


def light_terms(face: Face, rig: FaceRig, light: BakedLight) -> LightTerms:
    """Terms of a face with baked light."""
    rows = np.concatenate([light.rows, light.ball_rows])
    return LightTerms.of_rows(face, rig, rows, light.partners, light.mouth_rows)


def still_eyes(face: Face, points: Float32Array) -> None:
    """Put the eyeballs of deformed vertices (V, 3) where they look ahead: their light does not turn with them."""
    for eye in face.eyes:
        span = slice(eye.first, eye.first + eye.count)
        points[span] = face.vertices[span]


@vectorized_kernel
def write_terms(points: Array, source: Array, partners: Array, table: Array, rest: Array, terms: Array) -> None:
    """Write terms 1 to 9 of vertices: turn of the normal, movement, and way from the partner, each from that at rest.

    The way counts by its direction and a share of an opening that is wide enough. Term 0 is 1.
    """
    for i in range(len(source)):
        p, q = source[i], partners[i]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        right, up, ahead = x - points[q, 0], y - points[q, 1], z - points[q, 2]
        share = np.float32(1) / (GAP_MM + np.sqrt(right * right + up * up + ahead * ahead))
        for c in range(3):
            terms[1 + c, i] = table[i, NORMAL + c] - rest[1 + c, i]
            terms[4 + c, i] = points[p, c] / MOVE_MM - rest[4 + c, i]
        terms[7, i] = right * share - rest[7, i]
        terms[8, i] = up * share - rest[8, i]
        terms[9, i] = ahead * share - rest[9, i]


@vectorized_kernel
def write_mouth_terms(points: Array, mouth: Array, table: Array, ring: Array, terms: Array, ways: Array) -> None:
    """Write terms 1 to 5 of vertices in the mouth: the form factor of the ring (L, 3), a curve of it, and its vector.

    The curve is flat where the opening is narrow or wide, as that of a display. `ways` (6, M) is scratch space: places,
    and ways to the corner before, of length 1.
    """
    least = np.float32(1e-07)
    n = len(mouth)
    px, py, pz, bx, by, bz = ways[0], ways[1], ways[2], ways[3], ways[4], ways[5]
    right, up, ahead = terms[3], terms[4], terms[5]
    for i in range(n):
        v = mouth[i]
        px[i], py[i], pz[i] = points[v, 0], points[v, 1], points[v, 2]
        bx[i], by[i], bz[i] = ZERO, ZERO, ZERO
        right[i], up[i], ahead[i] = ZERO, ZERO, ZERO
    for k in range(len(ring) + 1):
        corner = ring[k % len(ring)]
        cx, cy, cz = corner[0], corner[1], corner[2]
        for i in range(n):
            x, y, z = cx - px[i], cy - py[i], cz - pz[i]
            scale = UNIT / np.sqrt(x * x + y * y + z * z + least)
            x, y, z = x * scale, y * scale, z * scale
            a, b, c = bx[i], by[i], bz[i]
            cosine = a * x + b * y + c * z
            off = abs(cosine)
            near = (np.float32(0.8543985) + (np.float32(0.4965155) + np.float32(0.0145206) * off) * off) / (
                np.float32(3.4175940) + (np.float32(4.1616724) + off) * off
            )  # angle over its sine and 2 pi, below a right angle
            share = near if cosine > ZERO else HALF / np.sqrt(max(UNIT - cosine * cosine, least)) - near
            right[i] += share * (y * c - z * b)
            up[i] += share * (z * a - x * c)
            ahead[i] += share * (x * b - y * a)
            bx[i], by[i], bz[i] = x, y, z
    for i in range(n):
        factor = right[i] * table[i, NORMAL] + up[i] * table[i, NORMAL + 1] + ahead[i] * table[i, NORMAL + 2]
        squared = max(factor, ZERO) * factor
        terms[1, i], terms[2, i] = factor, squared / (squared + HALF_FACTOR * HALF_FACTOR)


@vectorized_kernel
def add_responses(
    base: Array, answers: tuple[Array, Array, Array], terms: Array, first: tuple[int, int], out: Array
) -> None:
    """Write light (3, N): a base (3, N) and its change.

    `answers` are responses (T, 3, N) of sizes (T,) a step, and limits (2, 3, N) of the change in steps of `LIMIT_STEP`.
    The terms are those of (T', N') from a first one and a first vertex on.
    """
    responses, sizes, limits = answers
    first_term, first_vertex = first
    n, step = out.shape[1], np.float32(LIMIT_STEP)
    for c in range(3):
        for i in range(n):
            out[c, i] = np.float32(0)
        for t in range(len(sizes)):
            size = sizes[t]
            for i in range(n):
                out[c, i] += size * terms[first_term + t, first_vertex + i] * np.float32(responses[t, c, i])
        for i in range(n):
            least, most = step * np.float32(limits[0, c, i]), step * np.float32(limits[1, c, i])
            out[c, i] = base[c, i] + min(max(out[c, i], least), most)
