"""Brows of a drawn character: solid ribbons that move as one body."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from corpus_tools.dense.grids import grid_triangles
from corpus_tools.shipped.drawn.character import Brow, Colour
from corpus_tools.shipped.drawn.fields import profile, smooth_line, smooth_rows
from corpus_tools.shipped.head.correspondence import nearest_surface_points
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.subdivision import triangulate
from tts2face.numeric.arrays import FloatArray, unit_vectors

N_ALONG_BROW, N_ACROSS = 96, 7
LIFT_MM, RIM_SINK_MM = 0.9, 1.6  # of the ribbon above the skin, and of its rims into it
FOREHEAD_MM = 130.0  # twice the radius of the forehead that the ribbon bends around
SMOOTH_STEPS = N_ALONG_BROW / 16  # spread along the brow of its place, normals and motion
N_HAIRS, SLANT = 11, 1.3  # along the brow, and how far they lean outwards over half its width, in hairs
GROOVE, FRINGE, SHADE = 0.28, 0.07, 0.30  # shares of thickness, width and brightness that are less between hairs
OWN_SHARE = 0.5  # of the motion across the brow that is kept
AHEAD_SHARE = 0.18  # of a rise by which the brow comes forward: it drowns in the raised forehead else
BROW_MATERIAL = {"specular": 0.05, "shininess": 10.0, "wrap": 0.5}


def brow_piece(skin: HeadSkin, brow: Brow, colour: Colour) -> HeadPart:
    """Both brows on the skin of a character."""
    triangles = _forehead(skin)
    points, faces = [], []
    for number, sign in enumerate((1.0, -1.0)):
        points.append(_ribbon(skin, triangles, brow, sign))
        grid = grid_triangles(N_ALONG_BROW, N_ACROSS)
        faces.append((grid[:, ::-1] if sign > 0 else grid) + number * N_ALONG_BROW * N_ACROSS)
    vertices = np.concatenate(points)
    nearest, weights, _ = nearest_surface_points(vertices, skin.vertices, triangles)
    shapes = {}
    for name, moved in skin.shapes.items():
        follow = np.einsum("nk,nkd->nd", weights, moved[triangles[nearest]]).reshape(2, N_ALONG_BROW, N_ACROSS, 3)
        middle = np.stack([smooth_rows(item, SMOOTH_STEPS) for item in follow.mean(axis=2, keepdims=True)])
        follow = middle + OWN_SHARE * (follow - middle)
        if name.startswith("brow"):
            follow[..., 2] += AHEAD_SHARE * np.clip(follow[..., 1], 0, None)
        if np.abs(follow).max() > 1e-3:
            shapes[name] = follow.reshape(-1, 3)
    span = MaterialSpan("brows", np.concatenate(faces), BROW_MATERIAL)
    bright = 1 - SHADE * _between_hairs().ravel()
    return HeadPart(vertices, (span,), np.array(colour) * np.tile(bright, 2)[:, None], shapes)


def _between_hairs() -> FloatArray:
    """(`N_ALONG`, `N_ACROSS`) 0 on the hairs to 1 between them; they grow upwards and lean outwards."""
    along, place = np.linspace(0, 1, N_ALONG_BROW)[:, None], np.linspace(-1, 1, N_ACROSS)
    between: FloatArray = 0.5 - 0.5 * np.cos(2 * np.pi * (N_HAIRS * along - SLANT * place))
    return between


def _forehead(skin: HeadSkin) -> NDArray[np.int64]:
    """(F, 3) triangles of the skin on which brows lie."""
    triangles = triangulate(skin.quads)
    places = skin.vertices[triangles].mean(axis=1)
    return np.asarray(triangles[(places[:, 2] > -20) & (places[:, 1] > 2) & (places[:, 1] < 70)])


def _ribbon(skin: HeadSkin, triangles: NDArray[np.int64], brow: Brow, sign: float) -> FloatArray:
    """(`N_ALONG` x `N_ACROSS`, 3) points of the brow on the side of x with a sign."""
    places, normals = skin.vertices[triangles].mean(axis=1), vertex_normals(skin.vertices, skin.quads, skin.base)
    along = np.linspace(0, 1, N_ALONG_BROW)
    width, height = profile(brow.half_width, along), profile(brow.thickness, along)
    flat = smooth_line(brow.line, N_ALONG_BROW) * [sign, 1]
    ahead = places[cKDTree(places[:, :2]).query(flat)[1], 2]
    number, weights, _ = nearest_surface_points(np.column_stack([flat, ahead]), skin.vertices, triangles)
    on_skin = smooth_rows(np.einsum("nk,nkd->nd", weights, skin.vertices[triangles[number]]), SMOOTH_STEPS)
    normal = unit_vectors(np.einsum("nk,nkd->nd", weights, normals[triangles[number]]))
    normal = unit_vectors(smooth_rows(normal, SMOOTH_STEPS))
    across = sign * unit_vectors(np.cross(normal, unit_vectors(np.gradient(on_skin, axis=0))))
    place = np.linspace(-1, 1, N_ACROSS)
    between = _between_hairs()
    off = width[:, None] * place * (1 - FRINGE * between)
    lens = height[:, None] * np.sqrt(np.clip(1 - place**2, 0, 1)) * (1 - GROOVE * between)
    lift = lens + LIFT_MM - RIM_SINK_MM * (np.abs(place) > 0.99) - off**2 / FOREHEAD_MM
    points = on_skin[:, None] + off[..., None] * across[:, None] + lift[..., None] * normal[:, None]
    return np.asarray(points.reshape(-1, 3))
