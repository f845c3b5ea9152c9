"""Pictures to check a face with: its landmarks, and a contact sheet of all shapes."""

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import build_rig
from tts2face.face.expressions import add_expression_shapes
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
from tts2face.picture.renderer import mesh_renderer
from tts2face.storage.marks import Mark, png_labels
from tts2face.types import Progress, ignore_progress

if TYPE_CHECKING:
    from tts2face.interchange.characters.importing import ImportedFace

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
CLOSED = "mouthClose"  # closes lips over an open jaw, as ARKit has it
WALL = "#8a8f98"
EYES = "(eyes)"  # source of shapes that no morph target moves: eyeballs turn
MAX_LABEL = 32  # letters, the last of a name
PAPER, INK = (245, 245, 243), (20, 20, 20)
SOURCE_INK, REPLACED_INK = (110, 110, 110), (190, 60, 20)


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


def draw_contact_sheet(
    face: Face, on_progress: Progress = ignore_progress, sources: Mapping[str, str] | None = None
) -> Pixels:
    """Picture (H, W, 3) of the face at rest and with each of its shapes at its highest weight, with names.

    Lips that close are drawn over a jaw that is open, as they are used.

    Parameters
    ----------
    sources
        Where shapes come from, written below their names; shapes without are those of the default head.
    """
    from PIL import Image, ImageDraw

    renderer = mesh_renderer(face, Picture(size=f"{CELL_PX}x{CELL_PX}", camera="front" if sources is None else "close"))
    poses = [("at rest", np.zeros(len(face.shape_names), np.float32))]
    for number, name in enumerate(face.shape_names):
        weights = np.zeros(len(face.shape_names), np.float32)
        weights[number] = face.limits[number, 1]
        if name == CLOSED and face.opening is not None:
            weights[face.opening] = weights[number]
        poses.append((name, weights))
    n_rows = -(-len(poses) // N_COLUMNS)
    row_px = CELL_PX + LABEL_PX * (1 if sources is None else 2)
    sheet = Image.new("RGB", (N_COLUMNS * CELL_PX, n_rows * row_px), PAPER)
    pen = ImageDraw.Draw(sheet)
    for number, (name, weights) in enumerate(poses):
        row, column = divmod(number, N_COLUMNS)
        corner = (column * CELL_PX, row * row_px)
        sheet.paste(Image.fromarray(renderer.draw(weights)), corner)
        lines = [(name, INK)]
        if sources is not None and number:
            lines += [(sources[name], SOURCE_INK) if name in sources else ("of the default head", REPLACED_INK)]
        for line, (written, ink) in enumerate(lines):
            label = written.encode("latin-1", "replace").decode("latin-1")[-MAX_LABEL:]
            pen.text((corner[0] + 4, corner[1] + CELL_PX + 2 + line * LABEL_PX), label, fill=ink)
        on_progress(number + 1, len(poses))
    return np.array(sheet)


def draw_import_sheet(imported: "ImportedFace", on_progress: Progress = ignore_progress) -> Pixels:
    """Contact sheet of an imported face with the sources of its shapes, and with those that replace missing ones."""
    face, mapping = imported.face, imported.report.mapping
    complete = add_expression_shapes(face) if len(face.landmarks) else face
    sources = {name: " + ".join(source.name for source in mapping.get(name, ())) or EYES for name in face.shape_names}
    return draw_contact_sheet(complete, on_progress, sources)


def png_bytes(pixels: Pixels, mark: Mark) -> bytes:
    """Content of a PNG file of a picture with the mark of the face."""
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(pixels).save(content, "PNG", pnginfo=png_labels(mark))
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
