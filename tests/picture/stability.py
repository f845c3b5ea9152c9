"""Temporal stability of pictures: how much pixels flicker when the head moves slowly."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.picture.kernels.picture import allocate_buffers, draw_samples, project_surface
from tts2face.picture.kernels.raster import NO_TRIANGLE
from tts2face.picture.scene import Scene

Masks = dict[str, NDArray[np.bool_]]
EDGE_PX = 2  # width of the edge of skin on either side


def flicker(frames: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Change (H, W) of pixels that a steady motion does not explain, in levels of 255.

    Half the second difference of three successive frames (T, H, W, 3), averaged over time and channels.
    """
    grey = frames[..., :3].astype(np.float64).mean(axis=-1)
    bends: NDArray[np.float64] = np.abs(grey[2:] - 2 * grey[1:-1] + grey[:-2]).mean(axis=0) / 2
    return bends


def part_masks(scene: Scene, weights: NDArray[np.floating]) -> Masks:
    """Pixels (H, W) of the face's strands by the name of their part, and of the edges of its skin, at rest.

    Parts without kind whose names begin with lashes or brows count as strands.
    """
    face, picture = scene.face, scene.picture
    names = sorted(
        {part.name for part in face.parts if part.kind == "strands" or part.name.startswith(("lash", "brow"))}
    )
    masks = {name: _projected(scene, weights, face, name) for name in names}
    part_of = np.append(scene.surface.part_of, -1)[visible_triangles(scene, weights)]
    is_skin = np.isin(part_of, [at for at, part in enumerate(face.parts) if part.name.startswith("skin")])
    edge = np.zeros((picture.height, picture.width), bool)
    for axis in (0, 1):
        for step in range(-EDGE_PX, EDGE_PX + 1):
            edge |= is_skin != np.roll(is_skin, step, axis=axis)
    for mask in masks.values():
        edge &= ~mask
    return masks | {"edges of skin": edge}


def visible_triangles(scene: Scene, weights: NDArray[np.floating]) -> NDArray[np.int32]:
    """Visible triangle (H, W) at the centre of each pixel, front or back; -1 without."""
    picture, side = scene.picture, scene.picture.samples_per_side
    size = (picture.width * side, picture.height * side)
    buffers = allocate_buffers(scene.surface, size, 1)
    points = scene.surface.rig.pose(weights)
    members = project_surface(points, scene.surface, (scene.optics.view, scene.optics.lens), buffers, size)
    bands = []
    for first in range(0, size[1], buffers.band_rows):
        draw_samples(scene.surface, scene.optics.lens, members, first, buffers)
        bands.append(buffers.owner[0].copy())
    owner = np.concatenate(bands)[: size[1]][side // 2 :: side, side // 2 :: side]
    triangles: NDArray[np.int32] = np.where(owner == NO_TRIANGLE, -1, np.where(owner < 0, ~owner, owner))
    return triangles


def _projected(scene: Scene, weights: NDArray[np.floating], face: Face, name: str) -> NDArray[np.bool_]:
    """Pixels (H, W) around the vertices of the parts of a name."""
    used = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.name == name]
    points = scene.surface.rig.pose(weights)[np.unique(np.concatenate(used))].astype(np.float64)
    view, lens, side = scene.optics.view, scene.optics.lens, scene.picture.samples_per_side
    camera = points @ view[:, :3].T + view[:, 3]
    places = ((lens[1:3] + lens[0] * camera[:, :2] / camera[:, 2:]) / side).astype(int)
    mask = np.zeros((scene.picture.height, scene.picture.width), bool)
    inside = (places >= 0).all(axis=1) & (places < [mask.shape[1], mask.shape[0]]).all(axis=1)
    for x, y in places[inside]:
        mask[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = True
    return mask
