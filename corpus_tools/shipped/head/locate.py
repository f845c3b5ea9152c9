"""``python -m corpus_tools.shipped.head.locate``: landmarks of the head, found by tracking rendered views of it.

Landmarks of the head are thus defined by the same tracker as those of talkers. Inner lips and lids are then moved onto
the edge rings where they meet, and the two halves of the face are made symmetric.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from corpus_tools.shipped.head.build_head import default_cage, fetch_all, head_face
from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.correspondence import nearest_surface_points, write_places
from corpus_tools.shipped.head.edge_rings import EdgeRings, find_narrowest_ring
from corpus_tools.shipped.head.eyes import fit_eyeballs
from corpus_tools.shipped.head.skin import HeadSkin, build_skin
from corpus_tools.shipped.head.subdivision import triangulate
from lexicon.errors import DataError
from tts2face.models.face import Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, LID_RINGS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import FloatArray, IntArray
from tts2face.picture.camera import camera_matrices
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.video.tracking import FaceTracker

YAWS, PITCHES, SIZES = (-14, -7, 0, 7, 14), (-3, 3, 9), (640, 900)
LEAST_FACING = 0.25  # cosine between the surface normal and the ray; hits at lower values are discarded
GRAZE_MM = (
    3.0,
    12.0,
)  # a ray that passes the surface at up to 3 mm, at least 12 mm before its hit, hits it there
LEAST_VIEWS = 6  # with reliable hits; with fewer the landmark lies on the outline of the face
EXPRESSIONS: tuple[dict[str, float], ...] = (
    {},
    {"jawOpen": 0.5},
    {"jawOpen": 0.2, "mouthSmileLeft": 0.5, "mouthSmileRight": 0.5},
)  # lips far apart
SOLID = ("skin", "sclera", "iris")  # parts that rays meet
EARS_MM = -90.0  # z of the ears; no landmark lies behind them
MOUTH_OPEN = 0.3  # weight of jawOpen at which the lips' ring has an inside
MOUTH_REACH_MM, EYE_REACH_MM = 40.0, 30.0


def locate_landmarks(face: Face, skin: HeadSkin, cage: Cage, tracker: FaceTracker) -> dict[int, FloatArray]:
    """Position (3,) of each of the 468 mesh landmarks on the source's base mesh."""
    mirrored = mirrored_landmarks(face, tracker)
    triangles = triangulate(skin.quads)
    views = [project_landmarks(face, picture, tracker) for picture in tracking_views()]
    on_face = median_places(np.stack([hits for hits, _ in views]), np.stack([reliable for _, reliable in views]))
    number, weights, _ = nearest_surface_points(on_face, skin.vertices, triangles)
    places = np.einsum("pk,pkd->pd", weights, skin.base[triangles[number]])
    number, weights, _ = nearest_surface_points(symmetrise(places, mirrored), skin.base, triangles)
    places = np.einsum("pk,pkd->pd", weights, skin.base[triangles[number]])
    strips = EdgeRings(skin.quads, skin.base)
    _align_inner_lips(places, skin, strips)
    for ball, lids in zip(fit_eyeballs(cage), LID_RINGS[::-1], strict=True):
        ring = find_narrowest_ring(strips, skin.vertices, ball.centre, EYE_REACH_MM, ball.radius)
        for lid in lids:
            places[lid] = nearest_ring_point(skin, ring, on_face[lid])
    return dict(enumerate(symmetrise(places, mirrored)))


def tracking_views() -> Iterator[Picture]:
    """The rendered views in which landmarks are tracked."""
    for yaw in YAWS:
        for pitch in PITCHES:
            for size in SIZES:
                yield Picture(size=f"{size}x{size}", camera=f"{yaw},{pitch}", background="#8a8f98")


def project_landmarks(face: Face, picture: Picture, tracker: FaceTracker) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Positions (468, 3) in mm on the head of the landmarks tracked in a view, and which of them are reliable."""
    drawn = mesh_renderer(face, picture).draw(np.zeros(len(face.shape_names), np.float32))
    points = tracker.track(lambda: [drawn], 25.0).points[0, :N_MESH_LANDMARKS, :2].astype(np.float64)
    camera = camera_matrices(picture.view, face, (picture.width, picture.height))
    focal, middle_x, middle_y, _ = camera.lens
    seen = np.column_stack(
        [points[:, 0] + 0.5 - middle_x, points[:, 1] + 0.5 - middle_y, np.full(N_MESH_LANDMARKS, focal)]
    )
    rays = seen @ camera.view[:, :3]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    origin = -camera.view[:, :3].T @ camera.view[:, 3]
    solid = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.name in SOLID]
    corners = face.vertices[np.concatenate(solid)].astype(np.float64)
    corners = corners[corners[:, :, 2].max(axis=1) > EARS_MM]
    hits = [intersect_ray(origin, ray, corners) for ray in rays]
    return np.array([place for place, _ in hits]), np.array([facing >= LEAST_FACING for _, facing in hits])


def intersect_ray(origin: FloatArray, ray: FloatArray, corners: FloatArray) -> tuple[FloatArray, float]:
    """First intersection of a ray with triangles (F, 3, 3), and the cosine between the ray and the surface normal.

    A ray without intersection gives the nearest corner and 0; one that grazes an outline first gives the corner there.
    Source: Moeller and Trumbore 1997.
    """
    to_second, to_third = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across, off = np.cross(ray, to_third), origin - corners[:, 0]
    determinant = (to_second * across).sum(axis=1)
    determinant[np.abs(determinant) < 1e-12] = np.inf
    beside = np.cross(off, to_second)
    second, third = (off * across).sum(axis=1) / determinant, beside @ ray / determinant
    depth = (beside * to_third).sum(axis=1) / determinant
    inside = (second >= 0) & (third >= 0) & (second + third <= 1) & (depth > 0)
    if not inside.any():
        distances = np.linalg.norm(np.cross(off, ray), axis=1)
        return corners[int(distances.argmin()), 0], 0.0
    first = int(np.where(inside, depth, np.inf).argmin())
    along = -off @ ray
    grazed = along < depth[first] - GRAZE_MM[1]
    distances = np.linalg.norm(np.cross(off[grazed], ray), axis=1)
    if distances.size and distances.min() < GRAZE_MM[0]:  # past the outline of the face onto what lies far behind it
        return corners[grazed][int(distances.argmin()), 0], 1.0
    normal = np.cross(to_second[first], to_third[first])
    return origin + depth[first] * ray, -float(normal @ ray) / max(float(np.linalg.norm(normal)), 1e-30)


def median_places(hits: FloatArray, is_reliable: NDArray[np.bool_]) -> FloatArray:
    """(L, 3) median over the views (N, L, 3) of the reliable positions; of all where few views are reliable."""
    used = is_reliable | (is_reliable.sum(axis=0) < LEAST_VIEWS)
    return np.asarray(np.nanmedian(np.where(used[:, :, None], hits, np.nan), axis=0))


def mirrored_landmarks(face: Face, tracker: FaceTracker) -> IntArray:
    """(468,) index of each landmark's mirror image on the other half of the face; its own index on the midline."""
    picture = Picture(size="900x900", camera="0,3")
    renderer, features = mesh_renderer(face, picture), []
    for shown in EXPRESSIONS:
        weights = np.array([shown.get(name, 0.0) for name in face.shape_names], np.float32)
        drawn = renderer.draw(weights)
        points = tracker.track(lambda drawn=drawn: [drawn], 25.0).points[0, :N_MESH_LANDMARKS].astype(np.float64)  # type: ignore[misc]
        features.append(points - [(picture.width - 1) / 2, 0, 0])
    read = np.concatenate(features, axis=1)
    cost = np.linalg.norm(read[:, None] - (read * np.tile([-1.0, 1.0, 1.0], len(EXPRESSIONS)))[None], axis=2)
    mirrored = np.asarray(linear_sum_assignment(cost)[1], np.int64)
    if (mirrored[mirrored] != np.arange(N_MESH_LANDMARKS)).any():
        raise DataError("landmarks do not pair up on the two halves of the face; check the rendered views of the head")
    return mirrored


def symmetrise(places: FloatArray, mirrored: IntArray) -> FloatArray:
    """Symmetric positions: the mean of each landmark and the reflection of its mirror image."""
    mean: FloatArray = (places + (places * [-1, 1, 1])[mirrored]) / 2
    return mean


def _align_inner_lips(places: FloatArray, skin: HeadSkin, strips: EdgeRings) -> None:
    """Move the inner lips onto the edge ring where they meet; opposite landmarks get the same x."""
    opened = skin.vertices + MOUTH_OPEN * skin.shapes["jawOpen"]
    lips = [int(np.linalg.norm(skin.base - places[lip], axis=1).argmin()) for lip in (0, 17)]  # outer, in the middle
    ring = find_narrowest_ring(strips, opened, opened[lips].mean(axis=0), MOUTH_REACH_MM)
    ring = np.roll(ring, -int(skin.base[ring, 0].argmin()))
    line = skin.base[np.append(ring, ring[0])]
    turn = int(line[:, 0].argmax())
    arcs = sorted((line[: turn + 1], line[turn:][::-1]), key=lambda arc: float(np.interp(0.0, arc[:, 0], arc[:, 1])))
    for above, below in zip(INNER_LIP_UPPER, INNER_LIP_LOWER, strict=True):
        x = (places[above, 0] + places[below, 0]) / 2
        for landmark, arc in ((below, arcs[0]), (above, arcs[1])):
            places[landmark] = [np.interp(x, arc[:, 0], arc[:, axis]) for axis in range(3)]
    places[INNER_LIP_UPPER[0]], places[INNER_LIP_UPPER[-1]] = line[0], line[turn]


def nearest_ring_point(skin: HeadSkin, ring: IntArray, point: FloatArray) -> FloatArray:
    """Point (3,) of an edge ring, on the source's base mesh, nearest to a point in the frontal view."""
    after = np.roll(ring, -1)
    starts, along = skin.vertices[ring, :2], skin.vertices[after, :2] - skin.vertices[ring, :2]
    share = np.clip(((point[:2] - starts) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    at = int(np.linalg.norm(starts + share[:, None] * along - point[:2], axis=1).argmin())
    place: FloatArray = (1 - share[at]) * skin.base[ring[at]] + share[at] * skin.base[after[at]]
    return place


def main() -> None:
    """Find the landmarks and write the table."""
    data = fetch_all(Path.home() / ".cache/tts2face/models")
    cage = default_cage(data.source)
    skin = build_skin(cage)
    write_places(locate_landmarks(head_face(data), skin, cage, FaceTracker()))


if __name__ == "__main__":
    main()
