"""Pictures to check a face with: its landmarks, and a contact sheet of all shapes."""

import io

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import build_rig
from tts2face.face.eyelids import BLINK_SHAPES
from tts2face.face.landmarks import scatter_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LID_RINGS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.models.light import Photographed
from tts2face.numeric.arrays import Pixels
from tts2face.picture.camera import camera_matrices
from tts2face.picture.options import STUDIO, Picture
from tts2face.picture.provenance import png_labels
from tts2face.picture.renderer import mesh_renderer
from tts2face.types import Progress, ignore_progress

# Lines through landmarks and their sRGB colours: lids, inner lips, outer lips, outline.
LINES = (
    *(((*ring, ring[0]), (70, 190, 255)) for ring in LID_RINGS),
    (INNER_LIP_UPPER, (255, 70, 70)),
    (INNER_LIP_LOWER, (255, 200, 40)),
    (OUTER_LIP_UPPER, (255, 120, 200)),
    (OUTER_LIP_LOWER, (255, 120, 200)),
    ((*FACE_OVAL, FACE_OVAL[0]), (90, 220, 120)),
)
PREVIEW_PX = 640
CELL_PX = 192
LABEL_PX = 16
N_COLUMNS = 8
OPEN_WEIGHT = 0.5  # of the opening shape in the second picture of the preview
WALL = "#8a8f98"
PAPER, INK = (245, 245, 243), (20, 20, 20)


def draw_preview(face: Face) -> Pixels:
    """Picture (H, W, 3) of the face with its landmarks: at rest, with an open mouth, and three-quarter.

    That of a photograph is shown with shut eyes in place of the last.
    """
    opened = np.zeros(len(face.shape_names), np.float32)
    if face.opening is not None:
        opened[face.opening] = OPEN_WEIGHT
    rest = np.zeros_like(opened)
    views = ((rest, "front"), (opened, "front"), (rest, "three-quarter"))
    if isinstance(face.light, Photographed):
        shut = np.isin(face.shape_names, BLINK_SHAPES).astype(np.float32)
        views = ((rest, "close"), (opened, "close"), (shut, "close"))
    return np.concatenate([_draw_landmarks(face, weights, camera) for weights, camera in views], axis=1)


def draw_contact_sheet(face: Face, on_progress: Progress = ignore_progress) -> Pixels:
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
    places = scatter_landmarks(face, optics.pixels(posed))
    for x, y in places[np.isfinite(places[:, 0])]:
        pen.ellipse((x - 1.5, y - 1.5, x + 1.5, y + 1.5), fill=(255, 255, 255))
    for line, colour in LINES:
        known = [(float(x), float(y)) for x, y in places[list(line)] if np.isfinite(x)]
        pen.line(known, fill=colour, width=2)
    return np.array(drawn)
