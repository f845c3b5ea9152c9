"""Surfaces of the live preview: what can be seen, with as many triangles as its shape and motion need."""

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.exports.decimation import N_SPACE, decimate
from tts2face.interchange.exports.surfaces import ExportSurface, divide_surface
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.light_fields import N_HARMONICS
from tts2face.picture.materials import EYE_KIND, SKIN, STRANDS

HIDDEN_SKY = 0.045  # share of the sky that a vertex hidden from all sides has in a light field
HIDDEN_MM = 5.0  # error of hidden skin, which is removed
SKIN_MM, MOUTH_MM = 0.8, 0.2  # error of skin that no channel moves, and the least one, of lips and lids
EYE_MM = 0.3  # of eyeballs
INSIDE_MM = 0.25  # of teeth, gums and tongue
CLOTH_MM = 1.2
CLOTH_LENGTH_MM = 150.0  # of a surface that is no part of the head
LEAST_TRIANGLES = 200  # of a surface that is reduced
LEAST_PHOTO_TRIANGLES = 500  # in a photograph, whose lids are narrow and fit the skin exactly
N_MOTIONS = 3  # principal motions of a surface, which its triangles interpolate
LIGHT_MM = 4.0  # error of the whole sky's light
TEXTURE_SHARE = 0.3  # of a shift of the texture over the surface in its error
BACK_OF_EYE = -0.35  # cosine to the front, beyond which no turn of an eyeball shows its surface


def stage_surfaces(face: Face, fields: NDArray[np.float32], moves: NDArray[np.float32]) -> list[ExportSurface]:
    """Surfaces of a face for the preview, vertices in the order in which they are drawn.

    Parameters
    ----------
    fields : (V, 20)
        Light fields as `tts2face.picture.light_fields.light_fields` makes them.
    moves : (K, V, 3)
        Displacements in mm of the channels at weight 1.
    """
    light = fields[:, [0, N_HARMONICS + 1]]
    sky = np.maximum(light[:, 0], light.sum(axis=1))
    shown = (sky >= HIDDEN_SKY) | moves.any(axis=(0, 2))
    return [_along_curve(face, _reduced(face, surface, shown, (moves, light))) for surface in divide_surface(face)]


def _reduced(
    face: Face,
    surface: ExportSurface,
    shown: NDArray[np.bool_],
    values: tuple[NDArray[np.float32], NDArray[np.float32]],
) -> ExportSurface:
    """The surface without what no view shows, and with fewer triangles; cards of hair stay as they are."""
    part = surface.part
    own = surface.vertices
    triangles = surface.triangles
    is_photo = face.light.is_flat and part.texture == 0
    if part.kind == STRANDS or len(triangles) < (LEAST_PHOTO_TRIANGLES if is_photo else LEAST_TRIANGLES):
        return surface
    points = _points(face, surface, *values)
    if is_photo:
        shown = np.ones_like(shown)
    tolerances = _tolerances(surface, points[:, :N_SPACE], shown, values[0], is_skin=is_photo or part.kind == SKIN)
    triangles = decimate(points, triangles, tolerances)
    if part.kind == SKIN:
        triangles = triangles[shown[own[triangles]].any(axis=1)]
    elif part.kind == EYE_KIND:
        triangles = triangles[_fronts(face, own)[triangles].any(axis=1)]
    return ExportSurface(part, own, triangles)


def _points(face: Face, surface: ExportSurface, moves: NDArray[np.float32], light: NDArray[np.float32]) -> FloatArray:
    """Places (n, 3) in mm beside light, principal motions and texture coordinates, which triangles interpolate."""
    own, triangles = surface.vertices, surface.triangles
    places = face.vertices[own].astype(np.float64)
    columns = [places, LIGHT_MM * light[own]]
    if moves[:, own].any():
        moved = moves[:, own].transpose(1, 0, 2).reshape(len(own), -1)
        columns.append(moved @ np.linalg.eigh((moved.T @ moved).astype(np.float64))[1][:, -N_MOTIONS:])
    if surface.part.is_textured and face.uv is not None:
        uv = face.uv[own].astype(np.float64)
        p, q = (places[triangles[:, k]] - places[triangles[:, 0]] for k in (1, 2))
        a, b = (uv[triangles[:, k]] - uv[triangles[:, 0]] for k in (1, 2))
        in_texture = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
        scale = np.sqrt(np.linalg.norm(np.cross(p, q), axis=1).sum() / max(in_texture, 1e-9))
        columns.append(TEXTURE_SHARE * scale * uv)
    return np.hstack(columns)


def _tolerances(
    surface: ExportSurface, places: FloatArray, shown: NDArray[np.bool_], moves: NDArray[np.float32], *, is_skin: bool
) -> FloatArray:
    """Errors (n,) in mm of a surface: least where many channels move it, which lips and lids do."""
    own, kind = surface.vertices, surface.part.kind
    if not is_skin:
        is_cloth = np.ptp(places, axis=0).max() > CLOTH_LENGTH_MM
        return np.full(len(own), EYE_MM if kind == EYE_KIND else CLOTH_MM if is_cloth else INSIDE_MM)
    lengths = np.linalg.norm(moves, axis=2)
    largest = np.maximum(lengths.max(axis=1, keepdims=True), 1e-6)
    activity = (lengths[:, own] / largest).sum(axis=0)
    return np.where(shown[own], np.maximum(SKIN_MM / (1 + 0.5 * activity), MOUTH_MM), HIDDEN_MM)


def _fronts(face: Face, own: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a turn of the eyeball can show each of some vertices."""
    places = face.vertices[own]
    centres = np.stack([eye.centre for eye in face.eyes]) if face.eyes else places.mean(axis=0, keepdims=True)
    away = places[:, None] - centres
    nearest = np.linalg.norm(away, axis=2).argmin(axis=1)
    offset = away[np.arange(len(places)), nearest]
    return np.asarray(offset[:, 2] > BACK_OF_EYE * np.linalg.norm(offset, axis=1))


def _along_curve(face: Face, surface: ExportSurface) -> ExportSurface:
    """The surface with triangles along a curve that fills space, and vertices in the order of their first use.

    Neighbours follow each other, so that few vertices are shaded twice. Source: Morton 1966.
    """
    corners = surface.vertices[surface.triangles]
    middle = face.vertices[corners].mean(axis=1)
    low, high = middle.min(axis=0), middle.max(axis=0)
    cells = ((middle - low) / np.maximum(high - low, 1e-6) * 1023).astype(np.int64)
    code = np.zeros(len(cells), np.int64)
    # Morton code of 3 x 10 bits: triangles near each other in space stay near in the file
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    used = corners[np.argsort(code, kind="stable")].ravel()
    vertices, first, places = np.unique(used, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    return ExportSurface(surface.part, vertices[np.argsort(first)], rank[places.ravel()].reshape(-1, 3))
