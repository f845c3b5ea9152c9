"""Landmarks of a character, found by tracking rendered views of it with the tracker of talkers and performers.

Table of landmark positions of a character (TSV), in the units and axes of its file.

Pictures to check a face with: its landmarks, and a contact sheet of all shapes.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from tts2face.face.deformation import build_rig, scatter_landmarks
from tts2face.face.expressions import BLINK_SHAPES
from tts2face.interchange.characters.shapes import VISEME_PREFIX
from tts2face.interchange.characters.surface_points import SurfacePoints, points_under_pixels
from tts2face.models.face import Face, keep_parts
from tts2face.models.landmarks import (
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LID_RINGS,
    N_LANDMARKS,
    N_MESH_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.models.light import Photographed
from tts2face.picture.camera import camera_matrices
from tts2face.picture.kernels.tables import lamp_directions, light_table
from tts2face.picture.options import STUDIO, Picture
from tts2face.picture.provenance import png_labels
from tts2face.picture.renderer import MeshRenderer, mesh_renderer
from tts2face.picture.scene import Scene, build_scene
from tts2face.types import Progress
from tts2face.video.tracking import MIN_SCORE, FaceTracker

VIEWS = tuple((yaw, pitch) for yaw in (-16, -8, 0, 8, 16) for pitch in (-2, 6))  # degrees
LEAST_FACING = 0.3  # cosine between ray and surface normal; readings at lower values are unreliable
LEAST_VIEWS = 3  # reliable readings of a landmark; with fewer all are used
SIDE_PX = 640
BACKGROUND = "#8a8f98"
OPENINGS = (0.5, 0.8)  # weights of the opening shape at which the inner lips are read
OPENING_SHAPES = ("jawOpen", f"{VISEME_PREFIX}aa", f"{VISEME_PREFIX}oh")
SKIN, EYES = "skin", "eyes"  # beginnings of the names of parts on which landmarks lie
BEHIND_LIPS = ("teeth", "tongue")  # not in the views: the tracker reads the upper teeth as a part of the lip

FloatArray = NDArray[np.float64]


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


def locate_landmarks(views: CharacterViews) -> LocatedLandmarks:
    """Landmarks of a face without landmarks.

    The skin is read at rest in all `VIEWS`, the inner lips with an open mouth. Each landmark is the reading nearest to
    the median of all.
    """
    face = views.face
    skin, eyes = part_triangles(face, SKIN), part_triangles(face, EYES)
    rest = np.zeros(len(face.shape_names), np.float32)
    readings, scores = _readings(views, [rest], skin, np.arange(N_MESH_LANDMARKS))
    if len(readings) < len(VIEWS) // 2:
        raise DataError(
            "no face is recognised in the pictures of the character; give the axis that it looks along with --front, "
            "or the positions of its landmarks with --landmarks"
        )
    numbers, points = np.arange(N_MESH_LANDMARKS), _medoids(readings, face.vertices)
    opened = _opened_weights(face)
    if opened:
        inner = np.array(sorted({*INNER_LIP_UPPER, *INNER_LIP_LOWER}))
        lips, _ = _readings(views, opened, skin, inner)
        if lips:
            better = _medoids(lips, face.vertices)
            points.vertices[inner], points.weights[inner] = better.vertices, better.weights
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


def _joined(one: SurfacePoints, other: SurfacePoints) -> SurfacePoints:
    return SurfacePoints(np.concatenate([one.vertices, other.vertices]), np.concatenate([one.weights, other.weights]))


def _opened_weights(face: Face) -> list[NDArray[np.float32]]:
    """Shape weights (K,) of each opening of the mouth; empty for a face that cannot open it."""
    name = next((name for name in OPENING_SHAPES if name in face.shape_names), None)
    if name is None:
        return []
    poses = np.zeros((len(OPENINGS), len(face.shape_names)), np.float32)
    poses[:, face.shape_names.index(name)] = OPENINGS
    return list(poses)


def _picture(yaw: float, pitch: float) -> Picture:
    return Picture(size=f"{SIDE_PX}x{SIDE_PX}", camera=f"{yaw:g},{pitch:g}", background=BACKGROUND)


COLUMNS = ("landmark", "x", "y", "z")
MAX_TABLE_BYTES = 1_000_000
MAX_COORDINATE = 1e6


def landmark_table(places: Mapping[int, FloatArray]) -> str:
    """Positions (3,) of landmarks as the text of a TSV file."""
    rows = ["\t".join([str(number), *(f"{value:.6g}" for value in place)]) for number, place in sorted(places.items())]
    return "\n".join(["\t".join(COLUMNS), *rows]) + "\n"


def read_landmark_table(path: Path) -> dict[int, FloatArray]:
    """Positions (3,) of the landmarks of a TSV file."""
    try:
        lines = read_text(path, MAX_TABLE_BYTES).splitlines()
    except OSError as refused:
        raise InputError(f"cannot read the landmarks {path}: {refused.strerror}; check the path") from refused
    places: dict[int, FloatArray] = {}
    for row, line in enumerate(lines, 1):
        cells = [cell.strip() for cell in line.split("\t")]
        if not line.strip() or line.startswith("#") or tuple(cells) == COLUMNS:
            continue
        number, place = _row(cells, f"{path}, line {row}")
        if number in places:
            raise DataError(f"{path}, line {row}: the landmark {number} occurs twice; remove one of its rows")
        places[number] = place
    if not places:
        raise DataError(f"{path} has no landmark; give rows of landmark, x, y and z, separated by tabs")
    return places


def _row(cells: list[str], place: str) -> tuple[int, FloatArray]:
    try:
        number, *values = (int(cells[0]), *(float(cell) for cell in cells[1:]))
    except ValueError as error:
        raise DataError(f"{place}: {error}; give landmark, x, y and z as numbers") from error
    if len(values) != 3 or not 0 <= number < N_LANDMARKS:
        raise DataError(f"{place}: give a landmark of 0 to {N_LANDMARKS - 1} and its x, y and z")
    position = np.array(values, np.float64)
    if not (np.abs(position) <= MAX_COORDINATE).all():
        raise DataError(f"{place}: a coordinate is not finite or beyond {MAX_COORDINATE:g}; correct it")
    return number, position


# Lines through landmarks and their sRGB colours: lids, inner lips, outer lips, outline.
LINES = (
    *(((*ring, ring[0]), (70, 190, 255)) for ring in LID_RINGS),
    (INNER_LIP_UPPER, (255, 70, 70)),
    (INNER_LIP_LOWER, (255, 200, 40)),
    (OUTER_LIP_UPPER, (255, 120, 200)),
    (OUTER_LIP_LOWER, (255, 120, 200)),
    ((*FACE_OVAL, FACE_OVAL[0]), (90, 220, 120)),
)
PREVIEW_PX, CELL_PX, LABEL_PX, N_COLUMNS = 640, 192, 16, 8
OPEN_WEIGHT = 0.5  # of the opening shape in the second picture of the preview
SHOWN_OPENING_SHAPES = ("jawOpen", f"{VISEME_PREFIX}aa")
WALL = "#8a8f98"
PAPER, INK = (245, 245, 243), (20, 20, 20)

Pixels = NDArray[np.uint8]


def draw_preview(face: Face) -> Pixels:
    """Picture (H, W, 3) of the face with its landmarks: at rest, with an open mouth, and three-quarter.

    That of a photograph is shown with shut eyes in place of the last.
    """
    opened = np.zeros(len(face.shape_names), np.float32)
    opening = next((name for name in SHOWN_OPENING_SHAPES if name in face.shape_names), None)
    if opening is not None:
        opened[face.shape_names.index(opening)] = OPEN_WEIGHT
    rest = np.zeros_like(opened)
    views = ((rest, "front"), (opened, "front"), (rest, "three-quarter"))
    if isinstance(face.light, Photographed):
        shut = np.isin(face.shape_names, BLINK_SHAPES).astype(np.float32)
        views = ((rest, "close"), (opened, "close"), (shut, "close"))
    return np.concatenate([_draw_landmarks(face, weights, camera) for weights, camera in views], axis=1)


def draw_contact_sheet(face: Face, on_progress: Progress | None = None) -> Pixels:
    """Picture (H, W, 3) of the face at rest and with each of its shapes at its highest weight, with names."""
    from PIL import Image, ImageDraw

    renderer = mesh_renderer(face, Picture(size=f"{CELL_PX}x{CELL_PX}"))
    poses = [("at rest", np.zeros(len(face.shape_names), np.float32))]
    for number, name in enumerate(face.shape_names):
        weights = np.zeros(len(face.shape_names), np.float32)
        weights[number] = face.limits[number, 1]
        poses.append((name, weights))
    n_rows = -(-len(poses) // N_COLUMNS)
    sheet = Image.new("RGB", (N_COLUMNS * CELL_PX, n_rows * (CELL_PX + LABEL_PX)), PAPER)
    pen = ImageDraw.Draw(sheet)
    for number, (name, weights) in enumerate(poses):
        row, column = divmod(number, N_COLUMNS)
        corner = (column * CELL_PX, row * (CELL_PX + LABEL_PX))
        sheet.paste(Image.fromarray(renderer.draw(weights)), corner)
        label = name.encode("latin-1", "replace").decode("latin-1")[:32]
        pen.text((corner[0] + 4, corner[1] + CELL_PX + 2), label, fill=INK)
        if on_progress:
            on_progress(number + 1, len(poses))
    return np.array(sheet)


def png_bytes(pixels: Pixels, notice: str = "") -> bytes:
    """Content of a PNG file of a picture, labelled by the face's `notice`."""
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(pixels).save(content, "PNG", pnginfo=png_labels(notice))
    return content.getvalue()


def _draw_landmarks(face: Face, weights: NDArray[np.float32], camera: str) -> Pixels:
    from PIL import Image, ImageDraw

    background = STUDIO if isinstance(face.light, Photographed) else WALL
    picture = Picture(size=f"{PREVIEW_PX}x{PREVIEW_PX}", camera=camera, background=background)
    drawn = Image.fromarray(mesh_renderer(face, picture).draw(weights))
    pen = ImageDraw.Draw(drawn)
    posed = np.einsum(
        "lk,lkd->ld", face.landmark_weights.astype(np.float64), build_rig(face).pose(weights)[face.landmark_vertices]
    )
    optics = camera_matrices(picture.view, face, (PREVIEW_PX, PREVIEW_PX))
    there = posed @ optics.view[:, :3].T + optics.view[:, 3]
    places = scatter_landmarks(face, there[:, :2] / there[:, 2:] * optics.lens[0] + optics.lens[1:3])
    for x, y in places[np.isfinite(places[:, 0])]:
        pen.ellipse((x - 1.5, y - 1.5, x + 1.5, y + 1.5), fill=(255, 255, 255))
    for line, colour in LINES:
        pen.line(_known(places, line), fill=colour, width=2)
    return np.array(drawn)


def _known(places: NDArray[np.float64], line: Sequence[int]) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in places[list(line)] if np.isfinite(x)]
