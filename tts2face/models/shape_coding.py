"""Displacements of shapes as files hold them: sparse, in steps of 16 bits."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import zeros_with_room
from tts2face.storage.schema import Contents, Tensor

STEPS_PER_SHAPE = 32000.0  # 16-bit steps of a shape's largest displacement, at most
MAX_STEP_MM = 0.1  # 16 bits of it are 3 m
ROOM = 32  # further shapes for which faces have room; a palette adds about 15
TRIPLE = np.dtype("V12")  # displacement of a vertex: rows are copied as one item each, in half of the time
MAX_CELLS = 100_000_000  # shapes x vertices: 1.2 GB when read; a head has 1.4 million

SHAPE_TENSORS: Mapping[str, Tensor] = {
    "shape_steps": Tensor("float32", ("shapes",), 0.0, MAX_STEP_MM, may_be_empty=True),
    "shape_counts": Tensor("int32", ("shapes",), 0, may_be_empty=True),
    "shape_vertices": Tensor("int32", ("moved vertices",), may_be_empty=True),
    "shape_deltas": Tensor("int16", ("moved vertices", 3), may_be_empty=True),
}


def check_shapes(contents: Contents, names: Sequence[str]) -> None:
    """Check the shapes of these names, whose arrays are of the right kinds."""
    arrays, n_shapes, n_vertices = contents.arrays, contents.sizes["shapes"], contents.sizes["vertices"]
    contents.indices("shape_vertices", n_vertices, "vertices")
    contents.require(len(names) == n_shapes, f"has {len(names)} shape_names, but {n_shapes} shape_steps")
    contents.require(len(set(names)) == len(names), "has two shapes of the same name")
    contents.require(n_shapes * n_vertices <= MAX_CELLS, f"has {n_shapes} shapes of {n_vertices} vertices: too many")
    moved, total = contents.sizes["moved vertices"], int(arrays["shape_counts"].sum(dtype=np.int64))
    contents.require(total == moved, f"shape_counts adds up to {total}, but there are {moved} moved vertices")


def quantise(values: NDArray[np.floating], least: float = 1e-9) -> tuple[NDArray[np.int16], float]:
    """Values in whole steps, and the step: one of the largest value's 32000, and no smaller than `least`."""
    step = max(float(np.abs(values).max(initial=0.0)) / STEPS_PER_SHAPE, least)
    return np.rint(values / step).astype(np.int16), step


def pack_shapes(shapes: Iterable[NDArray[np.floating]], least_mm: float) -> dict[str, NDArray[Any]]:
    """Arrays by name of displacements (V, 3), mm, of shapes, in steps of at least so many mm."""
    steps, sizes, moved = [], [], []
    for shape in shapes:
        quantised, step = quantise(shape, least_mm)
        rows = np.flatnonzero(quantised.any(axis=1))
        steps.append(quantised[rows])
        sizes.append(step)
        moved.append(rows.astype(np.int32))
    return {
        "shape_deltas": np.concatenate([np.zeros((0, 3), np.int16), *steps]),
        "shape_vertices": np.concatenate([np.zeros(0, np.int32), *moved]),
        "shape_counts": np.array([len(rows) for rows in moved], np.int32),
        "shape_steps": np.array(sizes, np.float32),
    }


def unpack_shapes(arrays: Mapping[str, NDArray[Any]], n_vertices: int) -> NDArray[np.float32]:
    """Displacements (K, V, 3) of what `pack_shapes` returned."""
    counts, steps = arrays["shape_counts"], arrays["shape_steps"]
    # shapes of a palette are appended without a copy of all
    shapes = zeros_with_room(len(counts), ROOM, (n_vertices, 3))
    bounds = np.concatenate([[0], np.cumsum(counts)])
    for at, step in enumerate(steps):
        span = slice(bounds[at], bounds[at + 1])
        moved = arrays["shape_deltas"][span] * step
        shapes[at].view(TRIPLE)[arrays["shape_vertices"][span]] = moved.view(TRIPLE)
    return shapes
