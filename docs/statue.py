"""Statues of shipped faces, as a scanner sees them: skin and eyes as one closed surface of irregular triangles."""

from pathlib import Path

import numpy as np
import pyvista as pv
from scipy import ndimage

from tts2face.interchange.characters.transfer.parts import triangles_of
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, vertex_normals

STEP_MM, THICK_MM = 1.25, 1.5  # side of a cell, and half of the width of the gaps that close: lips, lids
N_TRIANGLES = 22_000
N_SAMPLES = 5  # along an edge of a triangle


def write_statue(face: Face, path: Path) -> None:
    """Write the closed surface around skin and eyes of a face as .obj, in metres, without colours."""
    corners = face.vertices[face.triangles[triangles_of(face, "skin", "eyes")]].astype(np.float64)
    first, second = np.meshgrid(np.arange(N_SAMPLES + 1), np.arange(N_SAMPLES + 1))
    inside = first + second <= N_SAMPLES
    weights = np.stack([first[inside], second[inside], N_SAMPLES - first[inside] - second[inside]], axis=1) / N_SAMPLES
    surface = _closed(np.einsum("sk,fkd->fsd", weights, corners).reshape(-1, 3))
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in np.asarray(surface.points) / 1000.0]
    lines += [f"f {a} {b} {c}" for a, b, c in surface.faces.reshape(-1, 4)[:, 1:] + 1]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _closed(points: FloatArray) -> pv.PolyData:
    """Surface at a small distance around points (N, 3), moved back onto them; the neck is closed from below."""
    low = points.min(axis=0) - 6.0
    cells = np.rint((points - low) / STEP_MM).astype(np.int64)
    size = cells.max(axis=0) + 6
    flat = np.ravel_multi_index(tuple(cells.T), tuple(size))
    count = np.bincount(flat, minlength=int(size.prod()))
    means = np.stack([np.bincount(flat, points[:, k], len(count)) for k in range(3)], axis=1)
    means /= np.maximum(count, 1)[:, None]
    nearest = ndimage.distance_transform_edt(count.reshape(size) == 0, return_distances=False, return_indices=True)
    at = np.ravel_multi_index(tuple(nearest.reshape(3, -1)), tuple(size))
    places = low + STEP_MM * np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), axis=-1).reshape(-1, 3)
    far = np.linalg.norm(places - means[at], axis=1).reshape(size)
    for level in range(size[1] // 2):  # the lowest ring of the neck gets a lid
        ring = ndimage.binary_closing(np.pad(far[:, level] < THICK_MM, 8), iterations=3)[8:-8, 8:-8]
        lid = ndimage.binary_fill_holes(ring)
        if (lid & ~ring).sum() > 2500:
            far[:, level][lid], far[:, :level] = 0.0, 8.0
            break
    outside = ndimage.label(far >= THICK_MM)[0]
    field = ndimage.gaussian_filter(np.where(outside == outside[0, 0, 0], far - THICK_MM, -THICK_MM), 0.8)
    grid = pv.ImageData(dimensions=tuple(size), spacing=(STEP_MM,) * 3, origin=low)
    grid.point_data["far"] = field.ravel(order="F")
    found = grid.contour([0.0], scalars="far").connectivity("largest").clean().triangulate()
    places, corners = np.asarray(found.points, np.float64), found.faces.reshape(-1, 4)[:, 1:]
    if (np.cross(*places[corners[:, :2]].swapaxes(0, 1)) * places[corners[:, 2]]).sum() < 0:
        corners = corners[:, ::-1]
    places -= 0.9 * THICK_MM * vertex_normals(places, corners)
    mesh = pv.PolyData(places, np.column_stack([np.full(len(corners), 3), corners]).ravel())
    return mesh.decimate(1.0 - N_TRIANGLES / len(corners))
