"""Difference between a face's baked light and the path tracer, in poses and from cameras that were not fitted."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from corpus_tools.shipped.film.poses import LitPose
from tts2face.models.face import Face
from tts2face.models.landmarks import MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT
from tts2face.numeric.arrays import Mask, Pixels
from tts2face.picture.baked.scene import LitScene
from tts2face.picture.baked.visibility import TRIANGLE_MASK, X, Y, nearest_triangles, project
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

REGIONS: Mapping[str, tuple[str, ...]] = {
    "hair": ("hair",),
    "eyes": ("sclera", "iris"),
    "clothes": ("shirt",),
}  # by their parts; the face is all others above the neck
MOUTH_MARGIN_PX = 4  # of 512 around the lips
LIPS = (MOUTH_CORNER_RIGHT, MOUTH_CORNER_LEFT, 0, 17)
NECK_PX = 55  # of 512 below the lower lip, where the face ends


@dataclass(frozen=True, slots=True)
class View:
    """One comparison: a pose, seen by a camera of `tts2face.picture.options.Picture`."""

    pose: LitPose
    camera: str


def draw_view(face: Face, view: View, side: int) -> tuple[Pixels, dict[str, Mask]]:
    """Picture (S, S, 4) of a face, and the regions (S, S) of its parts that are seen."""
    picture = Picture(size=f"{side}x{side}", camera=view.camera, background="transparent")
    renderer = mesh_renderer(face, picture)
    if not isinstance(renderer.scene, LitScene):
        raise TypeError("the face has no baked light")
    return renderer.draw(view.pose.weights, view.pose.head), _regions(renderer.scene, view.pose)


def _regions(scene: LitScene, pose: LitPose) -> dict[str, Mask]:
    face, side, n = scene.face, scene.picture.width, scene.picture.samples_per_side
    surface, table = scene.surface, scene.surface.template.copy()
    points = scene.pose(pose.weights, pose.head)
    optics = (scene.optics.view.astype(np.float32), scene.optics.lens.astype(np.float32))
    project(points, surface.source, *optics, table)
    nearest, _, _ = nearest_triangles(table, surface.triangles, (side * n, side * n))
    seen = (nearest[n // 2 :: n, n // 2 : side * n : n] & TRIANGLE_MASK) - 1
    part_names = np.repeat([part.name for part in face.parts], [part.count for part in face.parts])
    names = part_names[surface.light.triangle_numbers[np.maximum(seen, 0)]]
    covered = seen >= 0
    found = {region: covered & np.isin(names, parts) for region, parts in REGIONS.items()}
    rows = {int(number): row for row, number in enumerate(face.landmarks)}
    used = [rows[name] for name in LIPS]
    lips = np.einsum("lc,lcx->lx", face.landmark_weights[used], points[face.landmark_vertices[used]])
    corners = np.zeros((len(LIPS), table.shape[1]), np.float32)
    project(lips.astype(np.float32), np.arange(len(LIPS), dtype=np.int32), *optics, corners)
    places, scale = corners[:, [X, Y]] / n, side / 512
    low, high = places.min(axis=0) - MOUTH_MARGIN_PX * scale, places.max(axis=0) + MOUTH_MARGIN_PX * scale
    down, across = np.mgrid[:side, :side]
    found["mouth"] = (across > low[0]) & (across < high[0]) & (down > low[1]) & (down < high[1])
    below_neck = down > places[:, 1].max() + NECK_PX * scale
    found["face"] = covered & ~np.any([found[region] for region in REGIONS], axis=0) & ~below_neck
    return found


def differences(drawn: Pixels, traced: Pixels, regions: Mapping[str, Mask]) -> dict[str, float]:
    """Mean difference of 255 by region between pictures (S, S, 4), both over grey."""
    first, second = (over_grey(item).astype(np.float64) for item in (drawn, traced))
    apart = np.abs(first - second).mean(axis=2)
    return {name: float(apart[mask].mean()) for name, mask in regions.items() if mask.any()}


def over_grey(picture: Pixels) -> Pixels:
    """(S, S, 3) picture (S, S, 4) over a grey wall."""
    cover = picture[:, :, 3:] / 255.0
    mixed: Pixels = np.rint(picture[:, :, :3] * cover + 90 * (1 - cover)).astype(np.uint8)
    return mixed
