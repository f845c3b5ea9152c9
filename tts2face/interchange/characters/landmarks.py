"""Landmarks of a character, found by tracking rendered views of it with the tracker of talkers and performers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.characters.lip_line import find_lip_line
from tts2face.interchange.characters.surface_points import SurfacePoints, points_under_pixels
from tts2face.models.face import Face, keep_parts
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    N_LANDMARKS,
    N_MESH_LANDMARKS,
)
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.camera import camera_matrices
from tts2face.picture.kernels.lamps import lamp_directions, light_table
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer
from tts2face.picture.scene import Scene, build_scene
from tts2face.video.tracking import MIN_SCORE, FaceTracker

VIEWS = tuple((yaw, pitch) for yaw in (-16, -8, 0, 8, 16) for pitch in (-2, 6))  # degrees
LEAST_FACING = 0.3  # cosine between ray and surface normal; readings at lower values are unreliable
LEAST_VIEWS = 3  # reliable readings of a landmark; with fewer all are used
SIDE_PX = 640
BACKGROUND = "#8a8f98"
OPENINGS = (0.5, 0.8)  # weights of the opening shape at which the inner lips are read
SKIN, EYES = "skin", "eyes"  # beginnings of the names of parts on which landmarks lie
BEHIND_LIPS = ("teeth", "tongue")  # not in the views: the tracker reads the upper teeth as a part of the lip


@dataclass(frozen=True, slots=True, eq=False)
class LocatedLandmarks:
    """Landmarks `numbers` (L,) on a mesh, and the mean score of the tracker."""

    numbers: NDArray[np.int64]
    points: SurfacePoints
    score: float


class CharacterViews:
    """Rendered views of a face without teeth and tongue, with landmarks read in each; shadows are computed once."""

    def __init__(self, face: Face, model: Path | None = None) -> None:
        self.face = face
        self._tracker = FaceTracker(model)
        bare = keep_parts(face, lambda part: not part.name.startswith(BEHIND_LIPS))
        self._shown: Scene = build_scene(bare, _picture(0, 0))

    def read(self, view: tuple[float, float], weights: NDArray[np.float32]) -> tuple[FloatArray, float]:
        """Landmarks (478, 2) in pixels of a view (yaw and pitch in degrees), and the score; NaN without a face."""
        scene = self._scene(view)
        drawn = MeshRenderer(scene).draw(weights)
        tracking = self._tracker.track(lambda: [drawn], 25.0)
        return tracking.points[0, :, :2].astype(np.float64) + 0.5, float(tracking.scores[0])

    def frontal_score(self) -> float:
        """Score of the tracker in the frontal view; 0 where no face is found."""
        return self.read((0, 0), np.zeros(len(self.face.shape_names), np.float32))[1]

    def points(
        self, view: tuple[float, float], weights: NDArray[np.float32], pixels: FloatArray, triangles: NDArray[np.int64]
    ) -> tuple[SurfacePoints, FloatArray]:
        """Points of the mesh at pixels of a view, and how much the surface faces it."""
        camera = camera_matrices(_picture(*view).view, self.face, (SIDE_PX, SIDE_PX))
        positions = self._shown.surface.rig.pose(weights).astype(np.float64)
        return points_under_pixels(pixels, positions, triangles, camera)

    def _scene(self, view: tuple[float, float]) -> Scene:
        picture = _picture(*view)
        side = SIDE_PX * picture.samples_per_side
        optics = camera_matrices(picture.view, self.face, (side, side))
        lights = light_table(lamp_directions(picture.view), optics)
        return replace(self._shown, picture=picture, optics=optics, lights=lights)


def locate_landmarks(views: CharacterViews) -> LocatedLandmarks | None:
    """Landmarks of a face without landmarks; None where no face is recognised, as in the head of an animal.

    The skin is read at rest in all `VIEWS`, the inner lips with an open mouth. Each landmark is the reading nearest to
    the median of all.
    """
    face = views.face
    skin, eyes = part_triangles(face, SKIN), part_triangles(face, EYES)
    rest = np.zeros(len(face.shape_names), np.float32)
    readings, scores = _readings(views, [rest], skin, np.arange(N_MESH_LANDMARKS))
    if len(readings) < len(VIEWS) // 2:
        return None
    numbers, points = np.arange(N_MESH_LANDMARKS), _medoids(readings, face.vertices)
    opened = _opened_weights(face)
    if opened:
        # medians at rest put inner lips 2 mm inside the mouth; they are read open (decision 078)
        inner = np.array(sorted({*INNER_LIP_UPPER, *INNER_LIP_LOWER}))
        lips, _ = _readings(views, opened, skin, inner)
        if lips:
            better = _medoids(lips, face.vertices)
            points.vertices[inner], points.weights[inner] = better.vertices, better.weights
            points = find_lip_line(points, face.vertices, skin, face.shapes[face.opening])
    if len(eyes):
        irises = np.arange(N_MESH_LANDMARKS, N_LANDMARKS)
        found, _ = _readings(views, [rest], eyes, irises)
        numbers = np.concatenate([numbers, irises])
        points = _joined(points, _medoids(found, face.vertices))
    return LocatedLandmarks(numbers, points, float(np.mean(scores)))


def part_triangles(face: Face, kind: str) -> NDArray[np.int64]:
    """Triangles (F, 3) of the parts of a kind; all triangles where no part is of this kind and the kind is skin."""
    spans = [face.triangles[p.first : p.first + p.count] for p in face.parts if p.name.startswith(kind)]
    if not spans and kind == SKIN:
        spans = [face.triangles]
    return np.concatenate([np.zeros((0, 3), np.int32), *spans]).astype(np.int64)


def _readings(
    views: CharacterViews,
    poses: Sequence[NDArray[np.float32]],
    triangles: NDArray[np.int64],
    numbers: NDArray[np.int64],
) -> tuple[list[tuple[SurfacePoints, FloatArray]], list[float]]:
    """Landmarks `numbers` of each view and pose in which a face is recognised, and the scores."""
    found, scores = [], []
    for weights in poses:
        for view in VIEWS:
            pixels, score = views.read(view, weights)
            if score >= MIN_SCORE and np.isfinite(pixels).all():
                found.append(views.points(view, weights, pixels[numbers], triangles))
                scores.append(score)
    return found, scores


def _medoids(readings: Sequence[tuple[SurfacePoints, FloatArray]], vertices: NDArray[np.floating]) -> SurfacePoints:
    """For each point the reliable reading nearest to the median of the reliable ones, on the face at rest."""
    places = np.stack([points.places(vertices) for points, _ in readings])
    is_used = np.stack([facing >= LEAST_FACING for _, facing in readings])
    is_used |= is_used.sum(axis=0) < LEAST_VIEWS
    median = np.nanmedian(np.where(is_used[:, :, None], places, np.nan), axis=0)
    gaps = np.where(is_used, np.linalg.norm(places - median, axis=2), np.inf)
    best, row = gaps.argmin(axis=0), np.arange(gaps.shape[1])
    corners = np.stack([points.vertices for points, _ in readings])[best, row]
    weights = np.stack([points.weights for points, _ in readings])[best, row]
    return SurfacePoints(corners, np.clip(weights, 0.0, 1.0) / np.clip(weights, 0.0, 1.0).sum(axis=1, keepdims=True))


def _joined(points: SurfacePoints, other: SurfacePoints) -> SurfacePoints:
    return SurfacePoints(
        np.concatenate([points.vertices, other.vertices]), np.concatenate([points.weights, other.weights])
    )


def _opened_weights(face: Face) -> list[NDArray[np.float32]]:
    """Shape weights (K,) of each opening of the mouth; empty for a face that cannot open it."""
    if face.opening is None:
        return []
    poses = np.zeros((len(OPENINGS), len(face.shape_names)), np.float32)
    poses[:, face.opening] = OPENINGS
    return list(poses)


def _picture(yaw: float, pitch: float) -> Picture:
    return Picture(size=f"{SIDE_PX}x{SIDE_PX}", camera=f"{yaw:g},{pitch:g}", background=BACKGROUND)
