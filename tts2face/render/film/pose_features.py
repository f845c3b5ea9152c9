"""What baked light depends on: weights of a face's shapes, turns of its head, and the shape of its mouth's opening."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import head_transform
from tts2face.models.baked_light import OPENING_LANDMARKS, PRODUCTS
from tts2face.models.face import Face

Floats = NDArray[np.float64]
Float32Array = NDArray[np.float32]

TURN_SCALE_DEG = (10.0, 8.0)  # of yaw and pitch in the distance between turns
TURN_LIMIT_DEG = (23.0, 14.0)  # beyond the baked turns light stays
CAMERA_SCALE_DEG = 15.0
OPENING_MM = np.array([4.0, 3.0, 5.0, 7.0, 4.0])  # scale of each measure of an opening
OPENING_SPREAD = 0.35  # of the Gaussian that weights baked openings


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Names of a face's shapes in the form that `of` takes: two means (P, K) whose products it adds."""

    left: Float32Array
    right: Float32Array

    @classmethod
    def of_shapes(cls, names: Sequence[str]) -> "Features":
        """Features of faces with these shapes."""
        left, right = (np.stack([_mean_of(names, pair[side]) for pair in PRODUCTS]) for side in (0, 1))
        return cls(left, right)

    def of(self, weights: Float32Array) -> Float32Array:
        """(K + P,) features of weights (K,): 0 at rest."""
        return np.concatenate([weights, (self.left @ weights) * (self.right @ weights)])


def _mean_of(names: Sequence[str], name: str) -> Float32Array:
    found = np.array([other == name or other in (f"{name}Left", f"{name}Right") for other in names], np.float32)
    mean: Float32Array = found / max(float(found.sum()), 1.0)
    return mean


@dataclass(frozen=True, slots=True, eq=False)
class Cardinal:
    """Interpolation between nodes, the first of which is at rest: weights that are 1 at their node and 0 at others.

    Multiquadrics with a linear part; quadratics in yaw and pitch left one to two of 255 more of error. Source: Hardy
    1971.
    """

    nodes: Floats
    scale: Floats
    limit: Floats
    inverse: Floats

    @classmethod
    def between(cls, nodes: NDArray[np.floating], scale: Sequence[float], limit: Sequence[float]) -> "Cardinal":
        """Interpolation between rest and nodes (N, D), which are scaled and bounded in each dimension."""
        sizes = np.array(scale, np.float64)
        every = np.vstack([np.zeros((1, len(scale))), np.asarray(nodes, np.float64)]) / sizes
        linear = np.column_stack([np.ones(len(every)), every])
        corner = np.zeros((linear.shape[1], linear.shape[1]))
        system = np.block([[_multiquadric(every, every), linear], [linear.T, corner]])
        return cls(every, sizes, np.array(limit, np.float64), np.linalg.pinv(system))

    def at(self, place: NDArray[np.floating]) -> Float32Array:
        """(N,) weights of the nodes without that at rest, for a place (D,)."""
        inside = np.clip(np.asarray(place, np.float64), -self.limit, self.limit) / self.scale
        row = np.concatenate([_multiquadric(inside[None], self.nodes)[0], [1.0], inside])
        weights: Float32Array = (row @ self.inverse)[1 : len(self.nodes)].astype(np.float32)
        return weights


def _multiquadric(a: Floats, b: Floats) -> Floats:
    squared = ((a[:, None] - b[None]) ** 2).sum(axis=2)
    root: Floats = np.sqrt(squared + 0.25)
    return root


def turn_weights(turns_deg: NDArray[np.floating]) -> Cardinal:
    """Interpolation between turns of the head (T, 2), yaw and pitch."""
    return Cardinal.between(turns_deg, TURN_SCALE_DEG, TURN_LIMIT_DEG)


def camera_weights(yaws_deg: NDArray[np.floating]) -> Cardinal:
    """Interpolation between cameras (Y,)."""
    most = float(np.abs(yaws_deg).max(initial=1.0))
    return Cardinal.between(np.asarray(yaws_deg)[:, None], (CAMERA_SCALE_DEG,), (most,))


def yaw_and_pitch_deg(head: NDArray[np.floating]) -> Floats:
    """(2,) of a head pose (6,)."""
    return np.degrees(np.asarray(head, np.float64)[[1, 0]])


@dataclass(frozen=True, slots=True, eq=False)
class Opening:
    """Shape of a face's mouth opening, in measures (5,) relative to rest.

    Distance of the inner lips, heights of the upper and the lower one, width, depth of both, each over its scale.
    """

    vertices: NDArray[np.int32]
    weights: Float32Array
    pivot: Float32Array
    rest: Floats

    @classmethod
    def of_face(cls, face: Face) -> "Opening":
        """Opening of a face with landmarks of its lips."""
        rows = {int(number): row for row, number in enumerate(face.landmarks)}
        used = [rows[name] for name in OPENING_LANDMARKS]
        made = cls(face.landmark_vertices[used], face.landmark_weights[used], face.pivot, np.zeros(5))
        return cls(made.vertices, made.weights, made.pivot, made.measures(face.vertices, np.zeros(6)))

    def measures(self, points: NDArray[np.floating], head: NDArray[np.floating]) -> Floats:
        """(5,) of the posed vertices (V, 3) and the head pose (6,)."""
        places = np.einsum("lc,lcx->lx", self.weights, points[self.vertices]).astype(np.float64)
        moved = head_transform(head, self.pivot).astype(np.float64)
        upper, lower, right, left = (places - moved[:, 3]) @ moved[:, :3]
        found = [upper[1] - lower[1], upper[1], lower[1], left[0] - right[0], (upper[2] + lower[2]) / 2]
        measures: Floats = np.array(found) / OPENING_MM - self.rest
        return measures


def opening_weights(openings: NDArray[np.floating], measures: Floats) -> Float32Array:
    """(J,) shares of the baked openings (J, 5): their light is not linear in the pose, and grey if averaged widely."""
    squared = ((openings - measures) ** 2).sum(axis=1)
    shares = np.exp(-(squared - squared.min()) / (2 * OPENING_SPREAD**2))
    weights: Float32Array = (shares / shares.sum()).astype(np.float32)
    return weights
