"""Surface of a photographed face: its vertices, gathered part by part, landmarks on them, and pages of its pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import LEAST_SIDE
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, N_LANDMARKS
from tts2face.numeric.arrays import Float32Array, FloatArray, IntArray, Mask, Pixels
from tts2face.photo.eyes import IRISES, EyePatch
from tts2face.photo.lids import LidPicture
from tts2face.photo.lines import LID_MARGINS, N_LID, N_LIP
from tts2face.photo.mesh import PhotoMesh
from tts2face.photo.teeth import OwnTeeth

SKIN, EYES = "skin", "eyes"  # parts
LIDS, LASHES, LID_OVER_EYE = "lids", "lashes", "lid_over_eye"  # before the skin, and behind it
PAGE_MARGIN = 1 / 64  # of a page, beyond what it shows: the places nearest to its edges are not read
BETWEEN_PX = 4  # of patches on their page
MOVED = 1e-3  # mm, or share of the head's motion, from which a vertex moves
UNSEEN = 128.0  # colour of vertices whose colour is a picture's


@dataclass(frozen=True, slots=True, eq=False)
class Vertices:
    """Places (V, 3), mm, shapes (K, V, 3), and share of the head's motion (V,) of vertices."""

    places: FloatArray
    shapes: FloatArray
    follow: FloatArray

    def at(self, numbers: IntArray) -> "Vertices":
        """Those of some numbers (N,)."""
        return Vertices(self.places[numbers], self.shapes[:, numbers], self.follow[numbers])

    def between(self, numbers: IntArray, weights: FloatArray) -> "Vertices":
        """Vertices (N,) at weights (N, 3) between three others (N, 3) each."""
        places = np.einsum("nc,ncx->nx", weights, self.places[numbers])
        shapes = np.einsum("nc,kncx->knx", weights, self.shapes[:, numbers])
        return Vertices(places, shapes, np.asarray((weights * self.follow[numbers]).sum(axis=1)))


@dataclass(slots=True, eq=False)
class PhotoSurface:
    """Parts that are added one after the other."""

    vertices: list[Vertices] = field(default_factory=list)
    uv: list[FloatArray] = field(default_factory=list)
    colours: list[FloatArray] = field(default_factory=list)
    parts: list[tuple[str, IntArray]] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Number of vertices."""
        return sum(len(part.places) for part in self.vertices)

    def add(self, vertices: Vertices, *, uv: FloatArray | None = None, colours: FloatArray | None = None) -> IntArray:
        """Numbers (N,) of added vertices, with places in their page (N, 2) or colours (N, 3)."""
        n = len(vertices.places)
        first = self.count
        self.vertices.append(vertices)
        self.uv.append(np.zeros((n, 2)) if uv is None else uv)
        self.colours.append(np.full((n, 3), UNSEEN) if colours is None else colours)
        return first + np.arange(n)

    @property
    def places(self) -> FloatArray:
        """Places (V, 3) of all vertices, mm."""
        return np.concatenate([part.places for part in self.vertices])

    def every(self) -> Vertices:
        """All vertices."""
        return Vertices(
            self.places,
            np.concatenate([part.shapes for part in self.vertices], axis=1),
            np.concatenate([part.follow for part in self.vertices]),
        )


def moves(vertices: Vertices) -> Mask:
    """(V,) whether vertices move with a shape or with the head."""
    shapes = vertices.shapes
    most = np.maximum(shapes.max(axis=0), -shapes.min(axis=0)).max(axis=1)
    return np.asarray((most > MOVED) | (vertices.follow > MOVED))


@dataclass(frozen=True, slots=True, eq=False)
class PhotoPages:
    """Pages (2, H, W, 3): what moves of a picture, and patches such as its eyes without lids.

    ``corner`` (2,) and ``patch_corners`` are the pixels of the picture that would lie at the left top of the pages.
    """

    pages: Pixels
    corner: FloatArray
    patch_corners: Sequence[FloatArray]

    def uv(self, places: FloatArray, corner: FloatArray | None = None) -> FloatArray:
        """(N, 2) places in a page of pixels (N, 2) of the picture."""
        size = np.array(self.pages.shape[2:0:-1], np.float64)
        found: FloatArray = (places - (self.corner if corner is None else corner) + 0.5) / size
        return found.clip(0, 1)


def lay_pages(
    pixels: Pixels, mesh: PhotoMesh, is_moving: Mask, patches: Sequence[EyePatch | LidPicture | OwnTeeth]
) -> PhotoPages:
    """Pages of a picture (H, W, 3) whose vertices (V,) move, and of patches."""
    shown = mesh.places[mesh.triangles[is_moving[mesh.triangles].any(axis=1)]].reshape(-1, 2)
    low = np.clip(np.floor(shown.min(axis=0)).astype(int) - 2, 0, None)
    high = np.minimum(np.ceil(shown.max(axis=0)).astype(int) + 3, pixels.shape[1::-1])
    sizes = [np.array(patch.picture.shape[1::-1]) for patch in patches]
    beside = (sum(int(size[0]) + BETWEEN_PX for size in sizes), max(int(size[1]) for size in sizes))
    wide, tall = (_page_side(int(side)) for side in np.maximum(high - low, beside))
    left, top = round(PAGE_MARGIN * wide), round(PAGE_MARGIN * tall)
    right, below = wide - left - high[0] + low[0], tall - top - high[1] + low[1]
    around = ((top, below), (left, right), (0, 0))
    first = np.pad(pixels[low[1] : high[1], low[0] : high[0]], around, mode="edge")
    second, at, corners = np.zeros_like(first), left, []
    for patch in patches:
        h, w = patch.picture.shape[:2]
        second[top : top + h, at : at + w] = patch.picture
        corners.append(np.array(patch.corner, np.float64) - (at, top))
        at += w + BETWEEN_PX
    return PhotoPages(np.stack([first, second]), (low - (left, top)).astype(np.float64), corners)


def _page_side(least: int) -> int:
    side = LEAST_SIDE
    while side * (1 - 2 * PAGE_MARGIN) < least:
        side *= 2
    return side


def between_vertices(mesh: PhotoMesh, places: FloatArray) -> tuple[IntArray, FloatArray]:
    """Three vertices (N, 3) of the triangle around each place (N, 2), or nearest to it, and its weights in them."""
    low, high = places.min(axis=0), places.max(axis=0)
    corners = mesh.places[mesh.triangles]
    near = mesh.triangles[((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)]
    return _triangles_around(places, mesh.places, near)


def place_landmarks(
    mesh: PhotoMesh, landmarks: FloatArray, eyes: Sequence[tuple[EyePatch, IntArray]], lashes: Sequence[IntArray]
) -> tuple[NDArray[np.int32], Float32Array]:
    """Three vertices (478, 3) and their weights for each landmark (478, 2 or more), pixels.

    Eyes are given with the numbers of their vertices, and `lashes` are those of the upper margins that move (25,).
    """
    corners, weights = np.zeros((N_LANDMARKS, 3), np.int32), np.tile(np.array([1, 0, 0], np.float32), (N_LANDMARKS, 1))
    own = _vertices(mesh, lashes)
    for number in range(N_LANDMARKS):
        place = landmarks[number, :2]
        eye = next((eye for eye, iris in enumerate(IRISES) if number in iris), None)
        if number in own:
            corners[number] = own[number]
        elif eye is None:
            at, shares = _triangles_around(place[None], mesh.places, mesh.triangles)
            corners[number], weights[number] = at[0], shares[0]
        else:
            patch, vertices = eyes[eye]
            at, shares = _triangles_around(place[None], patch.places, patch.triangles)
            corners[number], weights[number] = vertices[at[0]], shares[0]
    return corners, weights


def _vertices(mesh: PhotoMesh, lashes: Sequence[IntArray]) -> Mapping[int, int]:
    """Vertices that are landmarks: their own, and those of lips and lids on the lines through them."""
    lines: list[tuple[IntArray, Sequence[int], int]] = [
        (mesh.upper_lip, INNER_LIP_UPPER, (N_LIP - 1) // (len(INNER_LIP_UPPER) - 1)),
        (mesh.lower_lip, INNER_LIP_LOWER, (N_LIP - 1) // (len(INNER_LIP_LOWER) - 1)),
    ]
    for upper, lower, lids in zip(lashes, mesh.lower_lids, LID_MARGINS, strict=True):
        lines += [
            (line, numbers, (N_LID - 1) // (len(numbers) - 1))
            for line, numbers in zip((upper, lower), lids, strict=True)
        ]
    on_lines = {int(number): int(line[k * step]) for line, numbers, step in lines for k, number in enumerate(numbers)}
    return mesh.vertex_of | on_lines


def _triangles_around(places: FloatArray, points: FloatArray, triangles: IntArray) -> tuple[IntArray, FloatArray]:
    """Corners (N, 3) of the triangles around places (N, 2), or nearest to them, and the weights of the places."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    first, second = b - a, c - a
    right, up = (places[:, k, None] - a[:, k] for k in range(2))
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    area = np.where(np.abs(area) < 1e-12, 1e-12, area)
    along = (right * second[:, 1] - up * second[:, 0]) / area
    across = (first[:, 0] * up - first[:, 1] * right) / area
    weights = (1 - along - across, along, across)
    best = np.minimum(np.minimum(weights[0], weights[1]), weights[2]).argmax(axis=-1)
    inside = np.clip(np.stack([part[np.arange(len(places)), best] for part in weights], axis=-1), 0, None)
    return triangles[best], inside / inside.sum(axis=1, keepdims=True)
