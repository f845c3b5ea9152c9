"""Registration of a source head's skin with a target's, and each target vertex's place on it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import RBFInterpolator
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial import cKDTree

from tts2face.interchange.characters.transfer.skin import Skin
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, LEFT_LIDS, LIP_LANDMARKS, RIGHT_LIDS
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, nearest_rotation
from tts2face.processes.threads import available_cores

# Nose, chin and middle of the brow: on skin without texture the tracker guesses the others (decision 244).
MIDDLE_LANDMARKS = (
    1, 2, 4, 5, 6, 168, 195, 197, 98, 327, 129, 358, 48, 278, 64, 294, 152, 175, 199, 200, 18, 148, 377, 176, 400, 8, 9,
    10, 151,
)  # fmt: skip
FEATURES = np.unique([*MIDDLE_LANDMARKS, *LIP_LANDMARKS, *np.ravel(RIGHT_LIDS), *np.ravel(LEFT_LIDS)])
# Lines that are seen on the mesh itself, as edges of eyeballs and lips; the others are read in pictures, 1 to 2 mm off.
LINES = np.unique([*INNER_LIP_UPPER, *INNER_LIP_LOWER, *np.ravel(RIGHT_LIDS), *np.ravel(LEFT_LIDS)])
READ_TRUST = 0.15  # weight of a landmark that is read, beside one of these lines
STAGES = ((1000.0, 1.0), (300.0, 0.3), (100.0, 0.06))  # smoothness, weight of a landmark beside that of a sample
N_ITERATIONS = 5  # of closest points in each stage
WARP_SMOOTHING = 10.0  # of the landmarks' remainder after identities
MARKS_RIDGE = 100.0  # mm2, of the weight of an identity that is fitted to landmarks
SURFACE_RIDGE = 30000.0  # and to all vertices around them: less exaggerated broad faces (decision 244)
AFFINE_RIDGE = 1e-3  # of shifts and shears
NORMAL_MM = 10.0  # distance that counts as much as a right angle between normals over root two: lips meet lips
N_SAMPLES = 8  # nearest samples among which one with a fitting normal is sought
MIN_COSINE = 0.5  # normals within 60 degrees
MAX_PULL_MM = 15.0  # farther samples are no correspondence
SEARCHED_MM = 20.0  # with the distance of normals
MAX_SLIDE_MM = 2.0  # along the tangent plane of a sample
N_TRIANGLES = 24  # of the source around a vertex of the target, among which the nearest is sought
HIDDEN_MM = 20.0  # cost of a hidden triangle for a vertex that is seen
OPPOSED_MM, OTHER_SIDE_MM = 8.0, 50.0  # costs of a triangle that faces away, and of one of the other lip or lid
FACE_MM = 30.0  # from a landmark of a feature
SCALED_MM = 15.0  # from one: skin whose size is the scale of the motion; cheeks slide
FADE_MM = (10.0, 35.0)  # distance from the source between which shapes fade out


@dataclass(frozen=True, slots=True, eq=False)
class Similarity:
    """``scale * turn @ place + shift``."""

    scale: float
    turn: FloatArray
    shift: FloatArray

    def places(self, points: FloatArray) -> FloatArray:
        """Places (..., 3) of points (..., 3)."""
        moved: FloatArray = self.moves(points) + self.shift
        return moved

    def moves(self, displacements: FloatArray) -> FloatArray:
        """Displacements (..., 3), turned and scaled."""
        turned: FloatArray = self.scale * np.einsum("...k,jk->...j", displacements, self.turn)
        return turned


def fit_similarity(source: FloatArray, target: FloatArray) -> Similarity:
    """Similarity of points (N, 3) with least squares (Umeyama 1991)."""
    here, there = source - source.mean(axis=0), target - target.mean(axis=0)
    turn = nearest_rotation(np.einsum("nc,nd->cd", there, here))
    scale = float(np.einsum("nc,cd,nd->", there, turn, here) / (here**2).sum())
    return Similarity(scale, turn, target.mean(axis=0) - scale * turn @ source.mean(axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """The source's skin on the target's.

    Parameters
    ----------
    similarity
        From the source's to the target's millimetres.
    triangles, weights : (S,), (S, 3)
        Triangle of the source on which each vertex of the target's skin lies, and its weights there.
    share : (S,)
        Share of the source's motion that each takes: 0 far from the source.
    """

    similarity: Similarity
    corners: IntArray
    weights: FloatArray
    share: FloatArray

    def carry(self, moves: FloatArray) -> FloatArray:
        """Displacements (K, S, 3) of the target, from those (K, R, 3) of the source's skin."""
        scaled = self.similarity.moves(moves)
        carried: FloatArray = np.einsum("nk,mnkd->mnd", self.weights * self.share[:, None], scaled[:, self.corners])
        return carried


def register(source: Skin, target: Skin, modes: FloatArray, on_stage: Callable[[], object]) -> Registration:
    """Registration by landmarks of features, then closest points of visible skin; what is hidden follows smoothly.

    `modes` (P, S, 3) are displacements of the source by which heads differ: they fill what few landmarks leave open on
    smooth cheeks, where closest points slide.
    """
    # tables of landmarks need not have all
    known = FEATURES[np.isfinite(target.landmarks[FEATURES, 0]) & np.isfinite(source.landmarks[FEATURES, 0])]
    similarity = fit_similarity(source.landmarks[known], target.landmarks[known])
    even, held = similarity.places(source.vertices), source.nearest(source.landmarks[known])
    wanted = target.landmarks[known] + even[held] - similarity.places(source.landmarks[known])
    far = np.asarray(cKDTree(source.landmarks[known]).query(source.vertices)[0])
    face_rows = np.flatnonzero(source.is_seen & (far < FACE_MM))
    basis = np.concatenate([similarity.moves(modes), _affine_moves(even)])
    trust = np.where(np.isin(known, LINES), 1.0, READ_TRUST)
    like = even + _fitted(basis, held, wanted - even[held], trust, MARKS_RIDGE)
    laplacian, samples = source.laplacian(), _Samples(target)
    bending = (laplacian.T @ laplacian).tocsc()
    placed: FloatArray | None = None
    for smoothness, mark in STAGES:
        on_stage()
        smoothing = WARP_SMOOTHING / trust
        warp = RBFInterpolator(like[held], wanted - like[held], kernel="linear", smoothing=smoothing, degree=1)
        start = like + warp(like)
        placed = start if placed is None else placed
        held_weights = np.bincount(held, mark * trust, len(even))
        pulled_marks = np.zeros_like(even)
        np.add.at(pulled_marks, held, mark * trust[:, None] * (wanted - start[held]))
        for _ in range(N_ITERATIONS):
            there, found = samples.nearest(placed, source.normals(placed), np.where(source.is_seen, source.side, -1))
            found &= np.linalg.norm(there - placed, axis=1) < MAX_PULL_MM
            system = smoothness * bending + sp.diags(found + held_weights + 1e-6)
            placed = start + factorise(system).solve(found[:, None] * (there - start) + pulled_marks)
        like = even + _fitted(basis, face_rows, placed[face_rows] - even[face_rows], np.ones(1), SURFACE_RIDGE)
    on_stage()
    # the size of the face is that of the surface around its features; landmarks are single places
    assert placed is not None
    is_scaled = source.is_seen & (far < SCALED_MM)
    similarity = fit_similarity(source.vertices[is_scaled], placed[is_scaled])
    return Registration(similarity, *_bind(source, placed, target))


def _affine_moves(places: FloatArray) -> FloatArray:
    """Displacements (12, S, 3) that shift and shear places (S, 3) by 1 mm, and by 1 mm in 30."""
    spans = np.column_stack([np.ones(len(places)), (places - places.mean(axis=0)) / FACE_MM])
    moves: FloatArray = np.einsum("sk,cd->kcsd", spans, np.eye(3)).reshape(12, len(places), 3)
    return moves


def _fitted(basis: FloatArray, rows: IntArray, wanted: FloatArray, trust: FloatArray, ridge: float) -> FloatArray:
    """Displacements (S, 3) in the basis (P, S, 3), of which the last twelve are affine, nearest to (N, 3) at `rows`."""
    table = (basis[:, rows] * np.sqrt(trust)[:, None]).reshape(len(basis), -1)
    ridges = np.full(len(basis), ridge)
    ridges[-12:] = AFFINE_RIDGE
    target = (wanted * np.sqrt(trust)[:, None]).ravel()
    weights = np.linalg.solve(table @ table.T + np.diag(ridges), table @ target)
    moved: FloatArray = np.tensordot(weights, basis, 1)
    return moved


def factorise(matrix: sp.spmatrix) -> SuperLU:
    """Factors of a symmetric positive definite matrix."""
    options = {"SymmetricMode": True}
    return splu(sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", options=options, diag_pivot_thresh=0.01)


class _Samples:
    """Vertices and middles of the seen triangles of a skin, with their normals, by lip and lid."""

    def __init__(self, skin: Skin) -> None:
        whole = skin.triangles[skin.is_seen[skin.triangles].all(axis=1)]
        normals = skin.normals()
        flat = normals[whole].sum(axis=1)
        flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
        self._places = np.concatenate([skin.vertices[skin.is_seen], skin.vertices[whole].mean(axis=1)])
        self._normals = np.concatenate([normals[skin.is_seen], flat])
        self._side = np.concatenate([skin.side[skin.is_seen], skin.side[whole].max(axis=1)])
        self._trees: dict[int, tuple[cKDTree, IntArray]] = {}

    def nearest(self, places: FloatArray, normals: FloatArray, side: IntArray) -> tuple[FloatArray, Mask]:
        """Places (N, 3) on the planes of the nearest fitting samples, and whether there is one; none of side -1."""
        there, found = places.copy(), np.zeros(len(places), bool)
        for number in np.unique(side[side >= 0]).tolist():
            rows = np.flatnonzero(side == number)
            tree, members = self._tree(number)
            at = np.column_stack([places[rows], NORMAL_MM * normals[rows]])
            far, near = tree.query(at, N_SAMPLES, distance_upper_bound=SEARCHED_MM, workers=available_cores())
            near = members[np.minimum(near, len(members) - 1)]
            fits = ((self._normals[near] * normals[rows, None]).sum(axis=2) > MIN_COSINE) & np.isfinite(far)
            best = near[np.arange(len(rows)), np.where(fits, far, np.inf).argmin(axis=1)]
            apart = places[rows] - self._places[best]
            off = (apart * self._normals[best]).sum(axis=1, keepdims=True) * self._normals[best]
            slide = apart - off
            length = np.linalg.norm(slide, axis=1, keepdims=True)
            there[rows] = self._places[best] + slide * np.minimum(1.0, MAX_SLIDE_MM / np.maximum(length, 1e-9))
            found[rows] = fits.any(axis=1)
        return there, found

    def _tree(self, side: int) -> tuple[cKDTree, IntArray]:
        if side not in self._trees:
            members = np.flatnonzero((self._side == side) | (self._side == 0) if side else self._side >= 0)
            at = np.column_stack([self._places[members], NORMAL_MM * self._normals[members]])
            self._trees[side] = cKDTree(at), members
        return self._trees[side]


def _bind(source: Skin, placed: FloatArray, target: Skin) -> tuple[IntArray, FloatArray, FloatArray]:
    """Vertices (S, 3) of the registered source's triangle under each vertex of the target, weights, share of motion."""
    corners = placed[source.triangles]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    near = np.asarray(cKDTree(corners.mean(axis=1)).query(target.vertices, k=N_TRIANGLES)[1])
    weights, far = nearest_on_triangles(target.vertices[:, None], corners[near])
    cost = far + OPPOSED_MM * ((flat[near] * target.normals()[:, None]).sum(axis=2) < 0)
    side = source.side[source.triangles].max(axis=1)[near]
    own = target.side[:, None]
    cost += OTHER_SIDE_MM * ((side > 0) & (own > 0) & (side != own))
    is_inside = np.asarray(~source.is_seen[source.triangles].any(axis=1))
    # the inside of the source's mouth lies close behind the lips, and moves otherwise
    cost += HIDDEN_MM * (target.is_seen[:, None] & is_inside[near])
    row, best = np.arange(len(near)), cost.argmin(axis=1)
    share = 1.0 - np.clip((far[row, best] - FADE_MM[0]) / (FADE_MM[1] - FADE_MM[0]), 0.0, 1.0)
    return source.triangles[near[row, best]], weights[row, best], share


def nearest_on_triangles(places: FloatArray, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights (..., 3) of the points of triangles (..., 3, 3) nearest to places (..., 3), and the distances (...).

    The best of the face and of the three edges. Source: Ericson 2005, Real-Time Collision Detection, section 5.1.5.
    """
    a, b, c = (corners[..., k, :] for k in range(3))
    first, second = b - a, c - a
    there = places - a
    ee, eg, gg = ((u * v).sum(axis=-1) for u, v in ((first, first), (first, second), (second, second)))
    de, dg = ((there * v).sum(axis=-1) for v in (first, second))
    area = np.maximum(ee * gg - eg * eg, 1e-20)
    u, w = (gg * de - eg * dg) / area, (ee * dg - eg * de) / area
    along_first = np.clip(de / np.maximum(ee, 1e-20), 0.0, 1.0)
    along_second = np.clip(dg / np.maximum(gg, 1e-20), 0.0, 1.0)
    third = c - b
    along_third = ((places - b) * third).sum(axis=-1) / np.maximum((third * third).sum(axis=-1), 1e-20)
    along_third = np.clip(along_third, 0.0, 1.0)
    none = np.zeros_like(u)
    candidates = np.stack([
        np.stack([1.0 - u - w, u, w], axis=-1), np.stack([1.0 - along_first, along_first, none], axis=-1),
        np.stack([1.0 - along_second, none, along_second], axis=-1),
        np.stack([none, 1.0 - along_third, along_third], axis=-1),
    ])  # fmt: skip
    far = np.linalg.norm(np.einsum("k...i,...id->k...d", candidates, corners) - places, axis=-1)
    far[0] = np.where((candidates[0] >= 0).all(axis=-1), far[0], np.inf)
    best = far.argmin(axis=0)
    return np.take_along_axis(candidates, best[None, ..., None], axis=0)[0], far.min(axis=0)
