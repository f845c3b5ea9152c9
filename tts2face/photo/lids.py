"""Lids that appear between the fold above an eye and the band that moves down with the lid's margin."""

import numpy as np

from tts2face.photo.lines import N_LID
from tts2face.photo.mesh import PhotoMesh, grid_triangles
from tts2face.photo.surface import LIDS, PhotoPages, PhotoSurface

N_LID_ROWS = 5  # of vertices, from the fold to the band
SHOWN_ABOVE = 0.018  # of the eye distance above the fold, whose skin a lid shows on its way there and back


def add_lids(surface: PhotoSurface, mesh: PhotoMesh, pages: PhotoPages, scale: float) -> None:
    """Add the lids, whose skin is that above the fold, mirrored: it fits at both ends."""
    skin = surface.vertices[0]
    bow = np.sin(np.linspace(0, np.pi, N_LID))[:, None] ** 0.5
    for fold, band, margin in zip(mesh.folds, mesh.bands, mesh.upper_lids, strict=True):
        moving = np.concatenate([fold[:1], band[-1], fold[-1:]])
        up = mesh.places[fold] - mesh.places[margin]
        way = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-6) * (SHOWN_ABOVE * scale) * bow
        rows = []
        for share in np.linspace(0, 1, N_LID_ROWS):
            shown = mesh.places[fold] + way * (1 - abs(2 * share - 1))
            rows.append(surface.add(skin.at(fold).between(skin.at(moving), float(share)), uv=pages.uv(shown)))
        triangles = grid_triangles(np.stack(rows))
        is_mirrored = mesh.places[fold[0], 0] > mesh.places[fold[-1], 0]
        surface.parts.append((LIDS, triangles[:, ::-1] if is_mirrored else triangles))
