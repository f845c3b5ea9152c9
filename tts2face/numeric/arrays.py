"""Types of arrays, and numerical functions, shared by several packages.

sRGB values and linear light (IEC 61966-2-1).
"""

import threading
import weakref
from bisect import bisect_left
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
RealArray = NDArray[np.floating]  # float32 or float64
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]
Pixels = NDArray[np.uint8]
Array = NDArray[Any]
AnyFloat = TypeVar("AnyFloat", np.float32, np.float64)
_N_USED: dict[int, int] = {}  # rows that arrays of `zeros_with_room` have given away, by their numbers
_LOCK = threading.Lock()
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB, IEC 61966-2-1


def make_read_only(record: Any) -> None:
    """Lock the arrays of a dataclass against writing."""
    for field in fields(record):
        if isinstance(array := getattr(record, field.name), np.ndarray):
            array.setflags(write=False)


def ordered_product(a: NDArray[np.floating], b: NDArray[np.floating]) -> FloatArray:
    """Matrix product whose result is bit-identical for any number of threads, unlike that of a threaded BLAS."""
    summed: FloatArray = np.einsum("...k,kj->...j" if b.ndim > 1 else "...k,k->...", a, b)
    return summed


def zeros_with_room(n_rows: int, room: int, row: tuple[int, ...]) -> NDArray[np.float32]:
    """Zeros (n, ...) that `append_rows` extends in place by up to `room` rows, which take no memory before."""
    whole = np.zeros((n_rows + room, *row), np.float32)
    _N_USED[id(whole)] = n_rows
    weakref.finalize(whole, _N_USED.pop, id(whole), None)
    return whole[:n_rows]


def append_rows(rows: NDArray[np.float32], more: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rows (n, ...) with (m, ...) behind them: in the same memory where it has room, which only one caller gets."""
    whole, n = rows.base, len(rows) + len(more)
    if whole is None or whole.shape[1:] != rows.shape[1:] or whole.ctypes.data != rows.ctypes.data or n > len(whole):
        return np.concatenate([rows, more])
    with _LOCK:
        is_last = _N_USED.get(id(whole)) == len(rows)
        if is_last:
            _N_USED[id(whole)] = n
    if not is_last:
        return np.concatenate([rows, more])
    whole[len(rows) : n] = more
    extended: NDArray[np.float32] = whole[:n]
    return extended


def true_runs(values: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(N, 2) first index and one past the last of each run of True in (T,)."""
    borders = np.flatnonzero(np.diff(np.concatenate([[False], values, [False]])))
    return borders.reshape(-1, 2)


def longest_increasing(values: NDArray[np.floating]) -> Mask:
    """Values (T,) of a longest increasing part: as few as possible of the others are left out (Fredman 1975)."""
    found: Mask = np.ones(len(values), np.bool_)
    if (np.diff(values) > 0).all():
        return found
    ends = list[float]()  # least last value of a part of each length
    rows = list[int]()  # where these stand
    before = np.full(len(values), -1)
    for row, value in enumerate(values.tolist()):
        at = bisect_left(ends, value)
        if at < len(ends) and ends[at] == value:
            continue
        before[row] = rows[at - 1] if at else -1
        ends[at : at + 1] = [value]
        rows[at : at + 1] = [row]
    found[:] = False
    row = rows[-1]
    while row >= 0:
        found[row] = True
        row = int(before[row])
    return found


def connected_pieces(corners: NDArray[np.integer], n_vertices: int) -> NDArray[np.int32]:
    """(V,) number of the connected piece of each vertex of triangles (T, 3), by the first vertex of the pieces."""
    first = np.arange(n_vertices)
    left, right = np.concatenate([corners[:, :2], corners[:, 1:]]).T
    while len(left):
        np.minimum.at(first, np.maximum(left, right), np.minimum(left, right))
        while not np.array_equal(first, beyond := first[first]):
            first = beyond
        left, right = first[left], first[right]
        apart = left != right
        left, right = left[apart], right[apart]
    return np.unique(first, return_inverse=True)[1].astype(np.int32)


def smoothstep(values: NDArray[AnyFloat], low: float = 0.0, high: float = 1.0) -> NDArray[AnyFloat]:
    """``3 s^2 - 2 s^3``: from 0 at `low` to 1 at `high` without slope at both, constant outside; `high` may be less."""
    share = np.clip((values - low) / (high - low), 0.0, 1.0)
    curve: NDArray[AnyFloat] = share * share * (3.0 - 2.0 * share)
    return curve


def unit_vectors(vectors: NDArray[AnyFloat]) -> NDArray[AnyFloat]:
    """Vectors (..., 3) of length one in the same directions; the zero vector stays zero."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    units: NDArray[AnyFloat] = vectors / np.maximum(lengths, np.finfo(vectors.dtype).tiny)
    return units


def vertex_normals(points: FloatArray, triangles: NDArray[np.integer]) -> FloatArray:
    """Unit normals (V, 3) of vertices (V, 3) of a mesh: means over the triangles (T, 3) around, weighted by area."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    found = np.zeros_like(points)
    for k in range(3):
        np.add.at(found, triangles[:, k], flat)
    return unit_vectors(found)


def smooth_gaussian(values: FloatArray, spread: float, reach: int) -> FloatArray:
    """Values (n,) smoothed by a Gaussian of `spread` samples, cut off at `reach` samples; ends are continued."""
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / spread) ** 2)
    smooth: FloatArray = np.convolve(np.pad(values, reach, mode="edge"), kernel / kernel.sum(), mode="valid")
    return smooth


def nearest_rotation(matrix: NDArray[np.floating]) -> FloatArray:
    """The rotation (3, 3) nearest to a matrix (3, 3) in least squares; never a reflection (Kabsch 1976)."""
    left, _, right = np.linalg.svd(matrix)
    signs = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation: FloatArray = left @ signs @ right
    return rotation


def quaternion_matrix(turn: FloatArray) -> FloatArray:
    """Rotation matrix (3, 3) of a quaternion (x, y, z, w), which is normalised first."""
    length = float(np.linalg.norm(turn))
    x, y, z, w = turn / length if length > 1e-9 else (0.0, 0.0, 0.0, 1.0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def matrix_quaternion(matrix: FloatArray) -> FloatArray:
    """Quaternion (4,), x y z w, of a rotation matrix (3, 3); the numerically largest component is computed first."""
    m = matrix
    squares = np.array(
        [
            1 + m[0, 0] - m[1, 1] - m[2, 2],
            1 - m[0, 0] + m[1, 1] - m[2, 2],
            1 - m[0, 0] - m[1, 1] + m[2, 2],
            1 + m[0, 0] + m[1, 1] + m[2, 2],
        ]
    )
    a, b, c = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    d, e, f = m[1, 0] + m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2]
    rows = np.array([[squares[0], d, e, a], [d, squares[1], f, b], [e, f, squares[2], c], [a, b, c, squares[3]]])
    row: FloatArray = rows[int(squares.argmax())]
    return row / np.linalg.norm(row)


def rotation_quaternions(vectors: FloatArray) -> FloatArray:
    """Unit quaternions (T, 4) x, y, z, w of rotation vectors (T, 3) in radians."""
    angle = np.linalg.norm(vectors, axis=1)
    scale = np.where(angle > 0, np.sin(angle / 2) / np.where(angle > 0, angle, 1), 0.5)
    return np.column_stack([vectors * scale[:, None], np.cos(angle / 2)])


def quaternion_product(first: FloatArray, second: FloatArray) -> FloatArray:
    """Hamilton products (T, 4) of quaternions x, y, z, w: the rotation `second`, then `first`."""
    (ax, ay, az, aw), (bx, by, bz, bw) = first.T, second.T
    return np.column_stack([
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ])  # fmt: skip


def continuous_quaternions(values: FloatArray, before: FloatArray | None) -> FloatArray:
    """The same rotations with signs such that neighbours lie on the same side, so that interpolation is the short way.

    `before` (4,) precedes the first of `values` (T, 4); None for a beginning.
    """
    rows = values if before is None else np.vstack([before, values])
    turns = np.einsum("td,td->t", rows[1:], rows[:-1]) < 0
    signs = np.concatenate([[1.0], np.where(np.cumsum(turns) % 2 == 1, -1.0, 1.0)])
    signed: FloatArray = rows * signs[: len(rows), None]
    return signed if before is None else signed[1:]


def principal_axes(scatter: NDArray[np.floating], n_axes: int) -> tuple[FloatArray, FloatArray]:
    """The `n_axes` largest variances and unit axes (n_axes, D) of a scatter matrix (D, D), largest first."""
    variances, vectors = np.linalg.eigh(scatter)
    return np.maximum(variances[::-1][:n_axes], 0.0), vectors[:, ::-1][:, :n_axes].T


def fix_signs(axes: NDArray[AnyFloat]) -> NDArray[AnyFloat]:
    """Axes (K, D) with the sign that makes the largest entry of each positive: the same for the same data."""
    largest = axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)]
    signed: NDArray[AnyFloat] = axes * np.sign(largest)[:, None]
    return signed


def dot_products(a: NDArray[AnyFloat], b: NDArray[AnyFloat]) -> NDArray[AnyFloat]:
    """(...) dot products of vectors (..., C) of few entries: numpy takes several times as long for so short an axis."""
    total = a[..., 0] * b[..., 0]
    for c in range(1, a.shape[-1]):
        total += a[..., c] * b[..., c]
    return total


def points_in_polygon(places: NDArray[np.floating], polygon: NDArray[np.floating]) -> NDArray[np.bool_]:
    """(P,) whether points (P, 2) are inside a polygon (N, 2), by counting the edges to their right."""
    near = np.flatnonzero(((places >= polygon.min(axis=0)) & (places <= polygon.max(axis=0))).all(axis=1))
    x, y = places[near, 0, None], places[near, 1, None]
    (ax, ay), (bx, by) = polygon.T, np.roll(polygon, -1, axis=0).T
    spans = (ay > y) != (by > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = ax + (y - ay) * (bx - ax) / (by - ay)
    inside = np.zeros(len(places), bool)
    inside[near] = (spans & (x < crossing)).sum(axis=1) % 2 == 1
    return inside


def interpolate_rows(values: NDArray[np.float32], at: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, D) values at N fractional row indices of (T, D) values, linear between rows; the last row is held."""
    low = np.clip(at.astype(int), 0, len(values) - 1)
    share = (at - low)[:, None].astype(np.float32)
    return np.asarray((1 - share) * values[low] + share * values[np.minimum(low + 1, len(values) - 1)], np.float32)


def interpolate_cubic(values: NDArray[np.float32], at: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, D) values at N fractional row indices of (T, D) values, by Catmull-Rom cubics (Catmull and Rom 1974)."""
    low = np.minimum(at, len(values) - 1).astype(int)
    part = (at - low)[:, None].astype(np.float32)
    before, here, after, beyond = (values[np.clip(low + k, 0, len(values) - 1)] for k in (-1, 0, 1, 2))
    slope_here, slope_after = (after - before) / 2, (beyond - here) / 2
    # Hermite form: coefficients of the second and third power
    bend, twist = 3 * (after - here) - 2 * slope_here - slope_after, 2 * (here - after) + slope_here + slope_after
    return np.asarray(here + part * (slope_here + part * (bend + part * twist)), np.float32)


def interpolate_linear(
    values: NDArray[np.float32], times: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Values (N, ...) at N instants from (T, ...) at increasing times (T,); constant before and after."""
    if len(times) == 1:
        return np.repeat(values, len(at), axis=0)
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    share = np.clip((at - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1)).astype(np.float32)
    return np.asarray(values[after - 1] * (1 - share) + values[after] * share, np.float32)


def interpolate_columns(values: NDArray[np.floating], times: NDArray[Any], at: NDArray[Any]) -> NDArray[np.float64]:
    """(N, D) values at N instants from (T, D) at increasing times (T,), as float64; constant before and after."""
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def decode_srgb(srgb: NDArray[np.floating]) -> NDArray[np.float64]:
    """Linear light of sRGB values, both in [0, 1]."""
    # IEC 61966-2-1
    linear: NDArray[np.float64] = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return linear


def encode_light(linear: NDArray[np.floating]) -> NDArray[Any]:
    """Values in sRGB of linear light, both in [0, 1]; light beyond is clipped."""
    clipped = np.clip(linear, 0.0, 1.0)
    srgb: NDArray[Any] = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return srgb


def encode_srgb(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """8-bit sRGB values of linear light; light beyond [0, 1] is clipped."""
    values: NDArray[np.uint8] = np.rint(255.0 * encode_light(linear)).astype(np.uint8)
    return values
