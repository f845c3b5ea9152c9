"""Scene of a mesh face: everything that is constant over the frames of a clip, including the background."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.deformation import head_transform
from tts2face.models.face import Face
from tts2face.picture.camera import CameraMatrices, camera_matrices
from tts2face.picture.camera_view import CameraView
from tts2face.picture.kernels.lamps import FIRST_LIGHT_ROW, lamp_directions, light_table
from tts2face.picture.kernels.picture import (
    DrawingBuffers,
    Pose,
    allocate_buffers,
    draw_samples,
    draw_surface,
    project_surface,
)
from tts2face.picture.kernels.raster import NOT_DRAWN
from tts2face.picture.kernels.tables import OPEN_SURFACE
from tts2face.picture.light import Exposure, compute_exposure
from tts2face.picture.occlusion import occlusion_poses
from tts2face.picture.options import BLUR, DRAFT, STUDIO, Picture, parse_background
from tts2face.picture.surface import Surface, build_surface
from tts2face.processes.threads import available_cores
from tts2face.storage.pictures import open_picture

BACKS_SIDE_PX = 192  # pictures that show which back faces are visible; one band of rows
STUDIO_BRIGHT, STUDIO_DARK = (150.0, 146.0, 141.0), (62.0, 62.0, 65.0)  # sRGB at the centre of the wall and far from it
STUDIO_CENTRE = (0.5, 0.42)  # of the bright area, as shares of width and height


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A face with its camera, lights (7, 6), soft shadows and background (H, W, 3); built by `build_scene`."""

    face: Face
    picture: Picture
    surface: Surface
    optics: CameraMatrices
    lights: NDArray[np.float32]
    exposure: Exposure
    background: NDArray[np.uint8]

    def with_picture(self, picture: Picture) -> "Scene":
        """The same scene with another number of samples a pixel."""
        share = picture.samples_per_side / self.picture.samples_per_side
        return replace(self, picture=picture, optics=self.optics.scaled(share))

    def seen_by(self, optics: CameraMatrices) -> "Scene":
        """The same scene from another camera, before lamps that stay where they are."""
        lights = light_table(lamp_directions(self.picture.view), optics)
        surface = build_surface(self.face, scatters=self.picture.quality != DRAFT)  # another camera may see its backs
        return replace(self, surface=surface, optics=optics, lights=lights)

    def pose(self, weights: NDArray[np.float32], head: NDArray[np.float32]) -> Pose:
        """The face with shape weights (K,) and a head pose (6,), lit."""
        surface, view = self.surface, self.optics.view
        points = surface.rig.deform(weights)
        surface.rig.sink_eyes(weights, points)
        surface.rig.move_head(head, points)
        lamps = self.lights[FIRST_LIGHT_ROW:, :3]
        turn = (view[:, :3] @ head_transform(head, surface.rig.pivot)[:, :3]).astype(np.float32)
        eyes = surface.eyes.table((points, weights, head), view, lamps)
        return Pose(points, self.lights, self.exposure.at(weights), eyes, turn)

    def allocate_buffers(self) -> DrawingBuffers:
        """Buffers for pictures of this scene."""
        picture, size = self.picture, (self.picture.width, self.picture.height)
        return allocate_buffers(self.surface, size, picture.samples_per_side)

    def draw(
        self,
        weights: NDArray[np.float32],
        head: NDArray[np.float32],
        buffers: DrawingBuffers,
        pixels: NDArray[np.uint8],
    ) -> None:
        """Draw the face with shape weights (K,) and a head pose (6,) over the background in `pixels`, in place."""
        draw_surface(self.pose(weights, head), self.surface, self.optics, buffers, pixels)


def build_scene(face: Face, picture: Picture) -> Scene:
    """Scene of a face and a picture; tracing the shadows of a face without occlusion takes a second.

    Raises
    ------
    DataError
        The background image cannot be read.
    """
    surface, towards = build_surface(face, scatters=picture.quality != DRAFT), lamp_directions(picture.view)
    camera = camera_matrices(picture.view, face, picture.samples)
    exposure = compute_exposure(face, surface, towards, available_cores())
    surface = without_hidden_backs(face, surface, picture.view)
    return Scene(face, picture, surface, camera, light_table(towards, camera), exposure, draw_background(picture))


def without_hidden_backs(face: Face, surface: Surface, view: CameraView) -> Surface:
    """Surface without the back faces of closed parts, which are a third of the work, unless the camera sees some.

    It sees them through the neck from below, or through the mouth of a character without a mouth cavity.
    """
    size = (BACKS_SIDE_PX, BACKS_SIDE_PX)
    camera, buffers = camera_matrices(view, face, size), allocate_buffers(surface, size, 1)
    is_closed = surface.materials[surface.part_of, OPEN_SURFACE] == 0
    for weights in occlusion_poses(face):
        optics = (camera.view, camera.lens)
        members = project_surface(surface.rig.pose(weights), surface, optics, buffers, size)
        draw_samples(surface, camera.lens, members, 0, buffers)
        backs = ~buffers.owner[0][buffers.owner[0] < 0]
        if is_closed[backs].any():
            return surface
    phase = surface.phase.copy()
    phase[is_closed, 1] = NOT_DRAWN
    return replace(surface, phase=phase)


def draw_background(picture: Picture, studio: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
    """Background (H, W, 3) of a picture, sRGB; black for a transparent picture; a face may have its own studio."""
    kind = parse_background(picture.background)
    if kind == BLUR:
        raise InputError("--background blur is the background of a photograph, and the face is none; choose another")
    if isinstance(kind, Path):
        return _load_image(kind, picture.width, picture.height)
    plain = np.zeros((picture.height, picture.width, 3), np.uint8)
    if kind == STUDIO:
        if studio is not None:
            from PIL import Image

            return _fitted(Image.fromarray(studio), picture.width, picture.height)
        return _draw_studio(picture.width, picture.height)
    if isinstance(kind, tuple):
        plain[:] = kind
    return plain


def _draw_studio(width: int, height: int) -> NDArray[np.uint8]:
    """Wall with a soft radial gradient; ordered dither hides the quantisation steps."""
    across = ((np.arange(width) + 0.5) / width - STUDIO_CENTRE[0])[None, :] * min(1.6, max(1.0, width / height))
    along = ((np.arange(height) + 0.5) / height - STUDIO_CENTRE[1])[:, None]
    falloff = np.exp(-2.6 * (across**2 + along**2))[:, :, None]
    wall = np.array(STUDIO_DARK) + (np.array(STUDIO_BRIGHT) - STUDIO_DARK) * falloff
    bayer = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) / 16
    # a wall's gradient in 8 bits would show its steps
    dither = np.tile(bayer, (-(-height // 4), -(-width // 4)))[:height, :width, None]
    return np.floor(wall + dither).astype(np.uint8)


def _load_image(path: Path, width: int, height: int) -> NDArray[np.uint8]:
    with open_picture(path, "the background image") as file:
        return _fitted(file if file.mode == "RGB" else file.convert("RGB"), width, height)  # which would copy it


def _fitted(image: Any, width: int, height: int) -> NDArray[np.uint8]:
    """Image of Pillow scaled and cropped to fill the picture."""
    from PIL import Image, ImageOps

    return np.array(ImageOps.fit(image, (width, height), Image.Resampling.LANCZOS))
